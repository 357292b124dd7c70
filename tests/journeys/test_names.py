"""Names: any text is refused in one line, or stored and read back as it was, through plan, run folder and tables."""

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from typing_commands import run as typed

from matbench import spec
from matbench.errors import UserError
from matbench.files.csv_tables import csv_text, read_csv
from matbench.plans.plan import Plan, make_plan, methods
from matbench.results import metric_catalogue, scores
from matbench.results.archive import export, unpack
from matbench.results.status import standing
from matbench.runs.cell_files import write_cell
from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.scene import Scene
from matbench.scenes.catalogue import load_scene

TINY = "synthetic/box[size=48x36]"
METHOD = """
class Noted:
    def __init__(self, note: str = "plain\\tdefault") -> None:
        self.note = note

    def solve(self, scene, context):
        raise NotImplementedError
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("names") / "noted.py"
    path.write_text(METHOD)
    return path


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(TINY)


def stored(plan: Plan, scene: Scene, place: Path) -> None:
    """Write a plan and its cells, and read them back in every way."""
    store = Store.open(place / "run", plan, "matbench compare")
    assert store.plan() == plan
    assert standing(place / "run").left == len(plan.cells)
    for cell in plan.cells:
        with store.building(cell) as draft:
            write_cell(draft, cell, Outcome("skipped", reason="not now"))
    found = scores.tables(store.plan(), store, {cell.scene: scene for cell in plan.cells})
    (place / "cells.csv").write_text(csv_text(found.cells), encoding="utf-8")
    read = read_csv(place / "cells.csv", scores.CELL_COLUMNS, 1 << 20)
    assert list(zip(read["algorithm"], read["params"], strict=True)) == [cell.method.names for cell in plan.cells]
    assert list(read["scene"]) == [cell.scene for cell in plan.cells]


TEXTS = (
    st.text(st.characters(codec=None))
    | st.text(st.sampled_from("a'\" ,=-+[]\u00a0\u200d\t\n\x1b\udc80\u202e"))
    | st.text()
)


@settings(max_examples=60, deadline=None)
@given(TEXTS)
@example("a\u00a0b")
@example("zero\u200dwidth")
@example("=1+1")
@example("'")
@example("nan")
@example("-1")
def test_the_value_of_a_parameter_is_refused_or_kept(file: Path, scene: Scene, value: str) -> None:
    assume(not {"'", '"'} <= set(value))  # nobody can type both: each ends the quotes that the other stands in
    try:
        chosen = methods(spec.label("noted", {"note": value}), [file])
    except UserError:
        return
    assert [one.params["note"] for one in chosen] == [value]
    with TemporaryDirectory() as place:
        stored(make_plan(chosen, {scene.name: scene}, [0], [file]), scene, Path(place))


@settings(max_examples=40, deadline=None)
@given(TEXTS)
@example("x' as 'y")
@example("[a], b")
def test_a_label_is_refused_or_kept(scene: Scene, value: str) -> None:
    assume(not {"'", '"'} <= set(value))
    quote = '"' if "'" in value else "'"
    try:
        chosen = methods(f"sgbm[fill=true,false] as {quote}{value}{quote}")
    except UserError:
        return
    assert [one.label for one in chosen] == [value.strip()] * 2
    with TemporaryDirectory() as place:
        stored(make_plan(chosen, {scene.name: scene}, [0]), scene, Path(place))


@pytest.mark.parametrize("value", ["a\tb", "a\nb", "a\rb", "\x1b", "\u202egnp", "half \udc80", "\ufeff", "\x00"])
def test_what_nobody_can_see_is_refused_in_a_line(capsys: pytest.CaptureFixture[str], file: Path, value: str) -> None:
    status, out, err = typed(capsys, "compare", "-a", f"noted[note='{value}']", "-s", TINY, "--plugin", file)
    assert (status, out, len(err.splitlines())) == (2, "", 1)
    assert "holds" in err


@pytest.mark.parametrize("value", ["a\u00a0b", "a\u200db", "視差", "שלום", "👩\u200d🔬", "=1+1", "-x", "e\u0301"])
def test_ordinary_names_are_kept_through_status_and_export(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, file: Path, value: str
) -> None:
    folder = tmp_path / value
    line = ("compare", "-a", f"noted[note='{value}']", "-s", TINY, "--plugin", file, "--out", folder, "-q")
    if value != "a\u200db":  # the others need no run of their own
        line = (*line, "--dry-run")
    assert typed(capsys, *line)[:2] == (1 if value == "a\u200db" else 0, f"{folder}\n")
    if value == "a\u200db":
        assert typed(capsys, "status", folder)[0] == 0
        archive, _ = export(folder)
        unpack(archive, tmp_path / "again")
        assert Store(tmp_path / "again").plan() == Store(folder).plan()


@pytest.mark.parametrize(
    ("tokens", "named"),
    [
        (("compare", "--out", "runs/a\tb"), "output folder 'runs/a\\tb' holds a tab"),
        (("compare", "--out", "caf\udce9"), "argument 'caf\\xe9' holds the byte \\xe9, which is not UTF-8"),
        (("list", "--data", "a\x1bb"), "data folder 'a\\x1bb' holds an escape code"),
        (("list", "--plugin", "caf\udce9.py"), "the byte \\xe9"),
        (("status", "caf\udce9"), "the byte \\xe9"),
        (("scene", "check", "./a\u202eb"), "the hidden character U+202E"),
        (("scene", "show", "./a\u2028b"), "the hidden character U+2028"),
        (("compare", "-s", "synthetic/box[size='4\x078']"), "the hidden character U+0007"),
    ],
)
def test_folders_and_files_are_refused_by_name(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    tokens: tuple[str, ...],
    named: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    status, _, err = typed(capsys, *tokens, *(("-a", "sgbm", "-s", TINY) if tokens[:2] == ("compare", "--out") else ()))
    assert status == 2
    assert named in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_a_scene_and_a_metric_of_hidden_names_are_refused(tmp_path: Path, scene: Scene) -> None:
    from attrs import evolve

    from matbench.plans.plugins import using

    for change in (
        {"name": "walls/a\tb"},
        {"labels": ("0", "\x1b", *scene.labels[2:])},
        {"regions": {"a\u202e": scene.regions["all"]}},
    ):
        with pytest.raises(UserError, match="holds"):
            evolve(scene, **change)
    (tmp_path / "judge.py").write_text(
        "from matbench import Metric\nODD = Metric('a\\tb', '%', 'lower', 'odd', lambda errors: 0.0)\n"
    )
    with using([tmp_path / "judge.py"]), pytest.raises(UserError, match="holds a tab"):
        metric_catalogue.metrics()
