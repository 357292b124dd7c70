"""What a run will do: the request, and its cells keyed by content."""

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

from attrs import field, frozen

from matbench import parameters, spec
from matbench.errors import UserError
from matbench.plans import plugins
from matbench.scene import Scene

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
    """

    algorithm: str
    params: Mapping[str, spec.Value]
    changed: str = ""
    code: str = ""

    def __str__(self) -> str:
        return f"{self.algorithm}[{self.changed}]" if self.changed else self.algorithm


@frozen
class Cell:
    """One method on one scene with one seed.

    Parameters
    ----------
    key
        Digest of everything that decides the answer; the name of the cell's folder.
    repeat
        0 for the cell that is scored. The others solve the same again, to see whether the maps are the same.
    """

    method: Method
    scene: str
    scene_digest: str
    seed: int
    key: str
    repeat: int = 0

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
    """

    cells: tuple[Cell, ...]
    plugin_files: tuple[str, ...] = field(default=())
    spellings: Mapping[str, str] = field(factory=dict)

    @property
    def scored(self) -> tuple[Cell, ...]:
        """The cells that scores are computed from: no repeats."""
        return tuple(cell for cell in self.cells if not cell.repeat)

    @property
    def questions(self) -> tuple[tuple[Cell, ...], ...]:
        """The cells in groups that ask the same: the cell that is scored, then its repeats."""
        found: dict[tuple[object, ...], list[Cell]] = {}
        for cell in self.cells:
            found.setdefault(cell.question[:-1], []).append(cell)
        return tuple(tuple(sorted(cells, key=lambda c: c.repeat)) for cells in found.values())

    @property
    def request(self) -> dict[str, Any]:
        """What was asked for, without code and pixels: the same request resumes the same run."""
        methods = {str(c.method): [c.method.algorithm, dict(c.method.params)] for c in self.cells}
        return {
            "algorithms": [methods[name] for name in sorted(methods)],
            "scenes": sorted({c.scene for c in self.cells}),
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
        beside the others.
    """
    found: dict[str, Method] = {}
    for one in spec.expand(selectors):
        plugin = plugins.algorithm(one.name, files)
        instance = plugin.make(one.options)
        if not callable(getattr(instance, "solve", None)):
            raise UserError(f"{plugin.name} from {plugin.source} is no method: it has no solve(scene, context)")
        parameters.refuse_silent(plugin.name, instance, one.options)
        # a method may have a parameter called preset; then the word names no set of parameters
        preset = one.options.get("preset") if "preset" not in parameters.parameters(type(instance)) else None
        changed = spec.text(parameters.changed(instance, preset))
        params = parameters.values_of(instance)
        method = Method(plugin.name, params, changed, plugins.method_digest(plugin, instance))
        found.setdefault(spec.label(plugin.name, params), method)  # spelled in two ways, it is one method
    return list(found.values())


def make_plan(
    chosen: Sequence[Method],
    scenes: Mapping[str, Scene],
    seeds: Sequence[int],
    files: Sequence[Path] = (),
    spellings: Mapping[str, str] | None = None,
    repeats: int = 1,
) -> Plan:
    """Every method on every scene with every seed, solved `repeats` times."""
    cells = []
    for name, scene in scenes.items():
        for method in chosen:
            for seed in seeds:
                facts = [SCHEMA, method.algorithm, dict(method.params), method.code, name, scene.digest, seed]
                for repeat in range(repeats):
                    # the first has the key of a cell without repeats: whoever asks for repeats later keeps it
                    key = digest([*facts, repeat] if repeat else facts)
                    cells.append(Cell(method, name, scene.digest, seed, key, repeat))
    return Plan(tuple(cells), tuple(str(path) for path in files), spellings or {})
