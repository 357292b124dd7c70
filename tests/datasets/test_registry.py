"""The registry of Middlebury's files: whole, consistent, and true of the real files."""

import re
from math import ceil
from pathlib import Path

import numpy as np
import pytest
from real import Real
from registered import KNOWN, SCENES

from matbench.datasets.middlebury import Middlebury
from matbench.datasets.stored import ROUND_UP, image_file
from matbench.files.images import pixel_digests, read_size

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


@pytest.mark.parametrize(("year", "name", "size", "facts"), SCENES, ids=IDS)
def test_real_scenes_are_as_it_says(real: Real, year, name, size, facts) -> None:
    """Digests of every file, sizes, truths, and the range derived from the truth itself."""
    dataset, root = Middlebury(year), real(f"middlebury{year}/{name}[size={size}]")
    folder = dataset._folder(root, name, size)
    files = {image_file(folder, Path(file).stem): pixels for file, (_, _, pixels) in facts.files.items()}
    for file, pixels in files.items():
        assert pixels in pixel_digests(file)
    sizes = {read_size(file) for file in files}
    assert len(sizes) == 1
    assert facts.size in (None, *sizes), "null: not known before the files are there"
    scene = dataset.load(name, {"size": size}, root)
    assert {(scene.width, scene.height)} == sizes
    assert [int(re.sub(r"\D", "", scene.labels[view])) for view in scene.truth] == list(facts.truth)
    assert scene.disparities.largest * scene.pair_steps == pytest.approx(facts.largest)
    if year in ("2005", "2006") and facts.truth:
        nearest = max(float(np.nanmax(truth)) for truth in scene.truth.values()) * scene.pair_steps
        assert facts.largest == ceil(nearest / ROUND_UP) * ROUND_UP
