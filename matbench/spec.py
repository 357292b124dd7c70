"""Selectors such as ``materiality[pairs=all,consecutive passes=20]``: a name and options in brackets.

Options are separated by blanks. Several values of an option are separated by commas, and each is taken
in turn. A value with blanks or commas in it stands in quotes, and so does a name with brackets or commas.
The name before the brackets may be a glob pattern. Of a method, ``as LABEL`` may follow: that is what tables and
figures call it (`labelled`). What nobody can see, such as a tab, stands in no name, value or label (`refuse_hidden`).
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache, partial
from itertools import product
from math import prod
from typing import TYPE_CHECKING

from attrs import field, frozen

from matbench._moved import moved_name
from matbench.errors import UserError, refuse_hidden
from matbench.typed import Value, typed

MOST = 100_000
"""Combinations that are asked for at once."""
_LONGEST = 1 << 16  # characters of a selector

if not TYPE_CHECKING:
    __getattr__ = partial(moved_name, __name__)


@frozen
class Spec:
    """A name and one value for each option."""

    name: str
    options: Mapping[str, str] = field(factory=dict)

    def __attrs_post_init__(self) -> None:
        refuse_hidden("name", self.name)
        for key, value in self.options.items():
            refuse_hidden(f"option of {self.name}:", key)
            refuse_hidden(f"{key} of {self.name}:", value)

    def __str__(self) -> str:
        return label(self.name, self.options)


def label(name: str, options: Mapping[str, Value]) -> str:
    """``name`` or ``name[key=value ...]``, keys in the order given.

    >>> label("sgbm", {"fill": False, "block_size": 5})
    'sgbm[fill=false block_size=5]'
    >>> label("./scans [2]", {"ref": "0"})
    '"./scans [2]"[ref=0]'
    """
    return f"{quoted(name)}[{text(options)}]" if options else quoted(name)


def quoted(name: str) -> str:
    """A name as it is typed: in quotes if it has brackets or commas, quotes around it, or blanks and is no path."""
    has_blanks = re.search(r"\s", name) is not None and "/" not in name
    if not has_blanks and not re.search(r"[\[\],]", name) and not re.fullmatch(_QUOTED, name):
        return name
    return f'"{name}"' if '"' not in name else f"'{name}'"


def text(options: Mapping[str, Value]) -> str:
    """``key=value ...`` as it is typed."""
    return " ".join(f"{key}={typed(value)}" for key, value in options.items())


_QUOTED = r"""'[^']+'|"[^"]+\""""
_NAMED = re.compile(rf"\s*({_QUOTED})\s*(?:\[([^\[\]]*)\])?\s*(?=,|$|(?<=\s)as\s)")
_PLAIN = re.compile(r"\s*([^\[\]\s]+(?:\s+[^\[\]\s]+)*)\s*(?:\[([^\[\]]*)\])?\s*")
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
        If the brackets or the options in them are malformed, or there are more than `MOST` combinations.
    """
    parts = _parts(selector)
    if (found := _combinations(parts)) > MOST:
        shown = selector if len(selector) < 100 else f"{selector[:97]}..."
        raise UserError(f"{shown!r} means {found} combinations: {MOST} are possible")
    return [Spec(name, dict(zip(given, one, strict=True))) for name, given in parts for one in product(*given.values())]


def count(selector: str) -> int:
    """How many specs `parse` would give, without making them: a kilobyte can mean more than memory can hold."""
    return _combinations(_parts(selector))


def _combinations(parts: Iterable[tuple[str, Mapping[str, Sequence[str]]]]) -> int:
    return sum(prod(map(len, given.values())) for _, given in parts)


def _parts(selector: str) -> list[tuple[str, dict[str, list[str]]]]:
    """Each name in a selector with the values given for each of its options."""
    if len(selector) > _LONGEST:
        raise UserError(f"{selector[:40]!r}... is no selector: it has {len(selector)} characters, {_LONGEST} at most")
    parts = []
    for part in _split(selector):
        stands_in_quotes = _NAMED.fullmatch(part)
        found = stands_in_quotes or _PLAIN.fullmatch(part)
        name = "" if found is None else found[1][1:-1] if stands_in_quotes else found[1]
        is_odd = not stands_in_quotes and re.search(r"\s", name) and "/" not in name  # only paths may hold blanks
        if found is None or is_odd:
            hint = "a label of several words" if re.search(r"\sas(\s|$)", part) else "a name with brackets or commas"
            raise UserError(
                f"cannot read {part!r}: write NAME or NAME[key=value key=value], such as 'sgbm[fill=false]'; "
                f"{hint} stands in quotes of its own"
            )
        inside = found[2] or ""
        choices: dict[str, list[str]] = {}
        for option in re.findall(rf"(?:{_VALUES}|,)+", inside):
            key, equals, values = option.partition("=")
            if not (key and equals and all(_values(values))):
                raise UserError(
                    f"cannot read {option!r} in {part.strip()!r}: write key=value or key=value,value; "
                    "a name with brackets or commas stands in quotes of its own"
                )
            if key in choices:
                raise UserError(f"{key!r} stands twice in {part.strip()!r}: write {key}=value,value for each in turn")
            choices[key] = _values(values)
            if both := [one for one in choices[key] if "'" in one and '"' in one]:
                raise UserError(f"{key}={both[0]} in {part.strip()!r} holds both kinds of quotes: use only one of them")
        parts.append((name, choices))
    return parts


def _split(selector: str, shape: str | None = None) -> list[str]:
    """The selectors in a text, separated by commas outside of quoted names and of brackets.

    A comma is outside of brackets if no closing one follows next.

    Parameters
    ----------
    shape
        A text of the same length in which commas and brackets are looked for; by default the text itself.
    """
    ends, bracket = [len(selector)], ""
    for found in reversed(list(re.finditer(r"[\[\],]", selector if shape is None else shape))):
        if found[0] != ",":
            bracket = found[0]
        elif bracket != "]":
            ends.append(found.start())
    parts, begin = [], 0
    while ends:
        end = ends.pop()
        if end < begin:  # a comma in a quoted name
            continue
        if named := _NAMED.match(selector, begin):
            while end < named.end():  # further commas in it
                end = ends.pop()
        parts.append(selector[begin:end])
        begin = end + 1
    return parts if begin > len(selector) else [*parts, selector[begin:]]


@frozen
class Asked:
    """One method of a request.

    Parameters
    ----------
    label
        What it is to be called; empty if nothing is said.
    swept
        The options of its selector that have several values there.
    """

    spec: Spec
    label: str = ""
    swept: tuple[str, ...] = ()


_LABEL = r"""(?:"[^"]*"|'[^']*'|[\w.+-]+)"""


def labelled(selectors: str | Iterable[str]) -> list[Asked]:
    """All methods that selectors name, in order, each with its label.

    >>> [(str(a.spec), a.label, a.swept) for a in labelled("sgbm, mine[x=1,2 y=3] as 'wide, slow'")]
    [('sgbm', '', ()), ('mine[x=1 y=3]', 'wide, slow', ('x',)), ('mine[x=2 y=3]', 'wide, slow', ('x',))]

    Raises
    ------
    UserError
        As `parse`, and for a label that is empty or holds what nobody can see.
    """
    found: dict[tuple[str, str], Asked] = {}
    for text in [selectors] if isinstance(selectors, str) else list(selectors):
        # commas and brackets in a label separate nothing
        shape = re.sub(rf"\sas\s+{_LABEL}\s*(?=,|$)", lambda label: re.sub(r"[\[\],]", "_", label[0]), text)
        for part in _split(text, shape):
            selector, label = split_label(part)
            specs = parse(selector)
            if re.match(r"[^/'\"\[]+\sas\s", selector):  # because of a slash behind it, all of it is read as a path
                raise UserError(f"cannot read the label in {part.strip()!r}: one with a slash stands in quotes")
            swept = tuple(key for _, given in _parts(selector) for key, values in given.items() if len(values) > 1)
            for one in specs:
                found.setdefault((str(one), label), Asked(one, label, swept))
        if len(found) > MOST:
            raise UserError(f"{len(found)} names are asked for: {MOST} are possible")
    return list(found.values())


def split_label(text: str) -> tuple[str, str]:
    """What stands before ``as LABEL``, and the label; empty if there is none.

    >>> split_label("runs/old as before"), split_label("sgbm")
    (('runs/old', 'before'), ('sgbm', ''))
    """
    found = re.fullmatch(rf"(.*\S)\s+as\s+({_LABEL})\s*", text, re.DOTALL)
    if found is None:
        return text, ""
    label = found[2][1:-1].strip() if found[2][0] in "'\"" else found[2]
    if not label:
        raise UserError(f"the label in {text.strip()!r} is empty: write SELECTOR as LABEL")
    refuse_hidden("label", label)
    return found[1], label


def read_scene(name: str) -> Spec:
    """A scene's name and its options. If the text is no selector, all of it is the name: datasets may name scenes so.

    >>> read_scene("synthetic/box[n=3]").options, read_scene("a b[").name
    ({'n': '3'}, 'a b[')
    """
    try:
        return parse(name)[0] if count(name) == 1 else Spec(name)
    except UserError:
        return Spec(name)


@lru_cache(maxsize=1 << 14)  # pages ask for the same names thousands of times
def witness(scene: str) -> str:
    """What a scene counts as where scenes are counted: with other options, such as noise, it is no second witness.

    >>> witness("synthetic/box[noise=4]")
    'synthetic/box'
    """
    return read_scene(scene).name


def expand(selectors: str | Iterable[str]) -> list[Spec]:
    """All specs of one or several selectors, in order, each once."""
    texts = [selectors] if isinstance(selectors, str) else list(selectors)
    found: dict[str, Spec] = {}
    for one in texts:
        for spec in parse(one):
            found.setdefault(str(spec), spec)
        if len(found) > MOST:
            raise UserError(f"{len(found)} names are asked for: {MOST} are possible")
    return list(found.values())
