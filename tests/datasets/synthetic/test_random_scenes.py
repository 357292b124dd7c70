"""Random worlds by name: what they are called, their sets, and that they never change."""

from hashlib import sha256
from itertools import chain

import numpy as np
import pytest

from matbench.datasets.synthetic import SYNTHETIC, materiality, random_scenes
from matbench.datasets.synthetic.families import FAMILIES
from matbench.datasets.synthetic.random_worlds import draw
from matbench.datasets.synthetic.solids import Model
from matbench.errors import UserError
from matbench.spec import parse, read_scene

TINY = {"size": "80x60"}


def test_a_world_is_called_by_what_decides_it() -> None:
    one, other = SYNTHETIC.load("world", TINY | {"seed": "7"}, None), SYNTHETIC.load("world-7", TINY, None)
    assert one.name == other.name == "synthetic/world-7[size=80x60]"
    assert one.digest == other.digest
    thin = SYNTHETIC.load("world", TINY | {"seed": "7", "family": "thin", "noise": "4"}, None)
    assert thin.name == "synthetic/world-thin-7[noise=4 size=80x60]"
    assert SYNTHETIC.load("world", TINY, None).name == "synthetic/world-0[size=80x60]"
    assert SYNTHETIC.load("world-mixed-7", TINY, None).name == one.name
    assert len({scene.digest for scene in (one, thin)}) == 2


def test_another_seed_is_another_witness_and_another_option_is_not() -> None:
    """What stands before the brackets is what means over scenes count once."""
    asked = [{"seed": "7"}, {"seed": "7", "noise": "8"}, {"seed": "8"}, {"seed": "7", "family": "thin"}]
    names = [read_scene(SYNTHETIC.load("world", TINY | one, None).name).name for one in asked]
    assert names == [f"synthetic/world-{what}" for what in ("7", "7", "8", "thin-7")]


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("world", {"family": "thick"}, "unknown family 'thick' of synthetic/world: did you mean 'thin'"),
        ("world", {"seed": "-1"}, "a whole number from 0"),
        ("world-7", {"seed": "8"}, "seed=8 of synthetic/world-7: its name says seed=7 already"),
        ("world", {"sed": "8"}, "did you mean 'seed'"),
        ("world", {"n": "1"}, "2 to 25"),
        ("worlds", {}, "did you mean 'world'"),
        ("box", {"family": "thin"}, "unknown option 'family' of synthetic/box"),
    ],
)
def test_wrong_names_are_told_in_a_line(name: str, options: dict[str, str], words: str) -> None:
    with pytest.raises(UserError, match=words) as caught:
        SYNTHETIC.load(name, options, None)
    assert "\n" not in str(caught.value)


def test_where_a_tall_picture_sees_past_the_world_there_is_no_truth() -> None:
    scene = SYNTHETIC.load("world-123", {"size": "160x240"}, None)
    truth = scene.truth[scene.ref]
    missed = np.isnan(truth)
    assert 0 < missed.sum() < 0.01 * truth.size
    assert truth[~missed].min() > 0
    assert not any(region[missed].any() for region in scene.regions.values())
    assert not scene.visible[scene.ref][: scene.ref, missed].any()


@pytest.mark.parametrize(("family", "seed"), [*zip(FAMILIES, range(20, 30), strict=False), ("mixed", 1)])
def test_a_scene_is_whole(family: str, seed: int) -> None:
    scene = SYNTHETIC.load("world", TINY | {"family": family, "seed": str(seed)}, None)
    assert sorted(scene.truth) == sorted(scene.visible) == list(range(scene.n))
    assert all(np.isfinite(truth).all() and truth.min() > 0 for truth in scene.truth.values())
    assert np.mean(scene.out_of_range) < 0.001
    np.testing.assert_array_equal(scene.regions["nonocc"], scene.visible[scene.ref][scene.ref + int(scene.pair_steps)])
    assert {"all", "nonocc", "occ", "disc", "textureless", "half_occluded"} <= set(scene.scored_regions)


def test_views_can_be_chosen_and_any_of_them_scored() -> None:
    scene = SYNTHETIC.load("world-0", TINY | {"n": "4"}, None)
    assert (scene.n, scene.ref, scene.pair_steps) == (4, 2, 1)
    assert SYNTHETIC.load("world-0", TINY | {"n": "9", "views": "3"}, None).n == 3
    for ref in range(5):
        assert SYNTHETIC.load("world-2", TINY | {"n": "5", "ref": str(ref)}, None).ref == ref


def test_materialities_are_those_of_the_truth() -> None:
    options = TINY | {"n": "3"}
    scene, exact = SYNTHETIC.load("world-5", options, None), materiality("world-5", options)
    for view in range(3):
        rays = exact.space.in_view(exact.values, view)
        assert rays.any(axis=1).all()
        nearest = exact.space.planes - 1 - rays[:, ::-1].argmax(axis=1)
        off = exact.space.disparities[nearest] - scene.truth[view]
        assert (np.abs(off) <= 1.0001).mean() > 0.97


def test_sets_are_pinned() -> None:
    """Their definitions never change within a version: scores of different people are compared."""
    assert {name: (len(names), names[0], names[-1]) for name, names in random_scenes.SETS.items()} == {
        "worlds/quick": (12, "synthetic/world-0[size=160x120]", "synthetic/world-11[size=160x120]"),
        "worlds/standard": (100, "synthetic/world-0", "synthetic/world-99"),
        "worlds/large": (1000, "synthetic/world-0", "synthetic/world-999"),
    }
    assert all(len(set(names)) == len(names) for names in random_scenes.SETS.values())
    assert set(random_scenes.SETS["worlds/standard"]) < set(random_scenes.SETS["worlds/large"])


def test_no_world_of_a_set_is_ever_drawn_otherwise() -> None:
    """Geometry, materials, cameras and their faults of all 1000."""
    found = sha256()
    for seed in range(1000):
        drawn = draw(seed)
        model, numbers = Model.of(drawn.solids), [drawn.near, drawn.largest, drawn.views, drawn.ref, drawn.steps]
        for part in (model.kinds, model.rows, model.boxes, model.skins, np.array([*numbers, *drawn.light])):
            found.update(part.tobytes())
        found.update(repr(drawn.strengths).encode())
    assert found.hexdigest()[:16] == "8bb2c42df6fb9ec9"


DIGESTS = {
    "synthetic/world-0[size=160x120]": "6df9243fd2ca",
    "synthetic/world-1[size=160x120]": "560f38c65d94",
    "synthetic/world-2[size=160x120]": "1f5a48a2a700",
    "synthetic/world-occlusion-3[size=80x60 n=2]": "535379a183d6",
    "synthetic/world-thin-3[size=80x60 n=2]": "4b134f2926ff",
    "synthetic/world-weak-3[size=80x60 n=2]": "11810d5ff8d3",
    "synthetic/world-repetition-3[size=80x60 n=2]": "c540bf6c5d17",
    "synthetic/world-slant-3[size=80x60 n=2]": "af907b01824c",
    "synthetic/world-photometric-3[size=80x60 n=2]": "a909e3814f60",
    "synthetic/world-999[n=2]": "af291afefc44",
}


def test_worlds_are_pinned() -> None:
    """Pictures, rounded to grey levels, and truth, rounded to 1/1000 px: the same on every machine."""
    asked = [
        *(parse(name)[0] for name in random_scenes.SETS["worlds/quick"][:3]),
        *(parse(f"synthetic/world-{family}-3[size=80x60 n=2]")[0] for family in list(FAMILIES)[1:]),
        *parse("synthetic/world-999[n=2]"),
    ]
    found = {}
    for spec in asked:
        scene = SYNTHETIC.load(spec.name.partition("/")[2], spec.options, None)
        truth = np.floor(scene.truth[scene.ref].astype(float) * 1000 + 0.5).astype(np.int32)
        parts = chain(
            [scene.views.tobytes(), truth.tobytes()], (scene.regions[name].tobytes() for name in ("occ", "disc"))
        )
        found[str(spec)] = sha256(b"".join(parts)).hexdigest()[:12]
    assert found == DIGESTS
