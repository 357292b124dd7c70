"""The control of materiality: the same settings and similarities, and no more."""

import numpy as np
import pytest
from attrs import asdict, evolve
from boxes import FISTA, box_before_wall

from matbench.algorithm import Context
from matbench.algorithms.materiality import Materiality
from matbench.algorithms.multiview_sgm import MultiviewSGM
from matbench.errors import UserError
from matbench.parameters import refuse_silent


def test_the_control_shares_settings_and_similarities():
    changes = {"views": 3, "similarity": "census", "hidden": 0.5, "mending": 1, "small_step": 0.3}
    for control, method in [(MultiviewSGM(), Materiality()), (MultiviewSGM(**changes), Materiality(**changes))]:
        assert (control.matching, control.inference) == (method.matching, method.inference)
        assert asdict(control).keys() == {"matching", "inference"}
    scene = box_before_wall()
    plain = MultiviewSGM().solve(scene, Context()).work["pair_similarities"]
    # every view is read as the control reads them, again at every pass
    for passes in (0, 1, 3):
        work = Materiality(passes=passes).solve(scene, Context()).work
        assert (work["passes"], work["pair_similarities"]) == (passes, (1 + passes) * plain)
    soft, consensus = (evolve(FISTA, start=start).solve(scene, Context()).work for start in ("soft", "consensus"))
    assert consensus["pair_similarities"] == soft["pair_similarities"] + plain


def test_materiality_without_visibility_and_without_mu_is_the_control():
    scene, context = box_before_wall(), Context()
    control = MultiviewSGM(surfaces=False).solve(scene, context)
    answers = {
        (visibility, material): Materiality(surfaces=False, visibility=visibility, material=material).solve(
            scene, context
        )
        for visibility in (True, False)
        for material in (0.25, 0.0)
    }
    neither = answers[False, 0.0]
    for found, expected in [(neither.disparity, control.disparity), (neither.confidence, control.confidence)]:
        np.testing.assert_array_equal(found[scene.ref], expected[scene.ref])
    maps = [answer.disparity[scene.ref] for answer in answers.values()]
    for i, one in enumerate(maps):
        assert not any(np.array_equal(one, other) for other in maps[:i])


def test_the_control_refuses_what_it_does_not_read():
    for base, name in [({"similarity": "linear"}, "sigma"), ({"window": 1}, "adaptive")]:
        with pytest.raises(UserError, match=name):
            refuse_silent("multiview_sgm", MultiviewSGM(**base), {name: 1.0})
    assert not MultiviewSGM(similarity="rms").silent.keys() & {"sigma", "adaptive", "window"}
