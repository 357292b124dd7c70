"""Materiality and its control on small scenes."""

import numpy as np
import pytest
from attrs import asdict, evolve

from matbench.algorithm import Algorithm, Context, Probe
from matbench.algorithms.materiality import Materiality
from matbench.algorithms.materiality.descent import RISE
from matbench.algorithms.multiview_sgm import MultiviewSGM
from matbench.scene import Range, Scene
from matbench.space import visibility

PAPER = Materiality(**Materiality.presets["paper"])


def box_before_wall(n=4, height=24, width=40, wall=1, box=4, ref=1, seed=0, margin=1):
    """Textured planes at whole disparities; the box hides the wall, and truth is exact."""
    rng = np.random.default_rng(seed)
    reach = n * (abs(wall) + abs(box)) + width
    far, near = rng.integers(0, 256, (2, height, width + 2 * reach, 3), dtype=np.uint8)
    columns = np.arange(width)
    rows = slice(height // 4, 3 * height // 4)
    views, truth = [], {}
    for j in range(n):
        # x_j = x_ref - (j - ref) d, so column x of view j shows the texture's column x + (j - ref) d
        image = far[:, reach + columns + (j - ref) * wall].copy()
        inside = columns + (j - ref) * box
        covered = (inside >= width // 3) & (inside < 2 * width // 3)
        image[rows, covered] = near[rows][:, reach + inside[covered]]
        views.append(image)
        truth[j] = np.full((height, width), wall, np.float32)
        truth[j][rows, covered] = box
    least, largest = min(wall, box) - margin, max(wall, box) + margin
    return Scene("box", np.stack(views), tuple(map(str, range(n))), ref, Range(least, largest), truth, 1.0)


def wrong(method, scene, **context):
    """Share of the reference view's pixels off by more than half a pixel, in per cent."""
    found = method.solve(scene, Context(**context)).disparity[scene.ref]
    return 100 * float(np.mean(~(np.abs(found - scene.truth[scene.ref]) <= 0.5)))


@pytest.mark.parametrize("method", [Materiality(), MultiviewSGM(), Materiality(binarization="ray")])
@pytest.mark.parametrize(("wall", "box"), [(1, 4), (-3, 0), (-4, -2)])
def test_finds_both_surfaces(method, wall, box):
    scene = box_before_wall(wall=wall, box=box)
    assert isinstance(method, Algorithm)
    assert wrong(method, scene) < 6


def test_visibility_helps_where_views_are_hidden():
    scene = box_before_wall(n=5, ref=0, box=6, height=40, width=60)
    assert wrong(Materiality(), scene) < wrong(MultiviewSGM(), scene)


def test_estimate_is_complete():
    scene = box_before_wall()
    estimate = Materiality().solve(scene, Context())
    assert estimate.disparity[scene.ref].dtype == np.float32
    assert estimate.disparity[scene.ref].shape == (scene.height, scene.width)
    values = estimate.volume.values
    assert values.dtype == np.float32
    assert 0 <= values.min() <= values.max() <= 1
    assert estimate.volume.views == (0, 1, 2, 3)
    # a ray ends once (SPEC 3)
    seen = estimate.volume.space.in_view(values * visibility(estimate.volume, 1), 1)
    assert seen.sum(axis=1).max() <= 1 + 1e-5
    assert {"total", "data", "smooth", "restart"} <= set(estimate.history)
    np.testing.assert_allclose(
        estimate.history["total"], np.add(estimate.history["data"], estimate.history["smooth"]), rtol=1e-9
    )
    passes = estimate.work["passes"]
    assert passes == Materiality().passes
    assert estimate.work["point_updates"] == passes * values.size
    assert estimate.work["pair_similarities"] > 0


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(
    "method", [Materiality(passes=60), Materiality(passes=60, across=0, along=0, pairs="all"), PAPER]
)
def test_energy_never_rises_between_restarts(method, seed):
    history = method.solve(box_before_wall(seed=seed), Context()).history
    total, restart = np.array(history["total"]), np.array(history["restart"])
    assert len(total) > 5
    compared = restart[1:] == 0
    assert (total[1:][compared] <= total[:-1][compared] * (1 + RISE)).all()
    assert total[-1] < total[0]


def test_results_do_not_depend_on_threads():
    scene = box_before_wall(height=40)
    for method in (Materiality(passes=12), MultiviewSGM(), PAPER, Materiality(counted="global", passes=5)):
        one, two = (method.solve(scene, Context(threads=threads)) for threads in (1, 2))
        np.testing.assert_array_equal(one.disparity[1], two.disparity[1])
        assert one.history == two.history
        if one.volume is not None:
            np.testing.assert_array_equal(one.volume.values, two.volume.values)


def test_mirrored_scene_gives_the_mirrored_map():
    scene = box_before_wall(n=3, ref=1)
    mirrored = evolve(scene, views=scene.views[::-1, :, ::-1], truth={}, regions={})
    for method in (Materiality(), MultiviewSGM()):
        found = method.solve(scene, Context()).disparity[1]
        other = method.solve(mirrored, Context()).disparity[1][:, ::-1]
        assert np.mean(np.abs(found - other) > 0.05) < 0.01


@pytest.mark.parametrize(
    ("n", "height", "width", "wall", "box"),
    [(2, 1, 1, 0, 0), (3, 1, 30, 1, 3), (3, 9, 1, 0, 1), (4, 3, 4, 0, 9), (3, 5, 6, -8, -7), (2, 6, 8, 2, 2)],
)
@pytest.mark.parametrize(
    "method", [Materiality(passes=4), MultiviewSGM(), PAPER, Materiality(passes=4, fineness=3, binarization="ray")]
)
def test_any_size_is_answered_within_the_range(method, n, height, width, wall, box):
    for margin in (0, 1):
        scene = box_before_wall(n, height, width, wall, box, margin=margin)
        found = method.solve(scene, Context(threads=2)).disparity[1]
        assert found.shape == (height, width)
        answered = found[~np.isnan(found)]
        assert (answered >= scene.disparities.least - 1e-4).all()
        assert (answered <= scene.disparities.largest + 1e-4).all()


@pytest.mark.parametrize("method", [Materiality(passes=5), MultiviewSGM(), PAPER])
@pytest.mark.parametrize("level", [0, 255])
def test_constant_images_are_answered_without_a_warning(method, level):
    views = np.full((3, 8, 12, 3), level, np.uint8)
    scene = Scene("constant", views, ("0", "1", "2"), 1, Range(0, 3), {}, 1.0)
    estimate = method.solve(scene, Context())
    assert not np.isinf(estimate.disparity[1]).any()
    if estimate.volume is not None:
        assert np.isfinite(estimate.volume.values).all()


def test_a_choice_of_views_answers_in_steps_of_the_given_scene():
    scene = box_before_wall(n=5, ref=2, wall=1, box=3, margin=0)
    estimate = Materiality(views=3).solve(scene, Context())
    assert estimate.volume.views == (0, 2, 4)
    for method in (Materiality(views=3), MultiviewSGM(views=3)):
        assert wrong(method, scene) < 8


def test_paper_preset_is_literal():
    assert (PAPER.views, PAPER.pairs, PAPER.similarity, PAPER.window, PAPER.sigma) == (4, "consecutive", "ssd", 5, 16)
    assert (PAPER.start, PAPER.binarization, PAPER.counted, PAPER.across, PAPER.along) == (
        "mean",
        "plane",
        "global",
        0,
        0,
    )
    assert (PAPER.optimiser, PAPER.truncation, PAPER.fineness) == ("gradient", 0, 1)
    found = PAPER.solve(box_before_wall(), Context()).disparity[1]
    answered = found[~np.isnan(found)]
    assert answered.size > found.size / 2
    np.testing.assert_array_equal(answered, np.rint(answered))


@pytest.mark.parametrize(
    "change",
    [
        {"views": 3},
        {"fineness": 2},
        {"pairs": "all"},
        {"pairs": "consecutive"},
        {"similarity": "ssd"},
        {"window": 5},
        {"similarity": "rms"},
        {"truncation": 10.0},
        {"sigma": 20.0},
        {"colour": False},
        {"start": "mean"},
        {"start": "consensus"},
        {"sharpness": 5.0},
        {"count": 1.0},
        {"counted": "global"},
        {"target": "union"},
        {"across": 0.0},
        {"along": 0.0},
        {"edge": 40.0},
        {"optimiser": "gradient"},
        {"passes": 3},
        {"tolerance": 0.9},
        {"binarization": "plane"},
        {"binarization": "ray"},
        {"hidden": 0.0},
        {"material": 1.0},
        {"small_step": 2.0},
        {"large_step": 0.6},
        {"contrast": 2.0},
    ],
    ids=str,
)
def test_every_switch_changes_something(change):
    rng = np.random.default_rng(3)
    scene = box_before_wall()
    noisy = np.clip(scene.views * 0.3 + 90 + rng.normal(0, 6, scene.views.shape), 0, 255).astype(np.uint8)
    scene = evolve(scene, views=noisy)
    reading = {"binarization", "hidden", "material", "small_step", "large_step", "contrast"}
    # the soft start needs no reader
    base = Materiality(passes=20, start="soft" if set(change) <= reading | {"start"} else "consensus")
    if "sigma" in change:
        base = evolve(base, similarity="rms")
    one, other = (method.solve(scene, Context()) for method in (base, evolve(base, **change)))
    same_volume = np.array_equal(one.volume.values, other.volume.values)
    same_map = np.array_equal(one.disparity[1], other.disparity[1], equal_nan=True)
    assert not (same_volume and same_map)
    if set(change) <= reading:
        assert same_volume


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("start", "hard"),
        ("sharpness", 0.0),
        ("count", -1.0),
        ("counted", "column"),
        ("target", "sum"),
        ("across", -1.0),
        ("along", -1.0),
        ("edge", 0.0),
        ("optimiser", "newton"),
        ("passes", -1),
        ("tolerance", -1.0),
        ("binarization", "cut"),
        ("hidden", -1.0),
        ("material", -1.0),
    ],
)
def test_a_wrong_value_names_the_parameter(name, value):
    with pytest.raises(ValueError, match=name):
        Materiality(**{name: value})


class Listener(Probe):
    active = True

    def __init__(self):
        self.volumes, self.iterations = {}, []

    def volume(self, name, volume):
        self.volumes[name] = volume

    def iteration(self, step, energies, volume=None, derivative=None, disparity=None):
        self.iterations.append((step, energies, volume.values.copy(), derivative.values.copy(), disparity))


def test_probe_is_told_everything_and_changes_nothing():
    scene, listener = box_before_wall(n=5, ref=2), Listener()
    method = Materiality(views=3, passes=6)
    silent = method.solve(scene, Context())
    told = method.solve(scene, Context(probe=listener))
    np.testing.assert_array_equal(silent.disparity[2], told.disparity[2])
    np.testing.assert_array_equal(silent.volume.values, told.volume.values)
    assert silent.history == told.history
    assert set(listener.volumes) == {"similarity/0-2", "similarity/2-4"}
    assert [step for step, *_ in listener.iterations] == list(range(len(told.history["total"])))
    _, energies, mu, slope, disparity = listener.iterations[0]
    assert energies["total"] == told.history["total"][0]
    assert disparity.shape == (scene.height, scene.width)
    assert mu.shape == slope.shape == told.volume.values.shape


def test_the_control_shares_settings_and_similarities():
    control = MultiviewSGM()
    assert asdict(control).items() <= asdict(Materiality()).items()
    scene = box_before_wall()
    solved = [method.solve(scene, Context()).work for method in (Materiality(), Materiality(start="soft"), control)]
    consensus, soft, plain = (work["pair_similarities"] for work in solved)
    # every view in turn is read as the control reads the reference
    assert soft < consensus <= soft + scene.n * plain
