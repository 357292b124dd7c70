"""Which cells are left, and why."""

import json
import shutil
from pathlib import Path

import pytest
from attrs import evolve
from launcher import SCENE
from places import METHODS as BEHAVED

from matbench import comparison
from matbench.cli import main
from matbench.errors import UserError
from matbench.plans.settings import Settings
from matbench.results.status import prune, standing
from matbench.runs.todo import explained

RAISES = "failed: ArithmeticError: the third digit is missing and more (mine.py:87)"


def test_only_and_the_dry_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def left(algorithms: list[str], only: str | None = None, repeats: int = 1) -> list[tuple[str, str]]:
        ready = comparison.prepare(
            algorithms,
            SCENE,
            out=tmp_path / "run",
            plugin=plugin,
            settings=Settings(only=only),  # type: ignore[arg-type]
            write=False,
            repeats=repeats,
        )
        return [(c.method.algorithm, why) for c, why in explained(ready.plan, ready.store, ready.settings)]

    plugin = tmp_path / "mine.py"
    shutil.copyfile(BEHAVED, plugin)
    names = ["flat", "raises", "noise"]
    assert [why for _, why in left(names)] == ["not computed yet"] * 3
    assert not (tmp_path / "run").exists(), "a dry run writes nothing"
    ready = comparison.prepare(names, SCENE, out=tmp_path / "run", plugin=plugin)
    ready.run()
    noise = ready.store.cell(ready.plan.cells[2])
    (noise / "disparity.npz").write_bytes(b"junk")
    before = {p: p.stat().st_mtime_ns for p in (tmp_path / "run").rglob("*")}
    failed = ("raises", RAISES)
    assert left(names) == [failed, ("noise", "its files are damaged")]
    assert left(names, "missing") == [("noise", "its files are damaged")]
    assert left(names, "failed") == [failed]
    line = ["compare", "-a", *names, "-s", SCENE, "--plugin", plugin, "--out", tmp_path / "run", "--dry-run", "--json"]
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in line])
    told = json.loads(capsys.readouterr().out)
    assert (ended.value.code or 0, told["cells"], [one["reason"] for one in told["todo"]]) == (
        0,
        3,
        [RAISES, "its files are damaged"],
    )
    assert left(names, "all") == [("flat", "asked for again"), failed, ("noise", "its files are damaged")]
    assert ("flat", "not computed yet") in left(names, repeats=2)
    plugin.write_text(plugin.read_text() + "\nOTHER = 1\n")
    assert [why for _, why in left(names)] == ["code changed"] * 3
    assert {p: p.stat().st_mtime_ns for p in (tmp_path / "run").rglob("*")} == before
    with pytest.raises(UserError, match="is not what it was when the run was planned"):
        raise UserError(_reason_of_first_cell(ready))

    changed = comparison.prepare(names, SCENE, out=tmp_path / "run", plugin=plugin)
    found = standing(tmp_path / "run")
    assert (found.stale, found.left) == (3, 3)
    assert prune(tmp_path / "run") == 3
    assert standing(tmp_path / "run").stale == 0
    assert not any(changed.store.cell(cell).exists() for cell in ready.plan.cells)


def _reason_of_first_cell(ready: comparison.Comparison) -> str:
    """The plan is from before its file was changed: such a cell must not be computed under the old key."""
    again = evolve(ready, settings=Settings(only="all"))
    again.run()
    outcome = again.store.outcome(again.plan.cells[0])
    assert outcome is not None
    assert outcome.status == "failed"
    return outcome.reason
