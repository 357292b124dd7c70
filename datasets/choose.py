"""Choosing views and the reference view of a scene by their labels."""

import re
from collections.abc import Sequence

from matbench.errors import UserError, unknown


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
