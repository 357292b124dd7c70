"""Is a scene what it says it is? Its images and its ground truth, asked; the answers in words."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from hashlib import sha256
from typing import Literal

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench.measures.prediction import instead_of_truth
from matbench.measures.warping import picture_columns
from matbench.regions import PAIR_REGIONS
from matbench.scene import Scene
from matbench.scenes import alignment
from matbench.scenes.alignment import Matches
from matbench.scenes.photo_consistency import WarpingError, together, warping_errors

Verdict = Literal["good", "note", "problem", "unknown"]

NOTED_ROWS, WRONG_ROWS = 0.5, 1.0  # px of vertical misalignment
NOTED_STEP, WRONG_STEP = 0.12, 0.3  # of a view step, from the view's place
IN_RANGE = 0.9  # share of matched features that the range must hold
FAR_FROM_0 = 1.0  # px of the pair: where all disparities but 0 are larger, 0 is suspicious
LARGEST_BEYOND = 0.02  # share of the truth that may lie outside the range; all of it is told
LEAST_SEEN = 0.1  # share of the truth's points that the other views see, together
NOTED_SHIFT = 0.5  # px of the pair, from where the truth explains the views best
CLEARLY = 0.9  # of the warping error: a rival that leaves less explains the views better
_CLEAR_SHARE = 0.3  # by which one direction must hold more features than the other
_TRUTH_OF = "truth of "
_TRIAL_PIXELS = 200_000  # rivals of the truth are tried on every k-th row


@frozen
class Observation:
    """One thing that was looked at in a scene. (What a check of a method finds is another class.)

    Parameters
    ----------
    topic
        In a word or two.
    verdict
        ``unknown``: it could not be measured.
    text
        What was found, and if it is a problem, what to do.
    """

    topic: str
    verdict: Verdict
    text: str


def check(scene: Scene, names: Sequence[str] | None = None) -> Iterator[Observation]:
    """Look at a scene's order of views, direction of shift, rows and truth, one after the other.

    Parameters
    ----------
    names
        What to call the views in the answers, such as the names of their files; by default their
        labels.
    """
    called = list(names or scene.labels)
    matches = alignment.match(scene.views, scene.ref)
    places = alignment.places(matches, scene.n, scene.ref)
    expected = np.array([scene.steps(view) for view in range(scene.n)])
    if places is not None:  # only ratios are measured: in view steps, the known views are as far apart as they should
        seen = expected[np.isfinite(places)]
        places = places * (seen[-1] - seen[0]) / (len(seen) - 1)
    steps = expected if places is None else places
    found = alignment.disparities(matches, steps)
    if places is not None and not _follow(places) and _inside(scene, -found) > _inside(scene, found) + _CLEAR_SHARE:
        places, found = -places, -found  # no order at all has no direction either: that of the range
    yield _order(scene, called, places)
    yield _direction(scene, found)
    yield _rows(matches, called)
    yield from _same(scene, called)
    yield from _borders(scene, called)
    if not scene.truth:
        yield Observation("truth", "note", f"there is none: a comparison needs {instead_of_truth(scene)}")
    if scene.sparse:
        known = np.count_nonzero(np.isfinite(scene.truth[scene.ref])) / (scene.height * scene.width)
        missing = ", ".join(name for name in PAIR_REGIONS if name not in scene.regions)
        yield Observation(
            "regions", "note", f"truth is known at scattered pixels, {100 * known:.0f} %, so {missing} are unknown"
        )
    for view in sorted(scene.truth):
        yield from _truth(evolve(scene, ref=view, regions={}), called[view])


def conclusion(findings: Iterable[Observation]) -> tuple[str, bool]:
    """What all findings say together, in a line, and whether they show that a scene is what it says.

    What could not be measured is not good. Only truth that explains the images makes up for it: it shows
    that they are views of one scene, in this order and at these steps.
    """
    told = list(findings)
    problems = sum(finding.verdict == "problem" for finding in told)
    if problems:
        return f"{problems} problem{'s' if problems != 1 else ''}", False
    unknown = ", ".join(finding.topic for finding in told if finding.verdict == "unknown")
    if not unknown:
        return "no problems", True
    if any(finding.topic.startswith(_TRUTH_OF) and finding.verdict in ("good", "note") for finding in told):
        return f"no problems, but unknown: {unknown}", True
    return f"not confirmed: {unknown} could not be measured; are all of these pictures views of one scene?", False


def _list(names: Sequence[str]) -> str:
    return ", ".join(names)


def _follow(places: NDArray[np.float64]) -> bool:
    """Do the views lie from one side to the other?"""
    return bool((np.diff(places[np.isfinite(places)]) > 0).all())


def _inside(scene: Scene, disparities: NDArray[np.float64]) -> float:
    """The share of disparities that the scene's range holds, with a margin."""
    least, largest = scene.disparities.least, scene.disparities.largest
    margin = max(0.5, 0.05 * (largest - least))
    held = (disparities >= least - margin) & (disparities <= largest + margin)
    return float(np.mean(held)) if len(held) else 0.0


def _order(scene: Scene, names: Sequence[str], places: NDArray[np.float64] | None) -> Observation:
    if scene.n == 2 and places is None:
        return Observation("order", "unknown", "two views, and too few features are found again in the other one")
    if scene.n == 2:
        return Observation("order", "good", "two views: their order is what the direction of the shift shows")
    if places is None or np.isfinite(places).sum() < 3:
        return Observation("order", "unknown", "too few features are found again in other views to tell their order")
    known = [view for view in range(scene.n) if np.isfinite(places[view])]
    if not _follow(places):
        order = sorted(known, key=lambda view: places[view])
        return Observation(
            "order", "problem", f"the views do not follow one another: list {_list([names[v] for v in order])}"
        )
    away = np.abs(places - np.array([scene.steps(view) for view in range(scene.n)]))
    worst = int(np.nanargmax(away))
    text = (
        f"view {names[worst]} was taken {places[worst] - places[scene.ref]:.2f} steps from {names[scene.ref]}, "
        f"not {scene.steps(worst):g}"
    )
    spaced = "evenly spaced" if scene.is_even else f"spaced as positions says ({scene.where})"
    if away[worst] > NOTED_STEP:
        found = ", ".join(f"{place - places[0]:.2f}" for place in places)
        hint = f"; where they were meant to, write positions = [{found}]" if np.isfinite(places).all() else ""
        if away[worst] > WRONG_STEP:
            return Observation("order", "problem", f"views are not {spaced}: {text}{hint}")
        return Observation("order", "note", f"views are not quite {spaced}: {text}{hint}")
    even = f"from one side to the other, within {away[worst]:.2f} of a step"
    if len(known) < scene.n:
        left = _list([names[view] for view in range(scene.n) if view not in known])
        return Observation("order", "unknown", f"too few features are found again in {left}; the others lie {even}")
    return Observation("order", "good", even)


def _direction(scene: Scene, found: NDArray[np.float64]) -> Observation:
    if len(found) < alignment.ENOUGH:
        return Observation(
            "shift", "unknown", "too few features are found again in other views to tell their disparities"
        )
    inside, mirrored = _inside(scene, found), _inside(scene, -found)
    low, high = np.quantile(found, (0.02, 0.98))
    measured = f"features have {low:.1f} .. {high:.1f} px per view step"
    if inside >= IN_RANGE:
        unsure = "; the range holds either direction, so that only truth can tell it" if mirrored >= IN_RANGE else ""
        return Observation("shift", "good", f"{measured}, the range is {scene.disparities}{unsure}")
    if mirrored >= max(IN_RANGE, inside + _CLEAR_SHARE):
        return Observation(
            "shift",
            "problem",
            f"points move the wrong way: {measured}, the range is {scene.disparities}. Views must be listed from left "
            "to right, so that nearer points move left from one view to the next: list them the other way round",
        )
    share = f"{100 * (1 - inside):.0f} %"
    return Observation("shift", "problem", f"{share} of them lie outside the range {scene.disparities}: {measured}")


def _rows(matches: Mapping[int, Matches], names: Sequence[str]) -> Observation:
    found = {view: rows for view, moved in matches.items() if (rows := alignment.rows(moved)) is not None}
    if not found:
        return Observation("rows", "unknown", "too few features are found again in other views to tell their rows")
    worst = max(found, key=lambda view: found[view].worst)
    rows = found[worst]
    if rows.worst <= NOTED_ROWS:
        return Observation("rows", "good", f"level within {rows.worst:.2f} px")
    side = "lower" if rows.offset > 0 else "higher"
    text = f"view {names[worst]} lies {abs(rows.offset):.2f} px {side} than the reference view"
    turned = ", and is turned or scaled" if rows.worst > 2 * abs(rows.offset) + NOTED_ROWS else ""
    text += f"{turned}: up to {rows.worst:.2f} px between rows"
    wrong = rows.worst > WRONG_ROWS
    return Observation("rows", "problem" if wrong else "note", text + ("; rectify the views first" if wrong else ""))


def _same(scene: Scene, names: Sequence[str]) -> Iterator[Observation]:
    alike: dict[bytes, list[str]] = {}
    for name, view in zip(names, scene.views, strict=True):
        alike.setdefault(sha256(view.tobytes()).digest(), []).append(name)
    for same in alike.values():
        if len(same) > 1:
            yield Observation("views", "problem", f"{_list(same)} are one and the same picture")


def _borders(scene: Scene, names: Sequence[str]) -> Iterator[Observation]:
    lost = {}
    for name, view in zip(names, scene.views, strict=True):
        first, last = picture_columns(view)
        lost[name] = scene.width - 1 - last + first
    black = ", ".join(f"{name} ({count})" for name, count in lost.items() if count)
    if black:
        yield Observation("borders", "note", f"views end in black columns, which match nothing: {black}")


def _truth(scene: Scene, name: str) -> Iterator[Observation]:
    topic = f"{_TRUTH_OF}{name}"
    known = np.count_nonzero(np.isfinite(scene.truth[scene.ref]))
    if zeros := zeros_beside(scene.truth[scene.ref] * np.float32(scene.pair_steps)):
        text = f"{zeros} px of the pair: if 0 means unknown, write unknown = 0"
        yield Observation(topic, "problem" if _is_wrong_at_zeros(scene) else "note", text)
    if beyond := beyond_range(scene):
        share = np.count_nonzero(scene.out_of_range) / known
        yield Observation(topic, "problem" if share > LARGEST_BEYOND else "note", beyond)
    error = together(warping_errors(scene))
    if error is None or error.pixels < LEAST_SEEN * (scene.n - 1) * known:
        yield Observation(topic, "problem", "it leads out of the other views nearly everywhere: is its scale right?")
        return
    at = error.mean
    said = f"warped views differ by {at[1]:.2f} grey levels, {at[0]:.2f} and {at[2]:.2f} with it 1 px of the pair off"
    rival = _better(scene)
    if rival is not None:
        yield Observation(topic, "problem", f"{said}. The views are explained better {rival}")
    elif at[1] >= min(at[0], at[2]):
        way = "smaller" if at[0] < at[2] else "larger"
        yield Observation(topic, "problem", f"{said}: {way} disparities explain the views better")
    else:
        best = _vertex(error)
        text = f"; {best:+.1f} px would explain them best" if abs(best) > NOTED_SHIFT else ""
        yield Observation(topic, "note" if text else "good", said + text)


def zeros_beside(truth: NDArray[np.float32]) -> str:
    """Does 0 stand far from all other disparities, as where it means unknown? In words; empty if not."""
    known = truth[np.isfinite(truth)]
    zeros, others = int(np.count_nonzero(known == 0)), np.abs(known[known != 0])
    if not zeros or not others.size or (least := float(others.min())) < FAR_FROM_0:
        return ""
    return (
        f"{zeros} of {known.size} numbers are 0 ({100 * zeros / known.size:.1f} %), and no other is nearer to it "
        f"than {least:.3g}"
    )


def _is_wrong_at_zeros(scene: Scene) -> bool:
    """Do the views differ clearly more where truth is 0 than elsewhere? What is very far would really be at 0."""
    truth, unknown = scene.truth[scene.ref], np.float32(np.nan)
    parts = [np.where(mask, truth, unknown) for mask in (truth == 0, truth != 0)]
    zero, other = (together(warping_errors(scene, part, (0.0,))) for part in parts)
    return zero is not None and other is not None and CLEARLY * zero.mean[0] > other.mean[0]


def beyond_range(scene: Scene) -> str | None:
    """How much of the reference view's truth lies outside the range that is searched, in words; None if nothing does.

    Whatever little it is, it is told: a method that keeps to the range is wrong there, however good it is.
    """
    beyond = int(np.count_nonzero(scene.out_of_range))
    if not beyond:
        return None
    truth = scene.truth[scene.ref]
    known = truth[np.isfinite(truth)]
    return (
        f"{beyond} of {known.size} pixels of known truth ({100 * beyond / known.size:.2f} %) lie outside the range "
        f"{scene.disparities}, where no method searches: truth is {known.min():g}..{known.max():g} px per view step"
    )


def _vertex(error: WarpingError) -> float:
    """The shift of least error, by a parabola through the three; px of the pair."""
    less, zero, more = error.mean
    return (less - more) / (2 * (less + more - 2 * zero))


def _better(scene: Scene) -> str | None:
    """What explains the views clearly better than the truth as it is, in words; None if nothing does."""
    truth = scene.truth[scene.ref]
    flat = np.where(np.isfinite(truth), np.nanmedian(truth), np.nan).astype(np.float32)
    pair, two = np.float32(scene.pair_steps), np.float32(2)
    rivals: dict[str, Callable[[], NDArray[np.float32]]] = {
        "with its sign reversed: nearer must be larger, and views listed from left to right": lambda: -truth,
        "with it turned upside down: rows of a PFM file go from bottom to top": lambda: truth[::-1],
        "with it mirrored": lambda: truth[:, ::-1],
        "with half of it: is its scale right?": lambda: truth / two,
        "with twice of it: is its scale right?": lambda: truth * two,
        "with one disparity for all pixels: it is not the truth of these images": lambda: flat,
    }
    if scene.pair_steps != 1:
        rivals[f"with it divided by {pair:g}, the steps of the pair: truth is per view step"] = lambda: truth / pair
    step = max(1, -(-truth.size // _TRIAL_PIXELS))
    thin = evolve(
        scene,
        views=scene.views[:, ::step],
        truth={scene.ref: truth[::step]},
        visible={view: seen[:, ::step] for view, seen in scene.visible.items()},
    )

    def left(disparity: NDArray[np.float32]) -> float:
        error = together(warping_errors(thin, np.ascontiguousarray(disparity[::step]), (0.0,)))
        return np.inf if error is None else error.mean[0]

    own = left(truth)
    trials = {words: left(rival()) for words, rival in rivals.items()}
    best = min(trials, key=lambda words: trials[words])
    return best if trials[best] < CLEARLY * own else None
