"""What was told is what is in the recording, entity by entity."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from recordings import OTHER, PASSES, ROW, Row, Teller, tensor

from matbench.measures.metrics import score
from matbench.recording import coloring
from matbench.recording.guide import ERROR_METRIC
from matbench.recording.perspective import Perspective
from matbench.regions import VIEW_REGIONS
from matbench.scene import Scene
from matbench.space import Volume, visibility


def picture(values: dict[str, Any], kind: str = "Image") -> np.ndarray:
    form = values[f"{kind}:format"]
    data = np.asarray(values[f"{kind}:buffer"], np.uint8)
    return data.reshape(form["height"], form["width"], -1)


def test_every_stream_is_there(rows: dict[str, list[Row]]) -> None:
    once = {"/about", "/truth/disparity", "/estimate/disparity", "/estimate/error", "/regions", "/regions/all"}
    once |= {f"/regions/{name}" for name in VIEW_REGIONS}
    once |= {"/regions/nonocc", "/surface", "/surface/points", "/space", "/space/materiality", "/views/im2/rows"}
    once |= {f"/slices/{row}/{kind}" for row in (ROW, OTHER) for kind in ("similarity", "visibility")}
    labels = ["im0", "im2", "im4", "im6"]
    once |= {f"/views/{label}" for label in labels}
    pairs = [f"{a}\\-{b}" for a, b in (("im0", "im2"), ("im2", "im4"), ("im4", "im6"))]
    kinds = ["materiality", *(f"visibility/{label}" for label in labels), *(f"similarity/{pair}" for pair in pairs)]
    once |= {f"/{stem}/{kind}" for stem in ("volumes", "haze") for kind in kinds}
    lines = {"/surface/planes", "/surface/rays", "/space/planes", "/space/rays", "/space/frustums"}
    once |= lines | {f"{line}/names" for line in lines}
    every = {"/energy/total", "/energy/data", "/passes/disparity", "/passes/error", "/error/all", "/error/nonocc"}
    every |= {f"/slices/{row}/{kind}" for row in (ROW, OTHER) for kind in ("materiality", "derivative")}
    cameras = {f"/surface/cameras/{label}" for label in labels}
    names = {entity.replace("\\", "") for entity in rows}
    expected = {e.replace("\\", "") for e in once | every | cameras}
    assert names - {"/__properties", "/__properties/matbench", "/energy/late"} == expected
    assert all(len(rows[e]) == 1 and rows[e][0][0] is None for e in rows if e in once)
    assert all([step for step, _ in rows[e]] == list(range(PASSES)) for e in every)
    assert [step for step, _ in rows["/energy/late"]] == [0, 1]


def test_energies_are_those_told(rows: dict[str, list[Row]]) -> None:
    assert [values["Scalars:scalars"] for _, values in rows["/energy/total"]] == [10.0 - p for p in range(PASSES)]


def test_similarity_slice_is_three_pairs(rows: dict[str, list[Row]], told: tuple[Scene, Teller]) -> None:
    slices = picture(rows[f"/slices/{ROW}/similarity"][0][1])
    planes = told[1].space.planes
    thick = slices.shape[0] // planes
    expected = np.stack([np.rint(255 * pair[ROW]) for pair in told[1].pairs], axis=2)
    assert np.array_equal(slices[::thick], expected[::-1])  # the farthest plane at the bottom
    assert np.array_equal(slices[thick - 1 :: thick], expected[::-1])


@pytest.mark.parametrize("row", [ROW, OTHER])
def test_slices_of_every_pass(rows: dict[str, list[Row]], told: tuple[Scene, Teller], row: int) -> None:
    for step in range(PASSES):
        material = picture(rows[f"/slices/{row}/materiality"][step][1])[:, :, 0]
        slopes = picture(rows[f"/slices/{row}/derivative"][step][1])
        thick = material.shape[0] // told[1].space.planes
        assert np.array_equal(material[::thick], np.rint(255 * told[1].states[step][row])[::-1])
        sign = told[1].slopes[step][row][::-1]
        assert np.array_equal(slopes[::thick] == 255, np.stack([sign < 0, sign < -1, sign > 0], axis=2))


def test_visibility_slice_is_three_views(rows: dict[str, list[Row]], told: tuple[Scene, Teller]) -> None:
    volume = Volume(told[1].space, told[1].states[-1], (0, 1, 2, 3))
    shown = picture(rows[f"/slices/{OTHER}/visibility"][0][1])
    thick = shown.shape[0] // volume.space.planes
    expected = np.stack([np.rint(255 * visibility(volume, view)[OTHER]) for view in (0, 2, 3)], axis=2)
    assert np.array_equal(shown[::thick], expected[::-1])
    assert "Visibility: red im0, green im4, blue im6" in rows["/about"][0][1]["TextDocument:text"]


def test_errors_of_every_pass(rows: dict[str, list[Row]], told: tuple[Scene, Teller]) -> None:
    scene, teller = told
    for region in ("all", "nonocc"):
        for step, values in rows[f"/error/{region}"]:
            expected = score(teller.maps[step], scene.truth[1], scene.regions[region], 2.0, [ERROR_METRIC])
            assert values["Scalars:scalars"] == pytest.approx(expected["total_bad_1"])
    shown = picture(rows["/passes/error"][2][1])
    assert np.array_equal(shown, coloring.error_colors(teller.maps[2], scene.truth[1], 2.0))


def test_volumes_are_bytes(rows: dict[str, list[Row]], told: tuple[Scene, Teller]) -> None:
    scene, teller = told
    volume = Volume(teller.space, teller.states[-1], tuple(range(scene.n)))
    raw = rows["/volumes/materiality"][0][1]["Tensor:data"]
    assert raw["names"] == ["row", "plane", "column"]
    assert np.array_equal(tensor(rows["/volumes/materiality"][0][1]), np.rint(255 * volume.values))
    seen = np.rint(255 * visibility(volume, 2))
    assert np.array_equal(tensor(rows["/volumes/visibility/im4"][0][1]), seen)
    similar = next(rows[e] for e in rows if e.replace("\\", "") == "/volumes/similarity/im0-im2")
    assert np.array_equal(tensor(similar[0][1]), np.rint(255 * teller.pairs[0]))


def test_volumes_have_the_type_uint8(path: Path) -> None:
    kinds = []
    for chunk in rr.chunk.RrdReader(path).stream():
        if str(chunk.entity_path).startswith("/volumes/"):
            buffer = chunk.to_record_batch().column("Tensor:data")[0].values.field("buffer")
            kinds += [buffer.type.field(code).name for code in buffer.type_codes.to_pylist()]
    assert kinds == ["U8"] * 8, "three pairs, four views, materiality"


def test_maps_have_the_colours_of_their_numbers(rows: dict[str, list[Row]], told: tuple[Scene, Teller]) -> None:
    scene, teller = told
    truth, ends = scene.truth[1], coloring.disparity_ends(scene)
    assert ends == (2, 6)
    shown = picture(rows["/estimate/disparity"][0][1])
    assert np.array_equal(shown, coloring.disparity_colors(teller.answer, ends))
    assert set(np.unique(shown[3:6, :5])) <= {196, 250}  # no answer: stripes
    true = picture(rows["/truth/disparity"][0][1])
    assert (true[0] == 128).all()
    assert (true[1:][truth[1:] == 2] == (68, 1, 84)).all()
    assert (true[1:][truth[1:] == 6] == (253, 231, 37)).all()
    error = picture(rows["/estimate/error"][0][1])
    wrong = 2 * np.abs(teller.answer - truth)
    assert (error[0] == 128).all()
    assert (error[wrong >= 4] == (252, 253, 191)).all()
    assert np.array_equal(picture(rows["/passes/disparity"][3][1]), coloring.disparity_colors(teller.maps[3], ends))
    mask = picture(rows["/regions/nonocc"][0][1], "SegmentationImage")[:, :, 0]
    assert np.array_equal(mask == 1, scene.regions["nonocc"])
    assert np.array_equal(picture(rows["/views/im6"][0][1]), scene.views[3])


def test_surface_has_a_point_for_every_answer(path: Path, told: tuple[Scene, Teller]) -> None:
    scene, teller = told
    for chunk in rr.chunk.RrdReader(path).stream():
        if str(chunk.entity_path) == "/surface/points":
            batch = chunk.to_record_batch()
            points = np.array(batch.column("Points3D:positions")[0].as_py())
            colors = np.array(batch.column("Points3D:colors")[0].as_py())
    known = np.isfinite(teller.answer)
    assert len(points) == known.sum() == len(colors)
    assert np.array_equal(colors >> 24, scene.views[1][known][:, 0])
    perspective = Perspective.of(scene)
    assert perspective.is_true, "the truth's disparities, 2 to 6, can be drawn as they are"
    assert np.allclose(points[:, 2], 6 / np.maximum(teller.answer[known], 1), rtol=1e-5)
