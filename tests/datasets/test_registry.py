"""The registry of Middlebury's files: whole, consistent, and true of the real files."""

import json
import re
from math import ceil
from pathlib import Path

import numpy as np
import pytest

from matbench.datasets import make_registry
from matbench.datasets.middlebury import Middlebury
from matbench.datasets.registry import REGISTRY, YEARS, registry
from matbench.datasets.stored import ROUND_UP
from matbench.errors import UserError
from matbench.files.images import pixel_digests, read_size

KNOWN = {year: registry(year) for year in YEARS}
SCENES = [
    (year, name, size, facts)
    for year, known in KNOWN.items()
    for name, sizes in known.scenes.items()
    for size, facts in sizes.items()
]
IDS = [f"{year}-{name}-{size}" for year, name, size, _ in SCENES]


def test_it_knows_every_scene_of_the_four_sets() -> None:
    assert {year: len(known.scenes) for year, known in KNOWN.items()} == {"2001": 7, "2003": 2, "2005": 9, "2006": 21}
    assert {size for sizes in KNOWN["2003"].scenes.values() for size in sizes} == {"quarter", "half"}
    assert all(list(sizes) == ["third", "half"] for sizes in KNOWN["2006"].scenes.values())
    without = {name for year, name, _, facts in SCENES if not facts.truth}
    assert without == {"Computer", "Dwarves"}
    assert KNOWN["2005"].scenes["Drumsticks"] == {}


@pytest.mark.parametrize(("year", "name", "size", "facts"), SCENES, ids=IDS)
def test_each_scene_has_a_file_for_every_view_and_truth(year, name, size, facts) -> None:
    layout = Middlebury(year)._layout(name, size)
    stems = [layout.view.format(k) for k in layout.numbers] + [layout.truth.format(k) for k in facts.truth]
    assert sorted(stems) == sorted(Path(file).stem for file in facts.files)
    assert set(facts.truth) <= set(layout.with_truth)
    for file, (count, sha256, pixels) in facts.files.items():
        assert re.fullmatch(r"[A-Za-z0-9.]+\.(png|ppm|pgm)", file)
        assert 0 < count < 5_000_000
        assert re.fullmatch(r"[0-9a-f]{64} [0-9a-f]{64}", f"{sha256} {pixels}")
    assert facts.largest % ROUND_UP == 0 or facts.largest == layout.largest


def test_the_file_is_as_its_script_writes_it() -> None:
    assert make_registry.text(json.loads(REGISTRY.read_text())) == REGISTRY.read_text()


def test_it_says_what_the_manifest_says(data_root: Path) -> None:
    manifest = json.loads((data_root / "manifest.json").read_text())
    written = json.loads(REGISTRY.read_text())
    for year in YEARS:
        assert make_registry.scenes(year, manifest) == written[year]["scenes"]
    of_scenes = {name for name in manifest if not name.startswith("middlebury/eval_v2/")}
    assert len(of_scenes) == len(SCENES), "every scene and size of the manifest is known"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"gt_grey_per_px": 4}, "in the layout"),
        ({"unknown": 0}, "in the layout"),
        ({"views": 8}, "in the layout"),
        (None, "no file of view 3"),
    ],
)
def test_a_manifest_that_contradicts_the_layouts_is_refused(change, said: str) -> None:
    facts = {"views": 9, "gt_grey_per_px": 8, "gt_steps": 4, "unknown": None, "gt": {"disp2.pgm": 1, "disp6.pgm": 1}}
    facts |= {"size": [4, 3], "unit_disparity_px": {"2": [1, 2]}} | (change or {})
    names = [*(f"im{k}.ppm" for k in range(9) if change or k != 3), "disp2.pgm", "disp6.pgm"]
    files = {name: {"bytes": 1, "sha256": "0" * 64, "pixels": "0" * 64} for name in names}
    with pytest.raises(UserError, match=said):
        make_registry.scenes("2001", {"middlebury/scenes2001/data/new": {"facts": facts, "files": files}})


@pytest.mark.parametrize(("year", "name", "size", "facts"), SCENES, ids=IDS)
def test_real_scenes_are_as_it_says(data_root: Path, year, name, size, facts) -> None:
    """Digests of every file, sizes, truths, and the range derived from the truth itself."""
    dataset = Middlebury(year)
    folder = dataset._folder(data_root, name, size)
    if not folder.is_dir():
        pytest.skip(f"{folder} is not there")
    for file, (_, _, pixels) in facts.files.items():
        assert pixels in pixel_digests(folder / file)
        assert read_size(folder / file) == facts.size
    scene = dataset.load(name, {"size": size}, data_root)
    assert [int(re.sub(r"\D", "", scene.labels[view])) for view in scene.truth] == list(facts.truth)
    assert scene.disparities.largest * scene.pair_steps == pytest.approx(facts.largest)
    if year in ("2005", "2006"):
        nearest = max(float(np.nanmax(truth)) for truth in scene.truth.values()) * scene.pair_steps
        assert facts.largest == ceil(nearest / ROUND_UP) * ROUND_UP
