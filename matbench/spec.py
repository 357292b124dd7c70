"""Selectors such as ``materiality[pairs=all,consecutive passes=20]``: a name and options in brackets.

Options are separated by blanks. Several values of an option are separated by commas, and each is taken
in turn. A value with blanks or commas in it stands in quotes. The name before the brackets may be a
glob pattern.
"""

import re
from collections.abc import Iterable, Mapping
from itertools import product
from typing import TypeVar

from attrs import field, frozen

from matbench.errors import UserError

Value = bool | int | float | str | None
T = TypeVar("T")


@frozen
class Spec:
    """A name and one value for each option."""

    name: str
    options: Mapping[str, str] = field(factory=dict)

    def __str__(self) -> str:
        return label(self.name, self.options)


def label(name: str, options: Mapping[str, Value]) -> str:
    """``name`` or ``name[key=value ...]``, keys in the order given.

    >>> label("sgbm", {"fill": False, "block_size": 5})
    'sgbm[fill=false block_size=5]'
    """
    return f"{name}[{text(options)}]" if options else name


def text(options: Mapping[str, Value]) -> str:
    """``key=value ...`` as it is typed."""
    return " ".join(f"{key}={typed(value)}" for key, value in options.items())


def typed(value: Value) -> str:
    """A value as it is typed: ``true`` and ``none`` in small letters, and in quotes if it needs them."""
    said = str(value).lower() if value is None or isinstance(value, bool) else str(value)
    if isinstance(value, str) and re.search(r"[\s,'\"]", said):
        quote = '"' if "'" in said else "'"
        return f"{quote}{said}{quote}"
    return said


_VALUES = r"""(?:'[^']*'|"[^"]*"|[^\s,])"""


def _values(text: str) -> list[str]:
    """The values in a text, separated by commas, without the quotes around them."""
    found = re.findall(rf"(?:^|,)({_VALUES}*)", text)
    return [one[1:-1] if re.fullmatch(r"""'[^']*'|"[^"]*\"""", one) else one for one in found]


def parse(selector: str) -> list[Spec]:
    """Read one selector, or several separated by commas, into every combination of its values.

    >>> [str(s) for s in parse("a[x=1,2 y=3],b")]
    ['a[x=1 y=3]', 'a[x=2 y=3]', 'b']

    Raises
    ------
    UserError
        If the brackets or the options in them are malformed.
    """
    specs = []
    for part in re.split(r",(?![^\[]*\])", selector):
        found = re.fullmatch(r"\s*([^\[\]\s]+(?: +[^\[\]\s]+)*)\s*(?:\[([^\[\]]*)\])?\s*", part)
        if not found or (" " in found.group(1) and "/" not in found.group(1)):  # only paths may hold blanks
            raise UserError(
                f"cannot read {part!r}: write NAME or NAME[key=value key=value], such as 'sgbm[fill=false]'"
            )
        name, inside = found.group(1), found.group(2) or ""
        choices: dict[str, list[str]] = {}
        for option in re.findall(rf"(?:{_VALUES}|,)+", inside):
            key, equals, values = option.partition("=")
            if not (key and equals and all(_values(values))):
                raise UserError(f"cannot read {option!r} in {part.strip()!r}: write key=value or key=value,value")
            if key in choices:
                raise UserError(f"{key!r} stands twice in {part.strip()!r}: write {key}=value,value for each in turn")
            choices[key] = _values(values)
        specs += [Spec(name, dict(zip(choices, picked, strict=True))) for picked in product(*choices.values())]
    return specs


def read_scene(name: str) -> Spec:
    """A scene's name and its options. If the text is no selector, all of it is the name: datasets may name scenes so.

    >>> read_scene("synthetic/box[n=3]").options, read_scene("a b[").name
    ({'n': '3'}, 'a b[')
    """
    try:
        (found,) = parse(name)
    except (UserError, ValueError):
        return Spec(name)
    return found


def expand(selectors: str | Iterable[str]) -> list[Spec]:
    """All specs of one or several selectors, in order, each once."""
    texts = [selectors] if isinstance(selectors, str) else list(selectors)
    found: dict[str, Spec] = {}
    for one in texts:
        for spec in parse(one):
            found.setdefault(str(spec), spec)
    return list(found.values())
