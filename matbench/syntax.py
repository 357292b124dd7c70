"""Digests and imports of Python sources, read from their syntax trees; nothing is executed."""

import ast
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from hashlib import sha256
from typing import Any

from attrs import field, frozen

_FORM = {"kind", "type_comment", "type_ignores"}  # how something is written, not what it does
_TELLING = {ast.Import, ast.ImportFrom, ast.Call, ast.Attribute}


@frozen
class Import:
    """One name that a source imports.

    Parameters
    ----------
    level
        How many dots stand before the module: 0 for an absolute import.
    module
        Its dotted name.
    name
        What is taken from it, ``*`` for everything; empty for the module itself.
    is_attribute
        The name is not imported but used, as ``module.name``. It need not be a module.
    """

    level: int
    module: str
    name: str = ""
    is_attribute: bool = False


@frozen
class Facts:
    """What digests of code need to know about a source.

    Parameters
    ----------
    digest
        SHA-256 of what the source does: of its syntax tree without docstrings.
    imports
        All of its imports, except those for type checkers alone.
    names
        Name -> what is imported under it at the top level. Imports for type checkers are included: a package that
        imports its names only when they are first used says in these where the names come from.
    """

    digest: str
    imports: Sequence[Import] = ()
    names: Mapping[str, Import] = field(factory=dict)


@lru_cache(maxsize=4096)
def facts(source: bytes, is_package: bool) -> Facts:
    """Read a source. If it is not valid Python, its digest is that of its bytes, and it imports nothing.

    Parameters
    ----------
    is_package
        `names` are found only for packages.
    """
    try:
        tree = ast.parse(source)
        names = dict(_names(tree.body)) if is_package else {}
        drop_words(tree)
        words: list[str] = []
        telling: list[ast.AST] = []
        _write(tree, words, telling)
        whole = sha256("\0".join(words).encode("utf-8", "surrogatepass")).hexdigest()
        return Facts(whole, tuple(dict.fromkeys(_imports(telling))), names)
    except (SyntaxError, ValueError, RecursionError, MemoryError):  # who imports it gets the error
        return Facts(sha256(source).hexdigest())


def _write(node: Any, words: list[str], telling: list[ast.AST]) -> None:
    """Append the words of a tree to `words`, and its nodes that may tell of imports to `telling`.

    Line numbers are left out, and so are empty fields: later versions of Python have more of them.
    """
    if isinstance(node, ast.AST):
        kind, values = type(node), node.__dict__
        if kind in _TELLING:
            telling.append(node)
        words.append(kind.__name__)
        for name in node._fields:
            value = values.get(name)
            if value is not None and value != [] and name not in _FORM:
                words.append(name)
                _write(value, words, telling)
        words.append(")")
    elif isinstance(node, list):
        words.append("[")
        for one in node:
            _write(one, words, telling)
        words.append("]")
    else:
        words.append(repr(node))


def drop_words(tree: ast.AST) -> None:
    """Remove from a tree, in place, all that does nothing: docstrings, other lone texts, `pass`, `TYPE_CHECKING`."""
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        block = getattr(tree, name, None)
        if isinstance(block, list):
            kept = [one for one in block if not _does_nothing(one)]
            setattr(tree, name, kept)
            for one in kept:
                if _is_for_checkers(one):
                    one.body = []
                drop_words(one)


def _does_nothing(node: ast.AST) -> bool:
    is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    return is_text or isinstance(node, ast.Pass) or (_is_for_checkers(node) and not getattr(node, "orelse", None))


def _is_for_checkers(node: ast.AST) -> bool:
    """``if TYPE_CHECKING:``."""
    test = node.test if isinstance(node, ast.If) else None
    return getattr(test, "id", getattr(test, "attr", None)) == "TYPE_CHECKING"


def _names(body: Sequence[ast.stmt]) -> Iterator[tuple[str, Import]]:
    """The names that statements import, and from where."""
    for node in body:
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                yield alias.asname or alias.name, Import(node.level, node.module or "", alias.name)
        elif isinstance(node, ast.If | ast.Try):
            yield from _names(node.body)


def _imports(telling: Sequence[ast.AST]) -> Iterator[Import]:
    """All imports of a source, wherever they stand, and the attributes of imported names that it uses."""
    bound: dict[str, tuple[int, str]] = {}
    used: list[list[str]] = []
    for node in telling:
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(0, alias.name)
                top = alias.name.partition(".")[0]
                bound[alias.asname or top] = 0, alias.name if alias.asname else top
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                yield Import(node.level, node.module or "", alias.name)
                whole = f"{node.module}.{alias.name}" if node.module else alias.name
                bound[alias.asname or alias.name] = node.level, whole
        elif isinstance(node, ast.Call):
            yield from _called(node)
        elif isinstance(node, ast.Attribute) and (chain := _chain(node)):
            used.append(chain)
    for first, *rest in used:
        if first in bound:
            level, module = bound[first]
            for attribute in rest:
                yield Import(level, module, attribute, is_attribute=True)
                module = f"{module}.{attribute}"


def _called(node: ast.Call) -> Iterator[Import]:
    """The import in ``import_module("literal")``; the name may begin with dots."""
    called = getattr(node.func, "id", getattr(node.func, "attr", None))
    if called in ("import_module", "__import__") and node.args and isinstance(node.args[0], ast.Constant):
        name = node.args[0].value
        if isinstance(name, str) and name.strip("."):
            yield Import(len(name) - len(name.lstrip(".")), name.lstrip("."))


def _chain(node: ast.expr) -> list[str]:
    """The names in ``a.b.c``; empty if the expression does not begin with a name."""
    names: list[str] = []
    while isinstance(node, ast.Attribute):
        names.append(node.attr)
        node = node.value
    return [node.id, *names[::-1]] if isinstance(node, ast.Name) else []
