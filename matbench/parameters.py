"""A method's parameters: their types and groups, how their values are read, and which of them have no effect.

A constructor's arguments are the parameters. An argument whose type is an attrs class is a group of them.
"""

import inspect
from collections.abc import Mapping
from functools import wraps
from math import isfinite
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from attrs import Attribute, Factory, evolve, fields_dict, frozen, has
from cattrs import Converter

from matbench.errors import UserError, failure, one_line, unknown
from matbench.typed import Value, typed

T = TypeVar("T")


def _strict(kind: type, read: Mapping[str, Any] | None = None) -> Any:
    def hook(value: Any, _: type) -> Any:
        if isinstance(value, kind) and not (kind is not bool and isinstance(value, bool)):
            return value
        if read is not None:
            return read[str(value).lower()]
        if isinstance(value, float) and kind is int:
            raise ValueError(value)
        return kind(value)

    return hook


def _finite(value: Any, kind: type) -> float:
    number: float = _strict(float)(value, kind)
    if not isfinite(number):
        raise ValueError(value)
    return number


def _is_literal(kind: Any) -> bool:
    return bool(get_origin(kind) == Literal)


def _literal(value: Any, kind: Any) -> Any:
    return {str(choice): choice for choice in get_args(kind)}[str(value)]


def _made() -> Converter:
    converter = Converter()
    truths = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
    converter.register_structure_hook(bool, _strict(bool, truths))
    converter.register_structure_hook(int, _strict(int))
    converter.register_structure_hook(float, _finite)
    converter.register_structure_hook(Path, lambda value, _: Path(str(value)).expanduser())
    converter.register_structure_hook_func(_is_literal, _literal)
    converter.register_structure_hook_func(lambda kind: kind is Any, lambda value, _: value)
    return converter


_CONVERTER = _made()
"""Made once, before the processes of cells are forked: it takes as long as a small cell."""


def describe(kind: Any) -> str:
    """A parameter's type in words: "a whole number", "plane, ray or volume"."""
    if _is_literal(kind):
        *most, last = map(str, get_args(kind))
        return f"{', '.join(most)} or {last}" if most else last
    return {bool: "true or false", int: "a whole number", float: "a number", str: "a text", Path: "a path"}.get(
        kind, str(kind)
    )


@frozen
class Parameter:
    """One parameter of a method.

    Parameters
    ----------
    kind
        Its type.
    default
        `inspect.Parameter.empty` if it must be given.
    group
        The argument of the constructor whose class holds it; empty if the parameter is an argument itself.
    """

    kind: Any
    default: Any
    group: str = ""


def parameters(cls: type) -> dict[str, Parameter]:
    """Every parameter of a method by its name.

    An argument of the constructor whose type is an attrs class is a group. Its fields are parameters under their own
    names, and all names must differ. If the argument has a default, its values are the defaults of the fields.

    Raises
    ------
    UserError
        If they cannot be read, as with an annotation of an unknown name, or if two have the same name.
    """
    found: dict[str, Parameter] = {}
    arguments = _arguments(cls)
    for name, (kind, default) in arguments.items():
        if is_group(kind):
            given = values_of(default) if isinstance(default, kind) else {}
            own = {
                key: evolve(one, group=name, default=given.get(key, one.default))
                for key, one in parameters(kind).items()
            }
            if twice := [key for key in own if key in found or key in arguments]:
                raise UserError(
                    f"{cls.__name__}: parameter {twice[0]!r} of group {name!r} has the name of another: rename one"
                )
        else:
            own = {name: Parameter(kind, default)}
        found |= own
    return found


def is_group(kind: Any) -> bool:
    """Is an argument of that type a group of parameters?"""
    return isinstance(kind, type) and has(kind)


def _arguments(cls: type) -> dict[str, tuple[Any, Any]]:
    """Name -> (type, default) of every argument of a constructor; a group is one argument."""
    try:
        hints = get_type_hints(vars(cls)["__init__"]) if "__init__" in vars(cls) else {}
        signature = inspect.signature(cls)
    except (NameError, TypeError, ValueError, AttributeError) as error:
        raise UserError(f"{cls!r} is no method: its parameters cannot be read: {one_line(error)}") from error
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    taken = [p for p in signature.parameters.values() if p.kind in kinds]
    return {p.name: (hints.get(p.name, _kind_of(p.default)), _default(cls, p)) for p in taken}


def _default(cls: type, argument: inspect.Parameter) -> Any:
    """The default of an argument, also if an attrs class makes it by a factory."""
    field_ = fields_dict(cls).get(argument.name) if has(cls) else None
    made: Any = None if field_ is None else field_.default
    return made.factory() if isinstance(made, Factory) and not made.takes_self else argument.default  # type: ignore[arg-type]


def _grouped(cls: type, given: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of the constructor, from parameters by name. A group that is given whole keeps its other values."""
    taken = dict(given)
    for name, (kind, default) in _arguments(cls).items():
        if is_group(kind):
            own = {key: taken.pop(key) for key in parameters(kind) if key in taken}
            whole = taken.get(name, default)
            if own or whole is inspect.Parameter.empty:
                kept = values_of(whole) if isinstance(whole, kind) else {}
                taken[name] = kind(**_grouped(kind, kept | own))
    return taken


def flat(cls: type[T]) -> type[T]:
    """Class decorator: the constructor takes the parameters of its groups by their own names, too.

    ``Materiality(pairs="all")`` then means ``Materiality(matching=Matching(pairs="all"))``, and `attrs.evolve`
    takes ``pairs="all"`` as well. A parameter without effect (`silent_in`) raises ValueError, unless its value
    is its default.
    """
    made = cls.__init__

    @wraps(made)
    def init(self: T, *args: Any, **given: Any) -> None:
        made(self, *args, **_grouped(cls, given))
        known, silent = parameters(cls), silent_in(self)
        for key, value in given.items():
            if key in silent and known[key].group and value != known[key].default:
                raise ValueError(_changes_nothing(key, value, silent))

    cls.__init__ = init  # type: ignore[method-assign, assignment]
    return cls


def silent_in(instance: object) -> Mapping[str, str]:
    """Parameter -> what it needs to have an effect, for those without effect beside the values of the others.

    Empty if the method's `silent` is no mapping.
    """
    silent = getattr(instance, "silent", {})
    return silent if isinstance(silent, Mapping) else {}


def refuse_silent(name: str, instance: object, options: Mapping[str, Any]) -> None:
    """Refuse options without effect: whoever gives one expects it to change something.

    Raises
    ------
    UserError
        If an option changes nothing beside the values of the others, or the method's `silent` fails.
    """
    try:
        silent = silent_in(instance)
    except Exception as error:  # whatever a method's own code raises
        raise UserError(f"{name}: its silent parameters cannot be told: {one_line(error)}") from error
    for key, value in options.items():
        if key in silent:
            raise UserError(f"{name}: {_changes_nothing(key, value, silent)}")


def _changes_nothing(key: str, value: Any, silent: Mapping[str, str]) -> str:
    return f"{key}={typed(value)} changes nothing here: it takes {silent[key]}"


def required(cls: type) -> list[str]:
    """The parameters that have no default."""
    return [key for key, one in parameters(cls).items() if one.default is inspect.Parameter.empty]


def _kind_of(default: object) -> Any:
    """The type of a parameter without annotation: the type of its default if that is a simple one, else any."""
    if isinstance(default, Path):
        return Path
    return type(default) if type(default) in (bool, int, float, str) else Any


def presets_of(cls: type) -> Mapping[str, Mapping[str, Any]]:
    """Name -> parameters: the presets of a method; none if its `presets` are no mapping."""
    presets = getattr(cls, "presets", {})
    return presets if isinstance(presets, Mapping) else {}


def build(name: str, cls: type, options: Mapping[str, Any]) -> Any:
    """Make an instance of a method from options, given as typed texts or as values.

    ``preset=NAME`` starts from one of the method's presets; other options override its values.

    Raises
    ------
    UserError
        For an unknown parameter or preset, or a value of the wrong kind, naming what is possible.
    """
    fields = parameters(cls)
    chosen = dict(options)
    presets = presets_of(cls)
    preset = chosen.pop("preset", None) if "preset" not in fields else None
    if preset is not None and preset not in presets:
        raise unknown(f"preset of {name}", str(preset), presets)
    values: dict[str, Any] = dict(presets[preset]) if preset is not None else {}
    for key, value in chosen.items():
        if key not in fields:
            raise unknown(f"parameter of {name}", key, [*fields, *(["preset"] if presets else [])])
        kind = fields[key].kind
        try:
            values[key] = _CONVERTER.structure(value, kind)
        except Exception:  # whatever a converter raises for a value that is not of its type
            raise UserError(f"{name}: {key}={value} is not {describe(kind)}") from None
    missing = [key for key in required(cls) if key not in values]
    if missing:
        raise UserError(f"{name}: {', '.join(missing)} must be given, as {name}[{missing[0]}=VALUE]")
    try:
        return cls(**_grouped(cls, values))
    except (ValueError, UserError) as error:  # meant for whoever chose the values
        # attrs puts the attribute itself beside what it says of it
        said = ValueError(error.args[0]) if error.args[1:] and isinstance(error.args[1], Attribute) else error
        raise UserError(f"{name}: {one_line(said)}") from error
    except Exception as error:
        raise UserError(f"{name}: {failure(error)}") from error


def values_of(instance: object) -> dict[str, Value]:
    """Every parameter of a method's instance with its value.

    Raises
    ------
    UserError
        If the instance has no attribute of a parameter's name, or the value is no simple one: it could not
        be stored, nor told from other values.
    """
    values: dict[str, Value] = {}
    for key, (kind, _) in _arguments(type(instance)).items():
        value = plain(getattr(instance, key, _MISSING))
        if is_group(kind) and isinstance(value, kind):
            values |= values_of(value)
            continue
        if not (value is None or isinstance(value, bool | int | float | str)):
            kept = "it is not kept" if value is _MISSING else f"it is kept as {type(value).__name__}"
            raise UserError(
                f"{type(instance).__name__}: parameter {key!r} must be kept as self.{key}, "
                f"a truth value, number, text or path; {kept}"
            )
        values[key] = value
    return values


_MISSING = object()


def plain(value: Any) -> Any:
    """A parameter's value as it is stored: paths as text."""
    return str(value) if isinstance(value, Path) else value


def paths_of(instance: object) -> dict[str, Path]:
    """Parameter -> path, for those parameters of a method's instance that are paths and have a value."""
    found, values = {}, values_of(instance)
    for key, one in parameters(type(instance)).items():
        value = values.get(key)
        if isinstance(value, str) and Path in (one.kind, *get_args(one.kind)):
            found[key] = Path(value)
    return found


def changed(instance: object, preset: str | None = None) -> dict[str, Value]:
    """The parameters that differ from their defaults; with a preset, its name and those that differ from it."""
    cls = type(instance)
    base = {key: one.default for key, one in parameters(cls).items()}
    named: dict[str, Value] = {} if preset is None else {"preset": preset}
    base |= presets_of(cls)[preset] if preset is not None else {}
    return named | {key: value for key, value in values_of(instance).items() if value != plain(base[key])}
