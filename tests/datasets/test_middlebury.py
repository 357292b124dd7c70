"""Middlebury scenes: a small copy of the site's layout, and the real files where they are."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from real import Real

from matbench.datasets.middlebury import MIDDLEBURY_2001, MIDDLEBURY_2003, MIDDLEBURY_2005, MIDDLEBURY_2006, Middlebury
from matbench.errors import UserError
from matbench.scene import NotInScene

WIDTH, HEIGHT = 40, 20


def _write(path: Path, image: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image)


def _site(root: Path) -> Path:
    """A site with every layout; view k is grey k + 1, truth 100 but for an unknown corner."""
    base = root / "middlebury"
    truth = np.full((HEIGHT, WIDTH), 100, np.uint8)
    truth[:2, :3] = 0

    def scene(folder: str, view: str, numbers: range, truths: list[str]) -> None:
        for k in numbers:
            _write(base / folder / view.format(k), np.full((HEIGHT, WIDTH, 3), k + 1, np.uint8))
        for name in truths:
            _write(base / folder / name, truth)

    scene("scenes2001/data/tsukuba", "scene1.row3.col{}.ppm", range(1, 6), ["truedisp.row3.col3.pgm"])
    scene("scenes2001/data/venus", "im{}.ppm", range(9), ["disp2.pgm", "disp6.pgm"])
    scene("scenes2003/newdata/teddy", "im{}.png", range(9), ["disp2.png", "disp6.pgm"])
    scene("scenes2003/newdata/half/teddy", "view{}.ppm", range(2, 7), ["disp2.pgm", "disp6.pgm"])
    scene("scenes2006/ThirdSize/Aloe", "view{}.png", range(7), ["disp1.png", "disp5.png"])
    scene("scenes2006/HalfSize/Aloe", "view{}.png", range(7), ["disp1.png", "disp5.png"])
    scene("scenes2005/FullSize/Computer", "view{}.png", range(7), [])
    scene("scenes2005/HalfSize/Art", "view{}.png", range(7), ["disp1.png", "disp5.png"])
    scene("scenes2005/HalfSize/My_own", "view{}.png", range(7), ["disp5.png"])
    return root


@pytest.fixture
def site(tmp_path: Path) -> Path:
    return _site(tmp_path)


def _refused(dataset: Middlebury, name: str, root: Path | None, *words: str, **options: str) -> None:
    with pytest.raises(UserError) as caught:
        dataset.load(name, options, root)
    message = str(caught.value)
    assert "\n" not in message
    assert all(word in message for word in words), message


@pytest.mark.parametrize(
    ("dataset", "name", "size", "labels", "ref", "pair", "largest", "disparity"),
    [
        (MIDDLEBURY_2001, "tsukuba", None, "col1 col2 col3 col4 col5", "col3", 1, 15, 100 / 16),
        (MIDDLEBURY_2001, "venus", None, "0 1 2 3 4 5 6 7 8", "2", 4, 21 / 4, 100 / 32),
        (MIDDLEBURY_2003, "teddy", None, "0 1 2 3 4 5 6 7 8", "2", 4, 59 / 4, 100 / 16),
        (MIDDLEBURY_2003, "teddy", "half", "2 3 4 5 6", "2", 4, 118 / 4, 100 / 8),
        (MIDDLEBURY_2006, "Aloe", None, "0 1 2 3 4 5 6", "1", 4, 80 / 4, 100 / 12),
        (MIDDLEBURY_2006, "Aloe", "half", "0 1 2 3 4 5 6", "1", 4, 112 / 4, 100 / 8),
        (MIDDLEBURY_2005, "Art", None, "0 1 2 3 4 5 6", "1", 4, 112 / 4, 100 / 8),
    ],
)
def test_every_layout(site: Path, dataset, name, size, labels, ref, pair, largest, disparity) -> None:
    scene = dataset.load(name, {"size": size} if size else {}, site)
    assert scene.name == f"middlebury{dataset.year}/{name}" + (f"[size={size}]" if size else "")
    assert " ".join(scene.labels) == labels
    assert scene.labels[scene.ref] == ref
    assert scene.pair_steps == pair
    assert (scene.disparities.least, scene.disparities.largest) == (0, largest)
    assert scene.views.shape == (len(scene.labels), HEIGHT, WIDTH, 3)
    numbers = [int(label[-1]) for label in scene.labels]
    assert scene.views[:, 0, 0, 0].tolist() == [number + 1 for number in numbers]
    truth = scene.truth[scene.ref]
    assert truth[5, 5] == np.float32(disparity)
    assert len(scene.truth) == (1 if name == "tsukuba" else 2)
    if name == "venus":
        assert truth[0, 0] == 0, "there grey 0 is a disparity"
    else:
        assert np.isnan(truth[0, 0])


def test_choosing_views_rescales(site: Path) -> None:
    whole = MIDDLEBURY_2003.load("teddy", {}, site)
    some = MIDDLEBURY_2003.load("teddy", {"views": "0:9:2", "ref": "6"}, site)
    assert some.name == "middlebury2003/teddy[ref=6 views=0:9:2]"
    assert some.labels == ("0", "2", "4", "6", "8")
    assert (some.ref, some.pair_steps, some.disparities.largest) == (3, 2, 59 / 2)
    np.testing.assert_array_equal(some.truth[1], whole.truth[2] * 2)
    np.testing.assert_array_equal(some.views, whole.views[::2])


def test_regions_do_not_depend_on_the_choice_of_views(site: Path) -> None:
    whole = MIDDLEBURY_2003.load("teddy", {}, site)
    some = MIDDLEBURY_2003.load("teddy", {"views": "2+4+6"}, site)
    assert whole.truth_digest != some.truth_digest, "truth is rescaled"
    for name, mask in whole.regions.items():
        np.testing.assert_array_equal(mask, some.regions[name])
    # the partner of the right view is to its left: there the other edge of the frame is hidden
    right = MIDDLEBURY_2003.load("teddy", {"ref": "6"}, site)
    assert whole.regions["occ"][5, 0]
    assert not whole.regions["occ"][5, -1]
    assert right.regions["occ"][5, -1]
    assert not right.regions["occ"][5, 0]


def test_views_are_chosen_by_their_number_with_everything_else_the_same(site: Path) -> None:
    whole = MIDDLEBURY_2003.load("teddy", {}, site)
    for options, labels, step in (
        ({"views": "2"}, "2 8", 6),
        ({"views": "3"}, "2 5 8", 3),
        ({"views": "5"}, "0 2 4 6 8", 2),
        ({"views": "3", "baseline": "4"}, "0 2 4", 2),
        ({"baseline": "2"}, "1 2 3", 1),
    ):
        some = MIDDLEBURY_2003.load("teddy", options, site)
        assert (" ".join(some.labels), some.labels[some.ref]) == (labels, "2")
        assert some.pair_steps * step == whole.pair_steps
        assert some.disparities.largest * some.pair_steps == pytest.approx(59)
        np.testing.assert_allclose(some.truth[some.ref], whole.truth[whole.ref] * step)
        for name, mask in whole.regions.items():
            np.testing.assert_array_equal(mask, some.regions[name])
    with pytest.raises(NotInScene):
        MIDDLEBURY_2006.load("Aloe", {"views": "9"}, site)


def test_the_range_to_search_may_be_given(site: Path) -> None:
    whole, wide = (MIDDLEBURY_2003.load("teddy", o, site) for o in ({}, {"disparities": "0:80"}))
    assert (wide.disparities.least, wide.disparities.largest) == (0, 20)
    assert wide.name == "middlebury2003/teddy[disparities=0:80]"
    assert (wide.digest != whole.digest, wide.truth_digest) == (True, whole.truth_digest)
    some = MIDDLEBURY_2003.load("teddy", {"disparities": "0:80", "views": "5"}, site)
    assert some.disparities.largest * some.pair_steps == 80


def test_the_other_view_with_truth_is_scored_if_only_it_is_chosen(site: Path) -> None:
    scene = MIDDLEBURY_2003.load("teddy", {"views": "4:9:2"}, site)
    assert scene.labels[scene.ref] == "6"


def test_views_that_are_not_chosen_need_not_be_there(site: Path) -> None:
    (site / "middlebury/scenes2003/newdata/teddy/im7.png").unlink()
    assert MIDDLEBURY_2003.load("teddy", {"views": "2+6"}, site).n == 2
    _refused(MIDDLEBURY_2003, "teddy", site, "im7", "missing")


def test_wrong_options_list_what_is_possible(site: Path) -> None:
    refused = [
        ({"colour": "red"}, ["unknown option", "'colour'", "ref, size, views"]),
        ({"size": "third"}, ["unknown size", "'third'", "half, quarter"]),
        ({"views": "0:9:4"}, ["none of the views 0, 4, 8"]),
        ({"views": "0:1"}, ["at least two"]),
        ({"views": "0+1+3+6"}, ["evenly spaced"]),
        ({"views": "6+2"}, ["evenly spaced"]),
        ({"views": "col2+col3"}, ["unknown view", "'col2'"]),
        ({"ref": "4"}, ["no ground truth", "2, 6"]),
        ({"ref": "6", "views": "0:4:2"}, ["not among", "0, 2"]),
    ]
    for options, words in refused:
        _refused(MIDDLEBURY_2003, "teddy", site, *words, **options)


@pytest.mark.parametrize("name", ["nobody", "../teddy", "half/teddy", "", ".", "teddy/../teddy", "Teddy"])
def test_unknown_scenes_are_never_looked_for(site: Path, name: str) -> None:
    _refused(MIDDLEBURY_2003, name, site, "unknown scene", "cones, teddy")


def test_known_but_absent_scenes_say_where_and_what_there_is(site: Path) -> None:
    _refused(MIDDLEBURY_2003, "cones", site, "middlebury2003/cones", str(site), "present: teddy")
    _refused(MIDDLEBURY_2003, "cones", None, "middlebury2003/cones", "--data", "MATBENCH_DATA")
    _refused(MIDDLEBURY_2005, "Art", site, "size full", "present: size half", size="full")
    _refused(MIDDLEBURY_2005, "Art", site, "matbench fetch 'middlebury2005/Art[size=full]' brings it", size="full")
    _refused(MIDDLEBURY_2003, "cones", site, "matbench fetch middlebury2003/cones brings it")
    _refused(MIDDLEBURY_2005, "Drumsticks", site, "no file of it is known")
    for name in ("disp1.png", "disp5.png"):
        (site / "middlebury/scenes2005/HalfSize/Art" / name).unlink()
    _refused(MIDDLEBURY_2005, "Art", site, "middlebury2005/Art", "no ground truth")


def test_a_scene_whose_truth_was_never_published_is_views_only(site: Path) -> None:
    scene = MIDDLEBURY_2005.load("Computer", {}, site)
    assert (scene.n, scene.labels[scene.ref], scene.pair_steps) == (7, "1", 4)
    assert (dict(scene.truth), dict(scene.regions)) == ({}, {})
    assert scene.disparities.largest == 240 / 4, "as far as any scene of its year and size"
    assert MIDDLEBURY_2005.load("Computer", {"views": "2:7:2", "ref": "4"}, site).labels == ("2", "4", "6")


def test_a_scene_that_only_the_folder_knows(site: Path) -> None:
    scene = MIDDLEBURY_2005.load("My_own", {}, site)
    assert scene.labels[scene.ref] == "5"
    assert scene.regions["occ"][5, -1], "its partner is to the left"
    assert scene.disparities.largest == 64 / 4, "50 px of the pair, rounded up to a multiple of 16"


def test_damaged_files_are_named(site: Path) -> None:
    folder = site / "middlebury/scenes2006/ThirdSize/Aloe"
    small = np.zeros((HEIGHT, WIDTH - 1, 3), np.uint8)
    for name in ("view3.png", "disp5.png"):
        kept = (folder / name).read_bytes()
        _write(folder / name, small)
        _refused(MIDDLEBURY_2006, "Aloe", site, name, f"{WIDTH - 1}x{HEIGHT}", f"{WIDTH}x{HEIGHT}")
        (folder / name).write_bytes(kept[:-20])
        _refused(MIDDLEBURY_2006, "Aloe", site, name, "truncated")
        (folder / name).write_bytes(kept)
    _write(folder / "disp1.png", np.zeros((HEIGHT, WIDTH), np.uint8))
    _refused(MIDDLEBURY_2006, "Aloe", site, "disp1.png", "unknown everywhere")


def test_listings_know_what_is_absent(site: Path) -> None:
    absent = {listing.name: listing for listing in MIDDLEBURY_2003.listings(None)}
    assert not any(listing.present for listing in absent.values())
    assert absent["teddy"].sizes == {"quarter": (450, 375), "half": (900, 750)}
    here = {listing.name: listing for listing in MIDDLEBURY_2005.listings(site)}
    assert here["Art"].present
    assert here["Computer"].present
    assert not here["Computer"].truth
    assert here["Art"].truth
    assert here["Art"].complete == {"half"}
    assert here["Drumsticks"].sizes == {}
    assert not here["Drumsticks"].present
    assert here["My_own"].sizes == {"half": (WIDTH, HEIGHT)}
    assert not here["Moebius"].present
    (site / "middlebury/scenes2003/newdata/teddy/im7.png").unlink()
    assert not any(listing.present for listing in MIDDLEBURY_2003.listings(site))


def test_every_real_scene_that_is_listed_as_present_loads(data_root: Path) -> None:
    """In its default size: what a listing promises is what is loaded."""
    datasets = MIDDLEBURY_2001, MIDDLEBURY_2003, MIDDLEBURY_2006
    present = [(one, listing) for one in datasets for listing in one.listings(data_root) if listing.present]
    if not present:
        pytest.skip("no scenes of Middlebury among the real scenes")
    for dataset, listing in present:
        scene = dataset.load(listing.name, {}, data_root)
        assert (scene.width, scene.height) == next(iter(listing.sizes.values()))
        assert scene.n == listing.views
        for truth in scene.truth.values():
            assert scene.disparities.least <= np.nanmin(truth)
            assert np.nanmax(truth) <= scene.disparities.largest


def test_facts_of_real_scenes(real: Real) -> None:
    root = real("middlebury2006/Rocks1[size=third]", "middlebury2001/tsukuba", "middlebury2001/venus")
    rocks = MIDDLEBURY_2006.load("Rocks1", {"size": "third"}, root)
    assert rocks.disparities.largest == 16
    assert rocks.truth[1][np.isfinite(rocks.truth[1])].min() == pytest.approx(4.833, abs=1e-3)
    assert np.isfinite(MIDDLEBURY_2001.load("tsukuba", {}, root).truth[2]).mean() == pytest.approx(0.793, abs=1e-3)
    assert np.isfinite(MIDDLEBURY_2001.load("venus", {}, root).truth[2]).all()
