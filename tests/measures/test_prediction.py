"""Prediction of a withheld view: carrying maps, colours, and the protocol from end to end."""

import numpy as np
import pytest
from attrs import evolve
from real import Real

import matbench
from matbench.datasets.synthetic import SYNTHETIC
from matbench.errors import UserError
from matbench.measures.prediction import coverage, differences, hold_out, predict, psnr
from matbench.regions import REGIONS
from matbench.scene import Scene
from matbench.scenes.views_only import without_truth


@pytest.fixture(scope="module", params=["box", "curved", "spheres"])
def scene(request: pytest.FixtureRequest) -> Scene:
    return SYNTHETIC.load(request.param, {"size": "160x120", "noise": "0"}, None)


def test_exact_maps_predict_well_and_wrong_ones_badly(scene: Scene) -> None:
    for end, index in (("left", 0), ("right", 4)):
        held = hold_out(scene, end)
        truth = held.truth[held.ref]
        exact = differences(held, truth)
        assert psnr(exact) > 32
        wrong = [psnr(differences(held, values)) for values in (truth + 1, truth - 1, truth * 0, truth[:, ::-1])]
        assert max(wrong) < psnr(exact) - 6
        # it predicts what the reference view sees of that view
        seen = scene.visible[index][scene.ref]
        predicted = ~np.isnan(exact[:, 0]).reshape(seen.shape)
        assert (seen & predicted).sum() / (seen | predicted).sum() > 0.97
        assert coverage(exact) == pytest.approx(100 * predicted.mean())


def test_missing_answers_lower_the_coverage_only(scene: Scene) -> None:
    held = hold_out(scene, "right")
    truth = held.truth[held.ref].copy()
    whole = differences(held, truth)
    truth[::2] = np.nan
    half = differences(held, truth)
    assert coverage(half) == pytest.approx(coverage(whole) / 2, abs=1)
    assert psnr(half) == pytest.approx(psnr(whole), abs=1)
    nothing = differences(held, np.full_like(truth, np.nan))
    assert coverage(nothing) == 0
    assert np.isnan(psnr(nothing))


def test_the_same_view_is_predicted_perfectly() -> None:
    view = np.random.default_rng(0).integers(0, 256, (5, 9, 3), np.uint8)
    there = predict(view, np.full((5, 9), 3, np.float32), 0)
    np.testing.assert_array_equal(there, view)
    assert psnr((there - view).reshape(-1, 3)) == 100
    shifted = predict(view, np.full((5, 9), 1.5, np.float32), 2)
    np.testing.assert_array_equal(shifted[:, :6], view[:, 3:])
    assert np.isnan(shifted[:, 6:]).all()


def test_psnr_by_hand() -> None:
    assert psnr(np.full((4, 3), 255.0)) == 0
    assert psnr(np.full((4, 3), 25.5)) == pytest.approx(20)


def test_methods_do_not_see_the_view_and_its_truth(scene: Scene) -> None:
    held = hold_out(scene, "right")
    assert (held.n, held.labels, held.ref) == (4, ("0", "1", "2", "3"), 2)
    assert held.held_out is not None
    assert (held.held_out.label, held.held_out.steps) == ("4", 2)
    np.testing.assert_array_equal(held.held_out.image, scene.views[4])
    assert without_truth(held).held_out is None
    assert held.scored_regions.keys() == REGIONS.keys()
    assert not without_truth(held).scored_regions
    other = evolve(held, held_out=evolve(held.held_out, image=255 - held.held_out.image))
    assert other.digest == held.digest, "methods see the same"
    assert other.truth_digest != held.truth_digest, "but are not scored by the same"
    left = hold_out(scene, "left").choose([1, 3])
    assert left.held_out is not None
    assert left.held_out.steps == -1
    assert left.ref == 0


def test_every_scene_can_be_asked_for_a_prediction(real: Real) -> None:
    held = matbench.load_scene("middlebury2003/teddy[predict=right views=0:9:2]", real("middlebury2003/teddy"))
    assert held.name == "middlebury2003/teddy[predict=right views=0:9:2]"
    assert held.held_out is not None
    assert (held.n, held.held_out.label, held.held_out.steps) == (4, "8", 3)
    truth = held.truth[held.ref]
    assert len(differences(held, truth)) < 375 * 430, "without the black border"
    assert psnr(differences(held, truth)) > psnr(differences(held, truth + 1)) + 4


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("synthetic/box[predict=middle]", "left, right"),
        ("synthetic/box[predict=right ref=4]", "is the reference view"),
        ("synthetic/box[n=2 predict=left]", "at least three"),
    ],
)
def test_impossible_predictions_are_refused(name: str, words: str) -> None:
    with pytest.raises(UserError, match=words) as caught:
        matbench.load_scene(name.replace("[", "[size=48x36 "))
    assert "\n" not in str(caught.value)
