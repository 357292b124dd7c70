"""What methods owe the harness: the check itself, on methods that keep to it and on methods that do not."""

import time

import psutil
import pytest
from places import METHODS, UNRULY

from matbench.plans.plan import methods
from matbench.solving import method_check
from matbench.solving.check_verdicts import CheckResult


def failed(found: list[CheckResult]) -> set[str]:
    return {finding.check for finding in found if finding.verdict == "fail"}


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("pries", {"input"}),
        ("forgetful", {"seed", "threads"}),
        ("crowded", {"threads"}),
        ("infinite", {"honest"}),
        ("leaning", {"mirror"}),
        ("of_the_pair", {"range"}),
        ("positive", {"negative", "tiny"}),
        ("roomy", {"tiny"}),
        ("solid", {"answers", "views", "negative", "tiny", "constant"}),
        ("chatty", set()),
    ],
)
def test_each_broken_promise_is_found_and_no_other(name: str, wrong: set[str]) -> None:
    (method,) = methods(name, [UNRULY])
    found = method_check.check(method, [UNRULY])
    assert failed(found) == wrong, found
    assert all(finding.reason for finding in found if finding.verdict != "pass")
    if name == "roomy":
        assert "signal 11" in next(finding.reason for finding in found if finding.check == "tiny")
    if name == "chatty":
        assert found[-1].verdict == "note"
        assert "thinking" in found[-1].reason


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("writes", "read-only"),
        ("exits", "ended its process (exit status 7)"),
        ("leaves", "SystemExit"),
        ("raises", "the third digit is missing and more (methods.py:"),
        ("misshapen", "(3, 3)"),
        ("bare", "not an Estimate"),
        ("empty", "NaN everywhere"),
    ],
)
def test_what_gives_no_answer_fails_with_its_reason(name: str, said: str) -> None:
    (method,) = methods(name, [METHODS])
    found = method_check.check(method, [METHODS])
    (answers,) = (finding for finding in found if finding.check == "answers")
    assert answers.verdict == "fail"
    assert said in answers.reason


def test_what_a_method_declines_is_skipped_with_its_reason() -> None:
    (method,) = methods("twosome", [UNRULY])
    found = method_check.check(method, [UNRULY])
    assert not failed(found)
    assert {"answers", "views", "mirror", "seed"} <= {f.check for f in found if f.verdict == "skipped"}
    assert "two views only" in found[0].reason


def test_a_method_that_hangs_is_ended_and_nothing_else_is_tried() -> None:
    (method,) = methods("slow", [METHODS])
    begin = time.monotonic()
    found = method_check.check(method, [METHODS], timeout=5)
    assert time.monotonic() - begin < 28  # it sleeps for thirty
    assert found[0].reason == "easy: no answer within 5 s"
    assert failed(found) == {"answers", "views"}
    assert "not tried" in next(f.reason for f in found if f.check == "tiny")
    (breeder,) = methods("breeder", [UNRULY])
    assert method_check.check(breeder, [UNRULY], timeout=3)[0].reason == "easy: no answer within 3 s"
    left = [p for p in psutil.process_iter(["cmdline"]) if "3598.75" in (p.info["cmdline"] or [])]
    assert not left, "what it had started"
