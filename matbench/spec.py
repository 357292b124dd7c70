"""Selectors such as ``materiality[pairs=all,consecutive passes=20]``: a name and options in brackets.

Options are separated by blanks; commas inside a value mean "each of these in turn"; quotes hold
together a value that has blanks or commas in it. Brackets are read before anything else, so what
stands before them may be a glob pattern.
"""

import inspect
import re
from collections.abc import Iterable, Mapping
from functools import cache
from itertools import product
from math import isfinite
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

from attrs import field, frozen
from cattrs import Converter

from matbench.errors import UserError, unknown

Value = bool | int | float | str | None


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
    return " ".join(f"{key}={_typed(value)}" for key, value in options.items())


def _typed(value: Value) -> str:
    said = str(value).lower() if value is None or isinstance(value, bool) else str(value)
    if isinstance(value, str) and re.search(r"[\s,'\"]", said):
        quote = '"' if "'" in said else "'"
        return f"{quote}{said}{quote}"
    return said


_VALUES = r"""(?:'[^']*'|"[^"]*"|[^\s,])"""


def _values(text: str) -> list[str]:
    """What stands between commas, without quotes around it."""
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
    """A scene's name and its options; a dataset may call a scene what is no selector, too.

    >>> read_scene("synthetic/box[n=3]").options, read_scene("a b[").name
    ({'n': '3'}, 'a b[')
    """
    try:
        (found,) = parse(name)
    except (UserError, ValueError):
        return Spec(name)
    return found


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


@cache
def _converter() -> Converter:
    converter = Converter()
    truths = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
    converter.register_structure_hook(bool, _strict(bool, truths))
    converter.register_structure_hook(int, _strict(int))
    converter.register_structure_hook(float, _finite)
    converter.register_structure_hook(Path, lambda value, _: Path(str(value)).expanduser())
    converter.register_structure_hook_func(_is_literal, _literal)
    converter.register_structure_hook_func(lambda kind: kind is Any, lambda value, _: value)
    return converter


def describe(kind: Any) -> str:
    """A parameter's type in words: "a whole number", "plane, ray or volume"."""
    if _is_literal(kind):
        *most, last = map(str, get_args(kind))
        return f"{', '.join(most)} or {last}" if most else last
    return {bool: "true or false", int: "a whole number", float: "a number", str: "a text", Path: "a path"}.get(
        kind, str(kind)
    )


def parameters(cls: type) -> dict[str, tuple[Any, Any]]:
    """Name -> (type, default) of every parameter of a method; `inspect.Parameter.empty` for none.

    Raises
    ------
    UserError
        If they cannot be read, as with an annotation that names nothing.
    """
    try:
        hints = get_type_hints(vars(cls)["__init__"]) if "__init__" in vars(cls) else {}
        signature = inspect.signature(cls)
    except (NameError, TypeError, ValueError, AttributeError) as error:
        raise UserError(f"{cls!r} is no method: its parameters cannot be read: {first_line(error)}") from error
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    taken = [p for p in signature.parameters.values() if p.kind in kinds]
    return {p.name: (hints.get(p.name, _kind_of(p.default)), p.default) for p in taken}


def required(cls: type) -> list[str]:
    """The parameters that have no default."""
    return [key for key, (_, default) in parameters(cls).items() if default is inspect.Parameter.empty]


def _kind_of(default: object) -> Any:
    """The type of a parameter that has no annotation: that of its default, if it is a simple one."""
    if isinstance(default, Path):
        return Path
    return type(default) if type(default) in (bool, int, float, str) else Any


def presets_of(cls: type) -> Mapping[str, Mapping[str, Any]]:
    """A method's named sets of parameters; none where its `presets` are something else."""
    presets = getattr(cls, "presets", {})
    return presets if isinstance(presets, Mapping) else {}


def build(name: str, cls: type, options: Mapping[str, Any]) -> Any:
    """Make an instance of a method from typed or written options.

    ``preset=NAME`` starts from one of the method's named sets; other options then override it.

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
        kind = fields[key][0]
        try:
            values[key] = _converter().structure(value, kind)
        except Exception:  # whatever a converter raises for a value that is not of its type
            raise UserError(f"{name}: {key}={value} is not {describe(kind)}") from None
    missing = [key for key in required(cls) if key not in values]
    if missing:
        raise UserError(f"{name}: {', '.join(missing)} must be given, as {name}[{missing[0]}=VALUE]")
    try:
        return cls(**values)
    except Exception as error:
        raise UserError(f"{name}: {first_line(error)}") from error


def values_of(instance: object) -> dict[str, Value]:
    """Every parameter of a method's instance with its value.

    Raises
    ------
    UserError
        If an instance does not keep a parameter under its name, or its value is no simple one:
        it could be neither stored nor told from others.
    """
    values: dict[str, Value] = {}
    for key in parameters(type(instance)):
        value = plain(getattr(instance, key, _MISSING))
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
    """Those parameters of a method's instance that are paths, if they are given."""
    found = {}
    for key, (kind, _) in parameters(type(instance)).items():
        value = getattr(instance, key, None)
        if isinstance(value, Path) or (isinstance(value, str) and Path in (kind, *get_args(kind))):
            found[key] = Path(value)
    return found


def changed(instance: object, preset: str | None = None) -> dict[str, Value]:
    """Only those parameters that differ from their defaults, or the preset's name and what differs from it."""
    cls = type(instance)
    base = {key: default for key, (_, default) in parameters(cls).items()}
    named: dict[str, Value] = {} if preset is None else {"preset": preset}
    base |= presets_of(cls)[preset] if preset is not None else {}
    return named | {key: value for key, value in values_of(instance).items() if value != plain(base[key])}


def first_line(error: BaseException) -> str:
    """What an exception says, in one line; its type where it says nothing."""
    said = str(error.args[0] if error.args else error).strip()
    return said.splitlines()[0] if said else type(error).__name__


def expand(selectors: str | Iterable[str]) -> list[Spec]:
    """All specs of one or several selectors, in order, each once."""
    texts = [selectors] if isinstance(selectors, str) else list(selectors)
    found: dict[str, Spec] = {}
    for one in texts:
        for spec in parse(one):
            found.setdefault(str(spec), spec)
    return list(found.values())
