"""What is kept of all that a method tells."""

import numpy as np
import pytest

from matbench.plans.record_option import RecordOption
from matbench.recording.probe import CapturingProbe
from matbench.space import DisparitySpace, Volume


@pytest.mark.parametrize("passes", [1, 2, 19, 20, 21, 50, 333])
@pytest.mark.parametrize("most", [20, 7, 1])
def test_few_passes_are_kept_of_many(passes: int, most: int) -> None:
    probe, state = CapturingProbe(RecordOption(passes=most, rows=(0,))), np.zeros((1, 1), np.float32)
    for step in range(passes):
        probe.iteration(step, {"total": 1.0}, disparity=state)
    kept = [frame.step for frame in probe.frames]
    assert len(probe.energies["total"]) == passes
    assert most == 1 or kept[0] == 0
    assert kept[-1] == passes - 1
    assert kept == sorted(set(kept))
    assert min(passes, most // 2 + 1) <= len(kept) <= most


def test_pairs_of_a_reference_fill_all_three_colours() -> None:
    space = DisparitySpace(5, 2, 4, 0, 1)
    probe = CapturingProbe(RecordOption(rows=(0,)))
    for pair, value in ((("0", "2"), 0.2), (("1", "2"), 0.4), (("2", "3"), 0.6), (("2", "4"), 0.8)):
        values = np.full(space.shape, value, np.float32)
        probe.volume(f"similarity/{'-'.join(pair)}", Volume(space, values, (0, 1, 2, 3, 4)))
    shown = probe.similarity("abcde")
    assert shown is not None
    assert shown.picture[0, 0, 0].tolist() == [51, 102, 153]  # 0-2, 1-2 and 2-3: those least apart
    assert shown.names == ("a-c", "b-c", "c-d")


def test_names_of_a_method_are_kept_printable() -> None:
    space = DisparitySpace(5, 2, 4, 0, 1)
    probe = CapturingProbe(RecordOption(rows=(0,), volumes=True))
    probe.volume("half \udc80", Volume(space, np.zeros(space.shape, np.float32), (0, 1, 2, 3, 4)))
    probe.iteration(0, {"\x1b[2J": 1.0})
    assert list(probe.volumes) == [r"half \x80"]
    assert list(probe.energies) == [r"\x1b[2J"]
