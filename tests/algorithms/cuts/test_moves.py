"""The parameters of expansion moves."""

import pytest

from matbench.algorithms.cuts import moves
from matbench.algorithms.cuts.moves import Moves
from matbench.errors import UserError
from matbench.parameters import build


@pytest.mark.parametrize("wrong", [{"rounds": 0}, {"order": -1}, {"flow": "pymaxflow"}])
def test_values_that_make_no_sense_are_refused(wrong):
    with pytest.raises((UserError, ValueError), match=next(iter(wrong))):
        build("cuts", Moves, wrong)


def test_a_library_that_is_not_installed_is_told_by_what_installs_it(monkeypatch):
    monkeypatch.setattr(moves, "find_spec", lambda name: None if name == "ortools" else object())
    with pytest.raises(UserError, match=r"pip install 'matbench-stereo\[ortools\]'"):
        build("cuts", Moves, {"flow": "ortools"})
    assert build("cuts", Moves, {"flow": "scipy"}).flow == "scipy"
