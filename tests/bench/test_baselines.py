"""Ratios that are stored, and the verdicts on those measured later."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve
from places import TESTS
from reference import digest

from matbench.bench import base, baselines, machine, tables
from matbench.bench.baselines import Baseline, Judged
from matbench.bench.measuring import Sitting, Timing, Tree
from matbench.bench.turns import Turns
from matbench.errors import UserError

KIND = {"processor": "Some(R) Processor 6/1/2", "cores": "2", "numba": "0.68"}


STORED = Baseline(KIND, "digest", "code", {"one": 10, "two": 20})


def sitting(**ratios: float) -> Sitting:
    return Sitting({name: Timing(r, r, r, 1.0, 1 / r, "kernel", 9) for name, r in ratios.items()}, {}, "digest")


def verdicts(
    first: Sitting, *later: float, decide: baselines.Decide = lambda _: ()
) -> tuple[list[Judged], list[Sequence[str]]]:
    """What is judged of two subjects, and who was asked to sit again; the first then measures `later`."""
    asked: list[Sequence[str]] = []
    waiting = list(later)

    def again(names: Sequence[str]) -> Sitting:
        asked.append(names)
        return sitting(one=waiting.pop(0)) if waiting else Sitting({}, {"one": "it went away"}, "digest")

    return baselines.judge(["one", "two"], STORED, first, again, decide, margin=0.15), asked


def test_what_most_processes_find_slow_is_slower() -> None:
    (one, two), asked = verdicts(sitting(one=13.0, two=20.5), 11.2, 12.9)
    assert (one.verdict, two.verdict) == ("slower", "ok")
    assert one.change == pytest.approx(0.29)
    assert asked == [["one"], ["one"]]  # nobody else is measured again


def test_one_unlucky_process_is_no_regression() -> None:
    (one, _), asked = verdicts(sitting(one=16.0, two=20.0), 10.1, 9.9)
    assert one.verdict == "ok"
    assert len(asked) == 2


def test_a_lucky_first_process_hides_nothing() -> None:
    """What is beyond ten per cent is looked at again."""
    (one, _), _ = verdicts(sitting(one=11.1, two=20.0), 12.8, 13.1)
    assert one.verdict == "slower"


def test_what_cannot_be_measured_again_has_failed() -> None:
    (one, _), _ = verdicts(sitting(one=13.0, two=20.0), 13.0)
    assert (one.verdict, one.reason) == ("failed", "it went away")


@pytest.mark.parametrize(
    ("in_turns", "verdict"),
    [((1.29, 1.31, 1.3, 1.28), "slower"), ((1.01, 0.99, 1.0, 1.02), "ok"), ((1.1, 1.11, 1.1, 1.12), "ok")],
)
def test_a_suspicion_is_decided_in_turns_with_the_code_that_was_stored(in_turns: Sequence[float], verdict: str) -> None:
    """Whatever the ratios say, as other machines' work moves them for minutes."""
    asked: list[Sequence[str]] = []

    def decide(names: Sequence[str]) -> list[base.Versus]:
        asked.append(names)
        return [base.versus(name, [Turns(ratio) for ratio in in_turns]) for name in names]

    (one, two), again = verdicts(sitting(one=13.9, two=20.5), decide=decide)
    assert (one.verdict, two.verdict) == (verdict, "ok")
    assert one.change == pytest.approx(np.exp(np.log(in_turns).mean()) - 1)
    assert (asked, again) == ([["one"]], [])
    assert f"{one.change:+.1%}" in tables.judged([one]).markdown()


def test_what_the_stored_code_lacks_is_decided_by_ratios() -> None:
    def lacks(names: Sequence[str]) -> list[base.Versus]:
        return [base.Versus(name, reason="not in the base: ImportError: no") for name in names]

    (one, _), asked = verdicts(sitting(one=13.0, two=20.5), 12.9, 13.1, decide=lacks)
    assert (one.verdict, one.against, asked) == ("slower", None, [["one"], ["one"]])


def test_the_calmest_of_several_processes_is_stored(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Others' work slows the reference, too: where it was quickest there was least of it."""
    waiting = [(14.0, 1.3), (10.0, 1.0), (13.0, 1.2), (9.0, 1.1), (12.0, 1.4)]

    def sit(*_: object) -> Sitting:
        ratio, reference = waiting.pop(0)
        return Sitting({"one": Timing(ratio, ratio, ratio, 1.0, reference, "kernel", 9)}, {}, "digest")

    monkeypatch.setattr(baselines, "sit", sit)
    stored = baselines.establish(Tree(tmp_path, tmp_path, tmp_path), ["one"])
    assert (stored.ratios, waiting) == ({"one": 10.0}, [])


def test_what_is_as_fast_as_before_is_measured_once() -> None:
    (one, two), asked = verdicts(sitting(one=10.7, two=15.0))
    assert (one.verdict, two.verdict, asked) == ("ok", "faster", [])


def test_what_could_not_be_measured_failed_and_what_is_not_stored_is_new() -> None:
    first = evolve(sitting(three=3.0), failed={"one": "ValueError: no"})
    one, three = baselines.judge(["one", "three"], STORED, first, *[lambda _: pytest.fail("nobody is suspect")] * 2)
    assert (one.verdict, one.reason, three.verdict) == ("failed", "ValueError: no", "new")
    assert "one failed: ValueError: no" in tables.judged([one, three]).markdown()


def test_ratios_are_stored_for_a_kind_of_machine(tmp_path: Path) -> None:
    path = baselines.store_baseline(tmp_path, STORED)
    assert path.name.startswith("some-processor-6-1-2-")
    assert baselines.read(tmp_path) == [STORED]
    assert baselines.matching(tmp_path, KIND, "digest") == (STORED, "")
    found, why = baselines.matching(tmp_path, {**KIND, "numba": "0.69"}, "digest")
    assert found is None
    assert "numba 0.68 -> 0.69" in why
    assert baselines.matching(tmp_path, KIND, "another")[0] is None
    assert baselines.matching(tmp_path / "empty", KIND, "digest") == (None, "no baseline is stored")
    assert baselines.replaced(tmp_path, evolve(STORED, ratios={})) == STORED
    assert baselines.replaced(tmp_path, evolve(STORED, digest="another")) is None
    for way in (os.mkfifo, lambda path: path.write_text("[" * 100_000), lambda path: path.symlink_to("/dev/zero")):
        path.unlink()
        way(path)
        with pytest.raises(UserError, match="no stored baseline"):
            baselines.read(tmp_path)
    path.unlink()
    path.write_text("{", encoding="utf-8")
    assert baselines.replaced(tmp_path, STORED) is None  # and --update writes it anew
    with pytest.raises(UserError, match="no stored baseline"):
        baselines.read(tmp_path)


def test_stored_files_are_of_this_reference() -> None:
    """A changed reference makes every stored ratio worthless: measure them anew, or change it back."""
    folder = TESTS / "benchmarks" / "baselines"
    assert all(one.digest == digest() for one in baselines.read(folder))
    assert all(machine.file_name(one.machine) in {p.name for p in folder.iterdir()} for one in baselines.read(folder))
