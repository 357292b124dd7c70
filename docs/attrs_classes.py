"""A step of the site's build: what attrs classes take, which their source does not spell out as a constructor."""

from typing import Any

from griffe import (
    Attribute,
    Class,
    Expr,
    ExprCall,
    ExprKeyword,
    Extension,
    Function,
    Parameter,
    ParameterKind,
    Parameters,
)


class AttrsClasses(Extension):
    """Adds to every class decorated with ``frozen`` or ``define`` the constructor that its fields make."""

    def on_class_members(self, *, cls: Class, **_: Any) -> None:
        names = {str(decorator.value).partition("(")[0] for decorator in cls.decorators}
        if not names & {"frozen", "define"} or "__init__" in cls.members:
            return
        fields = [
            Parameter(
                name.lstrip("_"), annotation=member.annotation, kind=ParameterKind.positional_or_keyword, default=value
            )
            for name, member in cls.members.items()
            if isinstance(member, Attribute) and member.annotation and "instance-attribute" in member.labels
            for is_taken, value in [_default(member.value)]
            if is_taken
        ]
        cls.set_member("__init__", Function("__init__", parameters=Parameters(*fields)))


def _default(value: str | Expr | None) -> tuple[bool, str | Expr | None]:
    """Whether the constructor takes a field, and the default written there."""
    if not isinstance(value, ExprCall) or str(value.function) != "field":
        return True, value
    given = {part.name: part.value for part in value.arguments if isinstance(part, ExprKeyword)}
    if str(given.get("init")) == "False":
        return False, None
    return True, f"{given['factory']}()" if "factory" in given else given.get("default")
