"""The registry of Middlebury from a manifest."""

import json

import pytest
from real import Real
from registered import SCENES

from matbench.datasets import make_registry
from matbench.datasets.registry import REGISTRY, YEARS
from matbench.errors import UserError


def test_the_file_is_as_its_script_writes_it() -> None:
    assert make_registry.text(json.loads(REGISTRY.read_text())) == REGISTRY.read_text()


def test_it_says_what_the_manifest_says(real: Real) -> None:
    manifest = json.loads((real("manifest.json") / "manifest.json").read_text())
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
