"""Following the README and the documentation: every command that they show is run, on small things.

A line is run as it stands but for these rules:

- pictures are 64x48 pixels: synthetic scenes are computed so, `DIR` holds the middle of the real pictures of four
  scenes, and `--row 144` is row 24. Of `synthetic/*` only `synthetic/box` is taken, of a set of worlds only the first;
- a run that grows until it decides has six worlds to come to;
- where no method is named `sgbm` is taken, not all of them, and where no scene is `synthetic/box`;
- cells share a process (`--isolation shared`) where nothing is said of how they run; `--jobs 4` are 2;
- of all pages of reports that a file of tests asks for only the first is drawn; all tables are written;
- `tcp://head:8786` is a scheduler on this machine, with a worker, in processes of their own;
- `check` tries its methods on scenes of two thirds the size;
- `bench` and `prove.py` run in a copy of the checkout that has one method and one kernel, with fewer rounds and tries;
- `fetch` needs the network: it tells what it would do (`--dry-run`);
- `net.onnx` is a small network that compares blocks;
- `view` opens a window: the recording that it would show is looked for;
- installing needs the network, too: `.ci/run` does it before it runs the tests.
"""

import csv
import re
import shlex
import sys
from collections.abc import Callable, Mapping
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx_models import block_matcher
from scene_files import Layers, write_pair, write_png
from shown import LINES, METHOD, OWN_FILES, ROOT, SWEEP
from tools import find

from matbench import load_scene
from matbench.cli import main
from matbench.prepared import Comparison
from matbench.spec import Spec, parse

WIDTH, HEIGHT = 64, 48
RUNS = ("compare", "ablate")
STAGES = ("report", "figure", "status", "export", "score", "view")
"""What needs a run, in this order where a page shows it after its run; all other commands come before."""
PROVE = "tests/benchmarks/prove.py"


def command(line: str) -> str:
    return " ".join(shlex.split(line)[1:2])


def words(line: str) -> list[str]:
    """What stands after `matbench`, or after the program that proves."""
    tokens = shlex.split(line)
    return tokens[2:] if command(line) == PROVE else tokens[1:]


GROUPS: Mapping[str, Callable[[str], bool]] = {
    "install": lambda line: "pip install " in line,
    "plain": lambda line: (
        command(line) in ("list", "maps", "scene", *STAGES)
        or (command(line) in RUNS and "--data " not in line and "--dask " not in line)
    ),
    "real": lambda line: command(line) in RUNS and "--data " in line,
    "dask": lambda line: command(line) in RUNS and "--dask " in line,
    "fetch": lambda line: command(line) == "fetch",
    "check": lambda line: command(line) == "check",
    "bench": lambda line: command(line) == "bench",
    "prove": lambda line: command(line) == PROVE,
    "script": lambda line: command(line) in OWN_FILES,
    "help": lambda line: words(line) == ["COMMAND", "--help"],
}
"""The lines that are run in the same way: each belongs to one group."""


def lines(group: str) -> list[str]:
    return [line for line in LINES if GROUPS[group](line)]


def stage(line: str) -> int:
    return STAGES.index(command(line)) if command(line) in STAGES else -1


def _six_worlds() -> list[str]:
    return [one for seed in range(6) for one in _small(f"synthetic/world-{seed}")]


def shortened(line: str, **places: str) -> list[str]:
    """The words of a line by the rules above.

    Parameters
    ----------
    places
        What stands for words such as `DIR`.
    """
    tokens, out = words(line), []
    for before, token in pairwise(["", *tokens]):
        if before in ("--row", "--rows"):
            out.append(",".join(str(int(row) // 6) for row in token.split(",")))
        elif before == "-s" and "--until" in tokens:
            out += _six_worlds()
        elif before == "-s" or token.startswith(("synthetic/", "worlds/")):
            out += _small(token)
        elif before == "--jobs":
            out.append("2")
        else:
            out.append(places.get(token, token))
    if tokens[0] == "compare":
        out += [] if "-a" in tokens else ["-a", "sgbm"]
        if "-s" not in tokens:
            out += ["-s", *(_six_worlds() if "--until" in tokens else _small("synthetic/box"))]
    if tokens[0] in RUNS and not {"--jobs", "--dask"} & set(tokens):
        out += ["--isolation", "shared"]
    return [*out, "--dry-run"] if tokens[0] == "fetch" else out


FIRST = {"synthetic/*": "synthetic/box"} | dict.fromkeys(
    ("worlds/quick", "worlds/standard", "worlds/large"), "synthetic/world-0"
)
"""What stands for several scenes -> the one that is taken."""


def _small(selector: str) -> list[str]:
    """The same scenes in small pictures."""
    named = [(FIRST.get(spec.name, spec.name), spec.options) for spec in parse(selector)]
    found = list({str(Spec(*one)): Spec(*one) for one in named}.values())
    size = {"size": f"{WIDTH}x{HEIGHT}"}
    return [str(Spec(s.name, {**s.options, **size}) if s.name.startswith("synthetic/") else s) for s in found]


def _own_maps(folder: Path) -> None:
    """Somebody's results: the map of the synthetic box, which is its truth."""
    scene = load_scene(f"synthetic/box[size={WIDTH}x{HEIGHT}]")
    folder.mkdir()
    np.save(folder / "box.npy", scene.truth[scene.ref] * scene.pair_steps)


class Desk:
    """Where somebody follows the documentation, line by line, with what it has people write themselves.

    Attributes
    ----------
    runs
        Folders of the runs that were scored, in order. The first one's page is drawn.
    """

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.folder, self.runs = folder, list[Path]()
        _own_scene(folder / "my_scene")
        write_pair(folder / "path/to/Adirondack-perfect", Layers(near=9.5, far=3.25))
        for name, text in OWN_FILES.items():
            (folder / name).write_text(text)
        (folder / "mine.py").write_text(METHOD)
        (folder / "old").mkdir()
        (folder / "old" / "mine.py").write_text(METHOD.replace("0.5", "0.4"))
        _own_program(folder / "mine")
        (folder / "sweep").write_text(SWEEP.replace("/usr/bin/env python3", sys.executable, 1))
        (folder / "sweep").chmod(0o755)
        _own_maps(folder / "results")
        if find("onnx"):
            block_matcher(folder / "net.onnx")
        (folder / "algorithms").symlink_to(ROOT / "algorithms")
        draw = Comparison.report

        def report(ready: Comparison, *given: Any, **named: Any) -> Path:
            self.runs.append(ready.folder)
            return draw(ready, *given, **named) if len(self.runs) == 1 else ready.folder / "report.html"

        patch.setattr(Comparison, "report", report)
        patch.chdir(folder)
        patch.delenv("MATBENCH_DATA", raising=False)

    def follow(self, tokens: list[str]) -> str:
        """Run a command, which must end well and write what it says; what it printed."""
        scored, out, err = len(self.runs), StringIO(), StringIO()
        with pytest.raises(SystemExit) as done, redirect_stdout(out), redirect_stderr(err):
            main(tokens)
        assert not done.value.code, f"{shlex.join(tokens)}\n{out.getvalue()[-2000:]}{err.getvalue()}"
        for path in re.findall(r"^(?:scores|curves|ablation): (.*)$", out.getvalue(), re.M):
            assert Path(path).stat().st_size > 100, f"{shlex.join(tokens)}: {path}"
        if tokens[0] in RUNS and not {"--dry-run", "--help"} & set(tokens):
            (run,) = self.runs[scored:]
            assert table(run / "results.csv"), shlex.join(tokens)
            assert {row["status"] for row in table(run / "cells.csv")} == {"ok"}, shlex.join(tokens)
        return out.getvalue()


def table(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file, by the names of its columns."""
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def _own_scene(folder: Path) -> None:
    """The folder that the guide's scene.toml describes."""
    folder.mkdir()
    world = Layers(near=6, far=2)
    for view, name in enumerate(("left", "middle", "right")):
        write_png(folder / f"{name}.png", world.view(view - 1))
    write_png(folder / "middle_disparity.png", (world.truth() * 16).astype(np.uint8))


def _own_program(path: Path) -> None:
    """A program that is called as the guide says, and may be told to hurry."""
    matcher = (ROOT / "tests/programs/block_matcher.py").read_text()
    hurry = 'sys.argv = [word for word in sys.argv if word != "--fast"]\n'
    path.write_text(f"#!{sys.executable}\nimport sys\n{hurry}{matcher}")
    path.chmod(0o755)
