"""Values of options and parameters, and how they are typed."""

import re

Value = bool | int | float | str | None


def typed(value: Value) -> str:
    """A value as it is typed: ``true`` and ``none`` in small letters, and in quotes if it needs them."""
    said = str(value).lower() if value is None or isinstance(value, bool) else str(value)
    if isinstance(value, str) and re.search(r"[\s,'\"]", said):
        quote = '"' if "'" in said else "'"
        return f"{quote}{said}{quote}"
    return said
