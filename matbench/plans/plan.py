"""What a run will do: the request, and its cells keyed by content."""

import json
from collections.abc import Iterable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

from attrs import field, frozen

from matbench import parameters, spec
from matbench.errors import UserError, refuse_hidden
from matbench.plans import plugins
from matbench.scene import Scene
from matbench.shelf import facts_of
from matbench.typed import Value

SCHEMA = 2  # raised when what is stored changes: every key changes with it, so all cells are computed again


def digest(value: Any) -> str:
    """Sixteen hexadecimal digits of SHA-256 over a value's canonical JSON."""
    return sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()[:16]


@frozen
class Method:
    """A method with one set of parameters.

    Parameters
    ----------
    algorithm
        Its name.
    params
        Every parameter with its value.
    changed
        The parameters that differ from their defaults, as text. Tables tell methods apart by it.
    code
        SHA-256 of its code.
    file
        The user's own file that it was named with, as in ``FILE.py:Class``; empty if it is found by its name alone.
    label
        What tables and figures call it; empty for its own name. No answer depends on it.
    shown
        The parameters that stand in its name, as text, if these are not `changed`: those with several values in a
        selector, also where they have their defaults; of a labelled method these alone.
    """

    algorithm: str
    params: Mapping[str, Value]
    changed: str = ""
    code: str = ""
    file: str = ""
    label: str = ""
    shown: str | None = None

    @property
    def names(self) -> tuple[str, str]:
        """What tables call it: the columns ``algorithm`` and ``params``."""
        return self.label or self.algorithm, self.changed if self.shown is None else self.shown

    def __str__(self) -> str:
        name, params = self.names
        return f"{name}[{params}]" if params else name


@frozen
class Cell:
    """One method on one scene with one seed.

    Parameters
    ----------
    key
        Digest of everything that decides the answer; the name of the cell's folder.
    repeat
        0 for the cell that is scored. The others solve the same again, to see whether the maps are the same.
    files
        Digest of the files that the method reads for this scene only; empty for most methods, which read none.
    """

    method: Method
    scene: str
    scene_digest: str
    seed: int
    key: str
    repeat: int = 0
    files: str = ""

    @property
    def question(self) -> tuple[str, str, str, int, int]:
        """What the cell asks, apart from code and pixels: algorithm, parameters, scene, seed and repeat."""
        params = json.dumps(dict(self.method.params), sort_keys=True)
        return self.method.algorithm, params, self.scene, self.seed, self.repeat

    def __str__(self) -> str:
        seed = f", seed {self.seed}" if self.seed else ""
        return f"{self.method} on {self.scene}{seed}" + (f", repeat {self.repeat}" if self.repeat else "")


@frozen
class Plan:
    """All cells of a run, in order: scene by scene, so that partial results compare like with like.

    Parameters
    ----------
    cells
        The cells to compute.
    plugin_files
        The users' own files: methods, scenes and metrics.
    spellings
        Name by which a scene was asked for -> its name in the cells, if these differ.
    among
        All scenes that a growing run may come to, in order, as they are asked for; empty if the run does not grow.
    """

    cells: tuple[Cell, ...]
    plugin_files: tuple[str, ...] = field(default=())
    spellings: Mapping[str, str] = field(factory=dict)
    among: tuple[str, ...] = ()

    @property
    def scored(self) -> tuple[Cell, ...]:
        """The cells that scores are computed from: no repeats."""
        return tuple(cell for cell in self.cells if not cell.repeat)

    @property
    def questions(self) -> tuple[tuple[Cell, ...], ...]:
        """The cells in groups that ask the same: the cell that is scored, then its repeats."""
        found: dict[tuple[object, ...], list[Cell]] = {}
        for cell in self.cells:
            found.setdefault((str(cell.method), *cell.question[:-1]), []).append(cell)
        return tuple(tuple(sorted(cells, key=lambda c: c.repeat)) for cells in found.values())

    @property
    def request(self) -> dict[str, Any]:
        """What was asked for, without code and pixels: the same request resumes the same run.

        That of a growing run is the same however far it has come.
        """
        methods = {}
        for m in {str(c.method): c.method for c in self.cells}.values():
            own = (f"{m.algorithm}[{m.changed}]" if m.changed else m.algorithm) + m.file  # labels ask for nothing
            methods[own] = [m.algorithm, dict(m.params), *([m.file] if m.file else [])]
        grows = {"grows": True} if self.among else {}
        return {
            "algorithms": [methods[name] for name in sorted(methods)],
            "scenes": list(self.among) or sorted({c.scene for c in self.cells}),
            **grows,
            "seeds": sorted({c.seed for c in self.cells}),
            "plugins": sorted(self.plugin_files),
        }

    @property
    def digest(self) -> str:
        """Short digest of the request; it names the default run folder."""
        return digest(self.request)[:8]


def methods(selectors: str | Sequence[str], files: Sequence[Path] = ()) -> list[Method]:
    """The methods that the selectors name, each once, with checked parameters.

    Raises
    ------
    UserError
        For an unknown method or parameter, a value that it does not take, or one that changes nothing
        beside the others; for one method under two names, or two under one.
    """
    found: dict[tuple[str, str], Method] = {}
    for asked in spec.labelled(selectors):
        one = asked.spec
        plugin = plugins.algorithm(one.name, files)
        instance = plugin.make(one.options)
        if not callable(getattr(instance, "solve", None)):
            raise UserError(f"{plugin.name} from {plugin.source} is no method: it has no solve(scene, context)")
        parameters.refuse_silent(plugin.name, instance, one.options)
        # a method may have a parameter called preset; then the word names no set of parameters
        preset = one.options.get("preset") if "preset" not in parameters.parameters(type(instance)) else None
        changed, params = parameters.changed(instance, preset), parameters.values_of(instance)
        refuse_hidden(f"parameters of {plugin.name}:", spec.text(changed))
        method = Method(
            plugin.name,
            params,
            spec.text(changed),
            plugins.method_digest(plugin, instance),
            plugin.source if plugins.is_in_file(one.name) else "",
            asked.label,
            _shown(asked, changed, params),
        )
        # spelled in two ways, it is one method
        known = found.setdefault((spec.label(plugin.name, params), method.code), method)
        if str(known) != str(method) or known.file != method.file:
            raise UserError(f"{known} and {method} are one method: the same code with the same parameters")
    _refuse_equal_names(found.values())
    return list(found.values())


def _shown(asked: spec.Asked, changed: Mapping[str, Value], params: Mapping[str, Value]) -> str | None:
    """`Method.shown`."""
    known = {**changed, **params}  # a preset is changed, but no parameter
    shown = {key: value for key, value in known.items() if key in asked.swept or (key in changed and not asked.label)}
    return None if shown == changed else spec.text(shown)


def _refuse_equal_names(found: Iterable[Method]) -> None:
    names: dict[str, Method] = {}
    for method in found:
        if (other := names.setdefault(str(method), method)) is not method:
            files = " and ".join(one.file or one.algorithm for one in (other, method))
            raise UserError(f"two methods are called {method} ({files}): give one a label, as in 'SELECTOR as LABEL'")


def plugin_of(method: Method, files: Iterable[Path] = ()) -> plugins.Plugin:
    """The plug-in of a planned method, in the file that it was named with, or in the given files and what is installed.

    Raises
    ------
    UserError
        If it is not there any more.
    """
    if method.file:
        return plugins.in_file(Path(method.file), method.algorithm)
    return plugins.algorithm(method.algorithm, files)


def make_plan(
    chosen: Sequence[Method],
    scenes: Mapping[str, Scene],
    seeds: Sequence[int],
    files: Sequence[Path] = (),
    spellings: Mapping[str, str] | None = None,
    repeats: int = 1,
    among: Sequence[str] = (),
) -> Plan:
    """Every method on every scene with every seed, solved `repeats` times; `among` as in `Plan`."""
    cells = []
    made = [(method, plugin_of(method, files).make(method.params)) for method in chosen]
    for name, known in facts_of(scenes).items():  # a scene is loaded only for methods that read files for it
        for method, instance in made:
            read = plugins.scene_files(instance, scenes[name]) if plugins.reads_files(instance) else ""
            for seed in seeds:
                facts = [SCHEMA, method.algorithm, dict(method.params), method.code, name, known.digest, seed]
                facts += [read] if read else []
                for repeat in range(repeats):
                    # the first has the key of a cell without repeats: whoever asks for repeats later keeps it
                    key = digest([*facts, repeat] if repeat else facts)
                    cells.append(Cell(method, name, known.digest, seed, key, repeat, read))
    return Plan(tuple(cells), tuple(str(path) for path in files), spellings or {}, tuple(among))
