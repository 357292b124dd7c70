"""Every command that the README and the documentation show is run, and the site builds without a network.

Long commands are shortened by these rules, and by no others:

- synthetic scenes are computed 64x48 pixels small, rows to match, and of `synthetic/*` only `synthetic/box`;
- where no method is named `sgbm` is taken, not all of them, and where no scene is `synthetic/box`;
- the page of the report is drawn for the first comparison only; all write the tables;
- on real scenes (`--data DIR`) everything happens up to the first cell, which takes minutes: the scenes are read and
  the plan is written. An ablation of real scenes is only asked which scenes it means and what varies in it;
- `fetch` needs the network, `--dask` a cluster: they tell what they would do (`--dry-run`);
- `check` takes many solves: the methods that it would try are looked for;
- `bench` takes minutes: its options are read;
- `view` opens a window: the recording that it would show is looked for.
"""

import html
import re
import shlex
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_files import Layers, write_png
from shown import INLINE, LINES, METHOD, PAGES, ROOT, SCENE, TEXT

from matbench import ablation, comparison, contract, plan, scenes
from matbench.cli import app, main
from matbench.spec import Spec, parse

ON_REAL = [line for line in LINES if "--data DIR" in line and " fetch " not in line]
ELSEWHERE = [line for line in LINES if line not in ON_REAL]
STAGES = ("report", "figure", "status", "export", "score", "view")
"""What needs a run, in this order where a page shows it after its run; all other commands come before."""
HEIGHT, FULL_HEIGHT = 48, 180
"""Rows of synthetic scenes, here and unless told otherwise."""


def small(selector: str) -> list[str]:
    """The same scenes, computed in small pictures."""
    found = [Spec("synthetic/box" if s.name == "synthetic/*" else s.name, s.options) for s in parse(selector)]
    size = {"size": f"64x{HEIGHT}"}
    return [str(Spec(s.name, s.options | size)) if s.name.startswith("synthetic/") else str(s) for s in found]


def shortened(line: str) -> list[str]:
    tokens, out = shlex.split(line)[1:], []
    for before, token in pairwise(["", *tokens]):
        if before in ("--row", "--rows"):
            out += [",".join(str(int(row) * HEIGHT // FULL_HEIGHT) for row in token.split(","))]
        else:
            out += small(token) if before == "-s" or token.startswith("synthetic/") else [token]
    if tokens[0] == "compare":
        out += [] if "-a" in tokens else ["-a", "sgbm"]
        out += [] if "-s" in tokens else ["-s", *small("synthetic/box")]
    return [*out, "--dry-run"] if tokens[0] == "fetch" or "--dask" in tokens else out


def stage(line: str) -> int:
    command = shlex.split(line)[1]
    return STAGES.index(command) if command in STAGES else -1


def own_scene(folder: Path) -> None:
    """The folder that the guide's scene.toml describes."""
    folder.mkdir()
    world = Layers(near=6, far=2)
    for view, name in enumerate(("left", "middle", "right")):
        write_png(folder / f"{name}.png", world.view(view - 1))
    write_png(folder / "middle_disparity.png", (world.truth() * 16).astype(np.uint8))


def own_program(path: Path) -> None:
    """A program that is called as the guide says, and may be told to hurry."""
    matcher = (ROOT / "tests/programs/block_matcher.py").read_text()
    hurry = 'sys.argv = [word for word in sys.argv if word != "--fast"]\n'
    path.write_text(f"#!{sys.executable}\nimport sys\n{hurry}{matcher}")
    path.chmod(0o755)


def run(tokens: list[str]) -> int:
    with pytest.raises(SystemExit) as done:
        main(tokens)
    return int(done.value.code or 0)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where somebody follows the documentation, line by line."""
    desk = tmp_path_factory.mktemp("desk")
    own_scene(desk / "my_scene")
    (desk / "mine.py").write_text(METHOD)
    (desk / "algorithms").symlink_to(ROOT / "algorithms")
    own_program(desk / "mine")
    return desk


def test_commands_run_one_after_another(
    desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from matbench import recording

    seen: list[bool] = []
    monkeypatch.setattr(recording, "view", lambda path, web: seen.append(path.is_file()))
    tried: list[plan.Method] = []

    def check(method: plan.Method, *_: object) -> list[contract.Finding]:
        tried.append(method)
        return [contract.Finding("answers", "", "pass")]

    monkeypatch.setattr(contract, "check", check)
    drawn: list[Path] = []
    draw = comparison.Comparison.report

    def report(ready: comparison.Comparison, *given: Any) -> Path:
        drawn.append(ready.folder / "report.html")
        return draw(ready, *given) if len(drawn) == 1 else drawn[-1]

    monkeypatch.setattr(comparison.Comparison, "report", report)
    monkeypatch.chdir(desk)
    monkeypatch.delenv("MATBENCH_DATA", raising=False)
    for line in sorted(ELSEWHERE, key=stage):
        tokens = shortened(line.replace("--data DIR", "--data nowhere"))
        if tokens[0] == "bench":
            app.parse_args(tokens, exit_on_error=False, print_error=False)
            continue
        status = run(tokens)
        said = capsys.readouterr()
        if " scene new " in line:
            (desk / "my_scene" / "scene.toml").write_text(SCENE)
        assert status == 0, f"{line}\n{said.out[-2000:]}{said.err}"
    assert len(seen) == sum(" view " in line for line in LINES)
    assert all(seen)
    assert drawn[0].is_file()
    assert {method.algorithm for method in tried} == {"mine", "okutomi_kanade", "materiality", "command"}
    assert b"\\toprule" in Path("table.tex").read_bytes()
    assert Path("runs/both/results.csv").is_file()


def test_commands_on_real_scenes_are_ready_to_run(
    desk: Path, data_root: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from matbench.commands import running

    plans = []

    def first_cell(ready: comparison.Comparison, *_: object, **__: object) -> int:
        plans.append(ready.plan)
        return 0

    monkeypatch.setattr(running, "work", first_cell)
    monkeypatch.chdir(desk)
    for line in ON_REAL:
        tokens = shlex.split(line.replace("DIR", str(data_root)))[1:]
        if tokens[0] == "ablate":
            listed = [value for flag, value in pairwise(tokens) if flag == "-s"]
            asked = [tokens[1]]
            if tokens[1].endswith(".toml"):
                asked, from_file = comparison.read_request(Path(tokens[1]))
                listed = from_file or []
            ablation.check_varies(plan.methods(asked), listed)
            assert len(scenes.select(listed, data_root).names) > 1, line
        else:
            assert run(tokens) == 0, capsys.readouterr().err
            assert plans.pop().cells


@pytest.mark.parametrize("line", [line for line in INLINE if "COMMAND" not in line])
def test_commands_within_sentences_exist(line: str) -> None:
    app.parse_args(shlex.split(line)[1:], exit_on_error=False, print_error=False)


@pytest.mark.parametrize("page", PAGES, ids=list(TEXT))
def test_pages_name_what_exists(page: Path) -> None:
    for link in re.findall(r"\]\(([^)#]+)(?:#[\w-]+)?\)", page.read_text()):
        if not link.startswith("http"):
            assert (page.parent / link).resolve().exists(), link
    for picture in (ROOT / "docs" / "images").iterdir():
        assert picture.stat().st_size <= 300_000, picture.name


def test_the_site_builds_and_fetches_nothing(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs", reason="the documentation's tools are not installed: pip install -e '.[docs]'")
    line = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    pages = {page.relative_to(tmp_path).as_posix(): page.read_text() for page in tmp_path.rglob("*.html")}
    for name, text in pages.items():
        loaded = re.findall(r"<(?:script|img|iframe)[^>]*\bsrc=\"?([^\"\s>]+)", text)
        loaded += re.findall(r"<link[^>]*rel=\"?(?:stylesheet|preconnect|icon)\"?[^>]*href=\"?([^\"\s>]+)", text)
        assert [address for address in loaded if re.match(r"(?:https?:)?//", address)] == [], name
        assert "arithmatex" not in text, f"{name}: an equation is left in TeX"
    assert pages["concepts/materiality.html"].count("<math") > 20
    assert 'id="eq-3"' in pages["concepts/materiality.html"]
    shown = ["compare", "ablate", "check", "list", "status", "score", "export", "report", "bench", "view", "fetch"]
    for command in (*shown, "scene check", "figure slice", "figure maps"):
        assert f"matbench {command}" in html.unescape(pages["reference/commands.html"])
    assert "lambda of the count term" in pages["reference/methods.html"], "docstrings are shown"
