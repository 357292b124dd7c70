"""The verdicts of `matbench check`: one for each promise of a method, from its answers to the small scenes."""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.solving.check_scenes import trials, truths
from matbench.solving.check_solve import Answer

Verdict = Literal["pass", "fail", "skipped", "note"]

RIGHT = 0.5
"""Share of the wrong pixels that may be left if answers are taken otherwise, so that this is what they are."""
FACTORS = (2.0, 4.0, 8.0, 16.0, 256.0)

AGREEMENT = 0.99  # share of pixels that must agree: rounding decides ties at single ones


@frozen
class CheckResult:
    """The result of one check.

    Parameters
    ----------
    check
        The check's name.
    demand
        What it asks of a method.
    verdict
        ``skipped``: the method does not support the scene, or there was nothing to compare.
        ``note``: worth knowing, but no fault.
    reason
        What was found; in a failure, what is wrong.
    """

    check: str
    demand: str
    verdict: Verdict
    reason: str = ""


def judge(answers: Mapping[str, Answer]) -> list[CheckResult]:
    """Judge a method by its answers to all trials.

    Parameters
    ----------
    answers
        Name of the trial -> answer, for every trial of `check_scenes.trials`.
    """
    return [
        _solved("answers", "whole maps of numbers, not all of them NaN", answers, ["easy"], needs_some=True),
        _solved("views", "two, three and five views", answers, ["two views", "three views", "easy"]),
        _solved("negative", "disparities of either sign", answers, ["either sign"], needs_some=True),
        _solved("tiny", "images of any size", answers, ["1x1 px", "one row", "one column", "narrower than the range"]),
        _solved("constant", "images without any texture", answers, ["constant"]),
        _in_range(answers),
        _sense(answers),
        _honest(answers),
        _leaves_input(answers),
        _same("seed", "the same seed gives the same answer", answers, "easy again"),
        _written(answers),
        _same("threads", "any number of threads gives the same answer", answers, "easy, 3 threads"),
        _mirrored(answers),
        _quiet(answers),
    ]


def _solved(
    name: str, demand: str, answers: Mapping[str, Answer], which: Sequence[str], needs_some: bool = False
) -> CheckResult:
    """Did it answer some trials at all; with `needs_some`, not with NaN everywhere?"""
    wrong = {one: answers[one].error for one in which if answers[one].error}
    wrong |= {one: "NaN everywhere" for one in which if needs_some and _is_empty(answers[one])}
    declined = {one: answers[one].reason for one in which if answers[one].reason}
    verdict: Verdict = "fail" if wrong else "skipped" if declined else "pass"
    return CheckResult(name, demand, verdict, _listed(wrong or declined))


def _listed(reasons: Mapping[str, str]) -> str:
    """Trial -> reason, in one line; trials with the same reason stand together."""
    found: dict[str, list[str]] = {}
    for trial, reason in reasons.items():
        found.setdefault(reason, []).append(trial)
    return "; ".join(f"{', '.join(names)}: {reason}" for reason, names in found.items())


def _is_empty(found: Answer) -> bool:
    """Are there maps, and all of them NaN everywhere?"""
    return bool(found.maps) and all(np.isnan(values).all() for values in found.maps.values())


def _in_range(answers: Mapping[str, Answer]) -> CheckResult:
    demand = f"{AGREEMENT:.0%} of the answers lie in the range, in pixels per view step"
    wrong, parts = {}, {}
    for name in ("easy", "either sign"):
        parts[name] = answers[name]
        bounds = trials()[name].disparities
        answered = [values[~np.isnan(values)] for values in answers[name].maps.values()]
        found = np.concatenate(answered) if answered else np.empty(0, np.float32)
        # one px of slack: methods interpolate between planes, and may end a little beyond the outermost
        beyond = (found < bounds.least - 1) | (found > bounds.largest + 1)
        if found.size and beyond.mean() > 1 - AGREEMENT:
            wrong[name] = f"{beyond.mean():.1%} beyond {bounds} by more than 1, {found.min():g} to {found.max():g}"
    return _seen("range", demand, parts, wrong)


def _sense(answers: Mapping[str, Answer]) -> CheckResult:
    """Would answers be right if they were turned, mirrored or scaled? Then that is what is wrong with them."""
    demand = "maps are upright, in pixels per view step, and nearer is larger"
    wrong, parts = {}, {}
    for name, scene in truths().items():
        parts[name] = answers[name]
        found = answers[name].maps.get(scene.ref)
        if found is None or found.shape != (scene.height, scene.width):
            continue
        truth, pair = scene.truth[scene.ref], np.float32(scene.pair_steps)
        rivals: dict[str, NDArray[np.float32]] = {
            "upside down: rows of a PFM file go from bottom to top": found[::-1],
            "mirrored": found[:, ::-1],
            "turned by half": found[::-1, ::-1],
            "of the other sign: nearer must be larger": -found,
            f"in pixels of the pair: divide them by {pair:g}, its view steps": found / pair,
            **{f"{factor:g} times too large": found / np.float32(factor) for factor in FACTORS},
            **{f"{factor:g} times too small": found * np.float32(factor) for factor in FACTORS},
        }
        flat = np.full_like(truth, np.nanmedian(truth))  # what is far too small is nearly that
        most = RIGHT * min(_bad(found, truth, pair), _bad(flat, truth, pair))
        left = {words: _bad(rival, truth, pair) for words, rival in rivals.items()}
        best = min(left, key=lambda words: left[words])
        if left[best] <= most:
            share = f"{_bad(found, truth, pair):.0%} are wrong as they are, {left[best]:.0%} so"
            wrong[name] = f"answers are {best} ({share})"
    return _seen("sense", demand, parts, wrong)


def _bad(found: NDArray[np.float32], truth: NDArray[np.float32], pair: np.float32) -> float:
    """The share of pixels that are wrong by more than 1 px of the pair, or missing."""
    return float(np.mean(~(np.abs(found - truth) * pair <= 1)))


def _honest(answers: Mapping[str, Answer]) -> CheckResult:
    demand = "no answer is NaN, never infinite"
    wrong = {name: "infinite" for name, found in answers.items() if found.infinite}
    return _seen("honest", demand, answers, wrong)


def _written(answers: Mapping[str, Answer]) -> CheckResult:
    """Of two solves whose fresh memory was filled with different garbage: pixels that differ were never written."""
    name, demand = "written", "every pixel of a map is written, be it with NaN"
    first, again, other = (answers[which] for which in ("easy", "easy again", "easy, other garbage"))
    # a method that does not repeat itself differs anyway, which `seed` tells
    if not first.maps or set(first.maps) != set(other.maps) or first.digest != again.digest:
        return CheckResult(name, demand, "skipped", "nothing to compare")
    if first.digest == other.digest:
        return CheckResult(name, demand, "pass")
    unlike = {view: int((~_agreeing(values, other.maps[view], 0)).sum()) for view, values in first.maps.items()}
    where = ", ".join(f"{count} pixels of view {view}" for view, count in unlike.items() if count)
    said = f"{where or 'history, work, volume or confidence'}: what they hold depends on memory that was never written"
    return CheckResult(name, demand, "fail", said)


def _leaves_input(answers: Mapping[str, Answer]) -> CheckResult:
    demand = "the views are left as they were"
    wrong = {name: "changed" for name, found in answers.items() if found.touched}
    # views are read-only: a method that writes into them usually fails before it changes anything
    wrong |= {name: found.error for name, found in answers.items() if "read-only" in found.error}
    return _seen("input", demand, answers, wrong)


def _seen(name: str, demand: str, answers: Mapping[str, Answer], wrong: Mapping[str, str]) -> CheckResult:
    if not wrong and not any(found.maps for found in answers.values()):
        return CheckResult(name, demand, "skipped", "no answers to look at")
    return CheckResult(name, demand, "fail" if wrong else "pass", _listed(wrong))


def _pair(name: str, demand: str, answers: Mapping[str, Answer], a: str, b: str) -> CheckResult | tuple[Answer, Answer]:
    """Two answers to compare, or the result of the check where one of them is missing."""
    one, two = answers[a], answers[b]
    if one.maps and two.maps:
        return one, two
    if one.maps and two.error:
        return CheckResult(name, demand, "fail", f"{b}: {two.error}")
    return CheckResult(name, demand, "skipped", f"no answer to compare: {one.reason or one.error or two.reason}")


def _same(name: str, demand: str, answers: Mapping[str, Answer], other: str) -> CheckResult:
    pair = _pair(name, demand, answers, "easy", other)
    if isinstance(pair, CheckResult):
        return pair
    one, two = pair
    if one.digest == two.digest:
        return CheckResult(name, demand, "pass", "byte for byte")
    if one.maps.keys() != two.maps.keys():
        return CheckResult(name, demand, "fail", f"maps of the views {sorted(one.maps)}, then of {sorted(two.maps)}")
    shares = [np.mean(~_agreeing(one.maps[view], two.maps[view], 0)) for view in one.maps]
    what = (
        f"{max(shares):.2%} of a map's pixels differ"
        if max(shares)
        else "the maps are the same; confidence, volume or work differ"
    )
    return CheckResult(name, demand, "fail", what)


def _mirrored(answers: Mapping[str, Answer]) -> CheckResult:
    demand = f"in a mirror, {AGREEMENT:.0%} of the pixels are the same within half a plane"
    told = []
    for name in ("easy", "either sign"):
        pair = _pair("mirror", demand, answers, name, f"{name} mirrored")
        if isinstance(pair, CheckResult):
            told.append(pair)
            continue
        trial = trials()[name]
        last = len(trial.views) - 1
        # half a plane: planes are at most one pixel of the field's pair apart, that is 1 / pair_steps per view step
        same = _agreeing(pair[0].maps[trial.ref], pair[1].maps[last - trial.ref][:, ::-1], 0.5 / trial.pair_steps)
        told.append(
            CheckResult("mirror", demand, "pass" if same.mean() >= AGREEMENT else "fail", f"{name} {same.mean():.2%}")
        )
    verdicts = {finding.verdict for finding in told}
    verdict: Verdict = "fail" if "fail" in verdicts else "pass" if "pass" in verdicts else "skipped"
    return CheckResult("mirror", demand, verdict, "; ".join(dict.fromkeys(finding.reason for finding in told)))


def _agreeing(one: NDArray[np.float32], two: NDArray[np.float32], tolerance: float) -> NDArray[np.bool_]:
    return np.asarray((np.abs(one - two) <= tolerance) | (np.isnan(one) & np.isnan(two)))


def _quiet(answers: Mapping[str, Answer]) -> CheckResult:
    demand = "nothing is printed; what is goes to the cell's log"
    said = next((found.output for found in answers.values() if found.maps and found.output), "")
    return CheckResult(
        "quiet", demand, "note" if said else "pass", f"prints {said.splitlines()[0][:60]!r}" if said else ""
    )
