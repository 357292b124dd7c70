"""Choosing from a scene: views by number, baseline or label, the reference view, the range to search."""

import re
from collections.abc import Mapping, Sequence

from matbench.errors import UserError, unknown
from matbench.scene import NotInScene, Range, evenly_spaced

FARTHEST = 9999  # px of the pair, either way


def views_and_reference(
    scene: str,
    labels: Sequence[str],
    preferred: Sequence[int],
    options: Mapping[str, str],
    prefixes: Sequence[str] = (),
) -> tuple[list[int], int]:
    """Indices of the views that the options `views` and `baseline` ask for, and of the reference view.

    ``views=5`` asks for that many views, evenly spaced, as wide as they fit. ``baseline=4`` asks for all views
    within four view steps. Both together ask for that many views of which the last is that far from the
    first. In these cases the reference view is that of the whole scene, whatever the numbers are, so that a
    sweep over them scores the same view; it need not lie in the middle. Other values of `views` are
    labels, as in `view_indices`.

    Parameters
    ----------
    scene, labels, prefixes
        As in `view_indices`.
    preferred
        As in `reference`; `ref` of the options is its choice.

    Raises
    ------
    NotInScene
        If the scene has not so many views, or not at that baseline.
    UserError
        If an option cannot be read, or no view with ground truth is left.
    """
    views, wide, ref = (options.get(key) for key in ("views", "baseline", "ref"))
    counted = views is None or re.fullmatch(r"[0-9]{1,6}", views) is not None
    if wide is None and not (counted and views):
        chosen = view_indices(scene, labels, views, prefixes)
        return chosen, reference(scene, labels, preferred, chosen, ref, prefixes)
    if not counted:
        raise UserError(f"baseline={wide} of {scene} goes with a number of views, such as views=3, not views={views}")
    if wide is not None and not re.fullmatch(r"[0-9]{1,6}", wide):
        raise UserError(f"baseline={wide} of {scene}: a whole number of view steps from the first view to the last")
    n = len(labels)
    index = reference(scene, labels, preferred, range(n), ref, prefixes)
    asked = " ".join(f"{key}={value}" for key, value in (("views", views), ("baseline", wide)) if value is not None)
    baseline = None if wide is None else int(wide)
    count = int(views) if views is not None else int(wide or 0) + 1
    if not 2 <= count <= n:
        possible = f"2 to {n}" if views is not None else f"1 to {n - 1}"
        raise NotInScene(f"{asked} of {scene}: it has {n} views, {possible} is possible")
    found = evenly_spaced(n, index, count, baseline)
    if not found:
        wider = ", ".join(str(b) for b in range(count - 1, n) if evenly_spaced(n, index, count, b))
        raise NotInScene(
            f"{asked} of {scene}: for {count} evenly spaced views, {labels[index]} among them, "
            f"a baseline of {wider} is possible"
        )
    return list(found), index


def search_range(scene: str, text: str | None, pair_steps: float) -> Range | None:
    """The range that the option `disparities` asks for, px per view step; None if it is not given.

    Parameters
    ----------
    text
        ``LEAST:LARGEST``, both included, in pixels of the pair: ``0:21``, ``-7.5:10``.
    pair_steps
        View steps in the pair.

    Raises
    ------
    UserError
        If it cannot be read, is empty, or reaches beyond `FARTHEST`.
    """
    if text is None:
        return None
    number = r"-?[0-9]{1,4}(?:\.[0-9]{1,6})?"
    found = re.fullmatch(f"({number}):({number})", text)
    least, largest = (float(found[1]), float(found[2])) if found else (0.0, 0.0)
    if least >= largest:
        raise UserError(
            f"disparities={text} of {scene}: LEAST:LARGEST in pixels of the pair, from -{FARTHEST} to {FARTHEST}, "
            "is possible, such as 0:21"
        )
    return Range(least, largest).scaled(1 / pair_steps)


def view_indices(scene: str, labels: Sequence[str], choice: str | None, prefixes: Sequence[str] = ()) -> list[int]:
    """Indices of the views that the option `views` asks for.

    Parameters
    ----------
    scene
        Its name, for messages.
    labels
        What the views are called; each ends in a number, and the numbers increase.
    choice
        A slice, half-open as in Python, whose bounds are the numbers in the labels (``0:9:2``,
        ``::2``, ``col2:col6``), or labels joined by plus signs (``2+4+6``); None is all.
    prefixes
        What may stand before a number besides what the label has there: ``im``, ``view``.

    Raises
    ------
    UserError
        If it cannot be read, names a view that the scene does not have, or fewer than two.
    """
    if choice is None:
        return list(range(len(labels)))
    numbers = [_number(label) for label in labels]
    if ":" in choice:
        first, end, step, *rest = [*choice.split(":"), "", ""][: max(3, choice.count(":") + 1)]
        low = _bound(first, labels, prefixes) if first else numbers[0]
        high = _bound(end, labels, prefixes) if end else numbers[-1] + 1
        if rest or low is None or high is None or not re.fullmatch(r"(0*[1-9]\d{0,5})?", step):
            raise UserError(
                f"cannot read views={choice} of {scene}: write FIRST:END or FIRST:END:STEP, the end left out, "
                f"such as {numbers[0]}:{numbers[-1] + 1}:2; views: {', '.join(labels)}"
            )
        asked = range(low, high, int(step or 1))
        chosen = [index for index, number in enumerate(numbers) if number in asked]
    else:
        chosen = [view_index(scene, labels, part, prefixes) for part in choice.split("+")]
    if len(chosen) < 2:
        names = ", ".join(labels[i] for i in chosen) or "none"
        raise UserError(
            f"views={choice} of {scene} chooses {names}: at least two are needed, possible: {', '.join(labels)}"
        )
    return chosen


def view_index(scene: str, labels: Sequence[str], label: str, prefixes: Sequence[str] = ()) -> int:
    """Index of the view called `label`: by its full label, its number, or a prefix and its number.

    Raises
    ------
    UserError
        If there is none.
    """
    number = _bound(label, labels, prefixes)
    numbers = [_number(known) for known in labels]
    if number not in numbers:
        raise unknown(f"view of {scene}", label, labels)
    return numbers.index(number)


def reference(
    scene: str,
    labels: Sequence[str],
    preferred: Sequence[int],
    chosen: Sequence[int],
    choice: str | None,
    prefixes: Sequence[str] = (),
) -> int:
    """Index of the reference view.

    Parameters
    ----------
    preferred
        The views that have ground truth, the one to take first.
    chosen
        The views that are kept.
    choice
        What the option `ref` says; None takes the first preferred view that was chosen.

    Raises
    ------
    UserError
        If the chosen views have no ground truth, or `choice` has none or is not among them.
    """
    kept = ", ".join(labels[i] for i in chosen)
    with_truth = ", ".join(labels[i] for i in sorted(preferred)) or "none"
    if choice is None:
        possible = [index for index in preferred if index in chosen]
        if not possible:
            raise UserError(f"none of the views {kept} of {scene} has ground truth: choose one of {with_truth}")
        return possible[0]
    index = view_index(scene, labels, choice, prefixes)
    if index not in preferred:
        raise UserError(f"view {labels[index]} of {scene} has no ground truth (ref={choice}): possible: {with_truth}")
    if index not in chosen:
        raise UserError(f"view {labels[index]} of {scene} (ref={choice}) is not among the chosen views {kept}")
    return index


def _number(label: str) -> int:
    return int(re.sub(r"\D", "", label))


def _bound(text: str, labels: Sequence[str], prefixes: Sequence[str]) -> int | None:
    """The number of a label, with or without its prefix; None if it is none."""
    found = re.fullmatch(r"([A-Za-z]*)(\d{1,6})", text)
    known = {re.sub(r"\d", "", label) for label in labels} | {"", *prefixes}
    return int(found.group(2)) if found and found.group(1) in known else None
