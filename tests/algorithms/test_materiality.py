"""Materiality and its control on small scenes of known truth, whatever the solver."""

import numpy as np
import pytest
from attrs import asdict, evolve

from matbench.algorithm import Algorithm, Context
from matbench.algorithms.materiality import Materiality
from matbench.algorithms.multiview_sgm import MultiviewSGM
from matbench.errors import UserError
from matbench.parameters import build, parameters, refuse_silent, values_of
from matbench.scene import Range, Scene
from matbench.spec import parse

PAPER = Materiality(**Materiality.presets["paper"])
FISTA = Materiality(optimiser="fista", passes=5, views=5)


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


@pytest.mark.parametrize("method", [Materiality(), MultiviewSGM(), Materiality(binarization="ray"), FISTA])
@pytest.mark.parametrize(("wall", "box"), [(1, 4), (-3, 0), (-4, -2)])
def test_finds_both_surfaces(method, wall, box):
    scene = box_before_wall(wall=wall, box=box)
    assert isinstance(method, Algorithm)
    assert wrong(method, scene) < 6


def test_visibility_helps_where_views_are_hidden():
    scene = box_before_wall(n=5, ref=0, box=6, height=40, width=60)
    for method in (Materiality(), FISTA):
        assert wrong(method, scene) < wrong(MultiviewSGM(), scene)


def test_results_do_not_depend_on_threads():
    scene = box_before_wall(height=40)
    ray, soft = Materiality(passes=2, binarization="ray"), Materiality(start="soft", adaptive=0.0)
    for method in (Materiality(passes=2), ray, soft, MultiviewSGM(), PAPER, FISTA, evolve(FISTA, counted="global")):
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
    "method",
    [
        Materiality(),
        MultiviewSGM(),
        PAPER,
        FISTA,
        evolve(FISTA, fineness=3, binarization="ray"),
        Materiality(fineness=3),
    ],
)
def test_any_size_is_answered_within_the_range(method, n, height, width, wall, box):
    for margin in (0, 1):
        scene = box_before_wall(n, height, width, wall, box, margin=margin)
        found = method.solve(scene, Context(threads=2)).disparity[1]
        assert found.shape == (height, width)
        answered = found[~np.isnan(found)]
        by_volume = isinstance(method, MultiviewSGM) or method.solver.binarization == "volume"
        assert answered.size == found.size or not by_volume
        assert (answered >= scene.disparities.least - 1e-4).all()
        assert (answered <= scene.disparities.largest + 1e-4).all()


@pytest.mark.parametrize("method", [Materiality(passes=3), MultiviewSGM(), PAPER, FISTA])
@pytest.mark.parametrize("level", [0, 255])
def test_constant_images_are_answered_without_a_warning(method, level):
    views = np.full((3, 8, 12, 3), level, np.uint8)
    scene = Scene("constant", views, ("0", "1", "2"), 1, Range(0, 3), {}, 1.0)
    estimate = method.solve(scene, Context())
    assert not np.isinf(estimate.disparity[1]).any()
    if estimate.volume is not None:
        assert np.isfinite(estimate.volume.values).all()


@pytest.mark.parametrize("start", ["mean", "soft", "consensus"])
@pytest.mark.parametrize("method", [Materiality(), FISTA], ids=["fixed_point", "fista"])
def test_views_without_any_likeness_are_answered_without_a_warning(method, start):
    views = np.zeros((3, 8, 12, 3), np.uint8)
    views[1] = 255
    scene = Scene("black and white", views, ("0", "1", "2"), 1, Range(0, 3), {}, 1.0)
    method = evolve(method, start=start, similarity="linear", **({"sharpness": 200.0} if start == "soft" else {}))
    estimate = method.solve(scene, Context())
    assert np.isfinite(estimate.disparity[1]).all()
    values = estimate.volume.values
    assert 0 <= values.min() <= values.max() <= 1


def test_a_choice_of_views_answers_in_steps_of_the_given_scene():
    scene = box_before_wall(n=5, ref=2, wall=1, box=3, margin=0)
    estimate = Materiality(views=3).solve(scene, Context())
    assert estimate.volume.views == (0, 2, 4)
    for method in (Materiality(views=3), MultiviewSGM(views=3)):
        assert wrong(method, scene) < 8


def test_paper_preset_is_literal():
    matching, solver, energy = PAPER.matching, PAPER.solver, PAPER.energy
    assert (matching.views, matching.pairs, matching.fineness, matching.truncation) == (4, "consecutive", 1, 0)
    assert (matching.similarity, matching.window, matching.sigma) == ("ssd", 5, 16)
    assert (solver.start, solver.optimiser, solver.binarization) == ("mean", "gradient", "plane")
    assert (energy.counted, energy.across, energy.along) == ("global", 0, 0)
    found = PAPER.solve(box_before_wall(), Context()).disparity[1]
    answered = found[~np.isnan(found)]
    assert answered.size > found.size / 2
    np.testing.assert_array_equal(answered, np.rint(answered))


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
        ("adaptive", -1.0),
        ("alike", -1.0),
        ("mending", -1),
    ],
)
def test_a_wrong_value_names_the_parameter(name, value):
    with pytest.raises(ValueError, match=name):
        Materiality(**{name: value})


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


def test_without_passes_the_map_is_the_controls():
    scene = box_before_wall()
    same = [method.solve(scene, Context()).disparity[1] for method in (Materiality(passes=0), MultiviewSGM())]
    np.testing.assert_array_equal(*same)


@pytest.mark.parametrize("name", ["paper", "descent"])
def test_presets_set_nothing_that_is_not_read(name):
    method = Materiality(**Materiality.presets[name])
    assert not set(Materiality.presets[name]) & set(method.silent)


SILENT = [
    ({}, "count=1.0 counted=global target=union across=1.0 along=1.0 edge=5.0 sharpness=5.0 sigma=5.0 tolerance=0.1"),
    ({"passes": 0}, "material=0.1 tolerance=0.1"),
    ({"passes": 0, "start": "soft"}, "adaptive=5.0 mending=1 hidden=0.1 small_step=0.1 large_step=2.0 contrast=5.0"),
    ({"window": 1}, "adaptive=5.0"),
    ({"similarity": "ssd"}, "alike=5.0"),
    ({"similarity": "census", "alike": 0.0}, "truncation=5.0 colour=false"),
    ({"optimiser": "fista", "passes": 5, "start": "soft"}, "adaptive=5.0 mending=1"),
    (
        {"optimiser": "fista", "passes": 5, "start": "mean", "binarization": "ray"},
        "hidden=0.1 material=0.1 contrast=5.0",
    ),
    ({"optimiser": "fista", "passes": 5, "across": 0.0, "along": 0.0}, "edge=5.0"),
    ({"optimiser": "fista", "passes": 5, "count": 0.0}, "counted=global target=union"),
    ({"optimiser": "fista", "passes": 2}, "tolerance=0.9"),
]


@pytest.mark.parametrize(("base", "options"), SILENT, ids=str)
def test_what_changes_nothing_is_refused_and_changes_nothing(base, options):
    (one,) = parse(f"materiality[{options}]")
    scene = box_before_wall(n=3, height=12, width=20)
    plain = Materiality(**base)
    found = plain.solve(scene, Context())
    defaults = parameters(Materiality)
    for name, text in one.options.items():
        with pytest.raises(UserError, match=rf"^materiality: {name}=\S+ changes nothing here: it takes [a-z]"):
            refuse_silent("materiality", plain, {name: text})
        silent = build("materiality", Materiality, {**base, name: text})  # as a stored run may have it
        with pytest.raises(ValueError, match=f"{name}=.* changes nothing"):
            Materiality(**base, **{name: values_of(silent)[name]})
        Materiality(**base, **{name: defaults[name].default})
        other = silent.solve(scene, Context())
        np.testing.assert_array_equal(other.disparity[1], found.disparity[1])
        np.testing.assert_array_equal(other.volume.values, found.volume.values)


def test_the_control_refuses_what_it_does_not_read():
    for base, name in [({"similarity": "linear"}, "sigma"), ({"window": 1}, "adaptive")]:
        with pytest.raises(UserError, match=name):
            refuse_silent("multiview_sgm", MultiviewSGM(**base), {name: 1.0})
    assert not MultiviewSGM(similarity="rms").silent.keys() & {"sigma", "adaptive", "window"}


def test_ties_read_the_colours_that_a_census_does_not():
    options = {"similarity": "census", "alike": 0.0, "optimiser": "fista"}
    assert "colour" in Materiality(**options, across=0.0, along=0.0).silent
    assert "colour" not in Materiality(**options).silent
