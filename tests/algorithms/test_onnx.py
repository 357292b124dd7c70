"""Networks in ONNX files: whatever form they have, their answer is that of a walk over blocks."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from neighbours import random_scene
from onnx_models import block_matcher, slow
from tools import need

import matbench
from matbench.algorithm import Context
from matbench.algorithms import onnx
from matbench.algorithms.onnx import Onnx, plane_of
from matbench.comparison import prepare
from matbench.errors import UserError
from matbench.parameters import build, refuse_silent
from matbench.scene import Scene
from matbench.solving import check_scenes

LARGEST = 5.0


@pytest.fixture(autouse=True)
def _needs() -> None:
    need("onnx")


def scene(n: int = 3, ref: int = 0, height: int = 11, width: int = 37, least: float = 0.0) -> Scene:
    """Noise that shifts by 3 px a view step in its upper half, and by 1 in its lower one."""
    rng, steps = np.random.default_rng(0), {0: 3, height // 2: 1}
    wide = rng.integers(0, 256, (height, width + 60, 3), np.uint8)
    views = np.zeros((n, height, width, 3), np.uint8)
    for view in range(n):
        for top, step in steps.items():
            begin = 30 + step * view
            views[view, top:] = wide[top:, begin : begin + width]
    return Scene("noise", views, tuple(map(str, range(n))), ref, matbench.Range(least, LARGEST), {}, 1.0)


def answer(left: np.ndarray, right: np.ndarray, multiple: int = 32) -> np.ndarray:
    """(H, W) what the network says of two (channels, H, W) images whose edges are repeated up to a multiple."""
    _, height, width = left.shape
    sides = (0, 0), (0, -height % multiple), (0, -width % multiple)
    return slow(*(np.pad(image, sides, mode="edge") for image in (left, right)))[:height, :width]


def expected(of: Scene, other: int, multiple: int = 32) -> np.ndarray:
    """(H, W) px per view step."""
    flip, gap = (-1 if other < of.ref else 1), abs(of.steps(other))
    left, right = (np.moveaxis(of.views[view][:, ::flip], 2, 0) for view in (of.ref, other))
    return np.clip(answer(left, right, multiple)[:, ::flip] / gap, of.disparities.least, of.disparities.largest)


def solved(model: Path, of: Scene, **options: Any) -> np.ndarray:
    made = build("onnx", Onnx, {"model": str(model), **options})
    return np.asarray(made.solve(of, Context()).disparity[of.ref])


@pytest.mark.parametrize(
    ("form", "options"),
    [
        ({}, {}),
        ({}, {"pad": 1}),
        ({"kind": "UINT8"}, {}),
        ({"kind": "FLOAT16"}, {}),
        ({"channels_last": True}, {}),
        ({"channels_last": True, "size": (None, None)}, {"layout": "nhwc"}),
        ({"joined": 1}, {}),
        ({"joined": 1, "channels_last": True}, {}),
        ({"joined": 0}, {}),
        ({"negative": True}, {"sign": -1}),
        ({"size": (11, 37)}, {"fit": "pad"}),
        ({"size": (11, 37)}, {}),
        ({"size": (11, "width")}, {}),
        ({"names": ("b", "a")}, {"left": "b", "right": "a"}),
        ({"outputs": 2}, {"output": "disparity1"}),
        ({"size": (11, 37), "beside": "gain.bin"}, {}),
    ],
    ids=str,
)
def test_a_model_of_any_form_answers_as_its_slow_twin(
    form: dict[str, Any], options: dict[str, Any], tmp_path: Path
) -> None:
    model, of = block_matcher(tmp_path / "net.onnx", **form), scene()
    multiple = 1 if "size" in form else options.get("pad", 32)
    if form.get("size") == (11, "width"):
        of = scene(width=64)
    np.testing.assert_array_equal(solved(model, of, **options), expected(of, 1, multiple))


def test_names_tell_which_image_is_the_right_one(tmp_path: Path) -> None:
    model, of = block_matcher(tmp_path / "net.onnx", names=("image_right", "other")), scene()
    by_names = solved(model, of)
    turned = solved(model, of, left="other", right="image_right")
    np.testing.assert_array_equal(by_names, turned)
    assert (by_names != solved(model, of, left="image_right", right="other")).any()


def test_the_pixels_that_are_given_are_those_that_were_asked_for(tmp_path: Path) -> None:
    of = scene()
    grey = block_matcher(tmp_path / "grey.onnx", colours=1)
    with pytest.raises(UserError, match=r"3 channels do not fit: colours=grey; its inputs are left \(1x1x\?x\?\)"):
        solved(grey, of)
    luma = [np.tensordot([0.299, 0.587, 0.114], np.moveaxis(of.views[v], 2, 0), 1)[None] for v in (0, 1)]
    assert np.mean(solved(grey, of, colours="grey") == np.clip(answer(*luma), 0, LARGEST)) > 0.999
    colour = block_matcher(tmp_path / "net.onnx")
    base = expected(of, 1)
    # block matching does not see these, up to rounding, and sees weights of the channels
    for options in ({"colours": "bgr"}, {"scale": 1.0}, {"mean": "12"}, {"mean": "1/2/3"}):
        assert np.mean(solved(colour, of, **options) == base) > 0.999
    weighted = [np.moveaxis(of.views[v], 2, 0) / np.array([1, 50, 0.1])[:, None, None] for v in (0, 1)]
    found = solved(colour, of, std="1/50/0.1")
    assert np.mean(found == np.clip(answer(*weighted), 0, LARGEST)) > 0.999
    assert (found != solved(colour, of, std="1/50/0.1", colours="bgr")).any()


def test_a_frame_of_another_size_scales_disparities_back(tmp_path: Path) -> None:
    of = scene(height=24, width=40)
    twice = solved(block_matcher(tmp_path / "net.onnx", size=(48, 80)), of)
    # of a picture twice as large: 6 px and 2 px, halved
    for rows, step in ((slice(3, 9), 3), (slice(15, 21), 1)):
        assert np.mean(np.abs(twice[rows, 6:] - step) <= 0.25) > 0.9
    with pytest.raises(UserError, match=r"takes 32x16 px, images are 40x24: fit=resize makes them smaller"):
        solved(block_matcher(tmp_path / "small.onnx", size=(16, 32)), of, fit="pad")


def test_the_other_view_may_be_on_either_side(tmp_path: Path) -> None:
    model = block_matcher(tmp_path / "net.onnx")
    for ref, other in ((0, 1), (2, 1)):
        of = scene(ref=ref)
        np.testing.assert_array_equal(solved(model, of), expected(of, other))
    negative = random_scene(2, 9, 30, -4, 3)
    found = solved(model, negative)
    left, right = (np.moveaxis(image, 2, 0) for image in negative.views)
    pads = ((0, 0), (0, 0), (4, 0)), ((0, 0), (0, 0), (0, 4))
    wide = [np.pad(image, pad, mode="edge") for image, pad in zip((left, right), pads, strict=True)]
    if negative.ref == 1:
        wide = [np.pad(image[:, :, ::-1], pad, mode="edge") for image, pad in zip((right, left), pads, strict=True)]
    values = np.clip(answer(*wide)[:, 4:] - 4, -4, 3)
    np.testing.assert_array_equal(found, values[:, ::-1] if negative.ref == 1 else values)


def test_all_pairs_are_fused_by_their_weighted_median(tmp_path: Path) -> None:
    model, of = block_matcher(tmp_path / "net.onnx"), scene(4, 1)
    maps = np.stack([expected(of, other) for other in (0, 2, 3)])
    found = solved(model, of, views="all")
    for y, x in np.ndindex(found.shape):
        ranked = sorted(zip(maps[:, y, x], (1, 1, 2), strict=True))
        total, values = 0, []
        for value, weight in ranked:
            total += weight
            values.append((value, total))
        assert found[y, x] == np.float32(next(value for value, sofar in values if sofar >= 2))
    work = build("onnx", Onnx, {"model": str(model), "views": "all"}).solve(of, Context()).work
    assert work == {"pairs": 3}


@pytest.mark.parametrize(
    "shape", [(4, 6), (1, 4, 6), (1, 1, 4, 6), (1, 2, 4, 6), (1, 4, 6, 1), (2, 1, 4, 6), (3, 4, 6)]
)
def test_a_map_is_found_in_an_output_of_any_shape(shape: tuple[int, ...]) -> None:
    values = np.arange(np.prod(shape)).reshape(shape)
    found = plane_of(values, (4, 6))
    assert found is not None
    np.testing.assert_array_equal(found, np.arange(24).reshape(4, 6))


@pytest.mark.parametrize("shape", [(), (24,), (6, 4), (64, 4, 6), (3, 2, 2, 4, 6)])
def test_what_is_no_map_is_none(shape: tuple[int, ...]) -> None:
    assert plane_of(np.zeros(shape), (4, 6)) is None
    assert plane_of(np.zeros((4, 6), bool), (4, 6)) is None


def made(tmp_path: Path, **form: Any) -> Path:
    return block_matcher(tmp_path / "net.onnx", **form)


@pytest.mark.parametrize(
    ("form", "options", "words"),
    [
        ({}, {"left": "images", "right": "right"}, "no input 'images'; its inputs are left"),
        ({}, {"left": "left"}, "name both; its inputs are left"),
        ({}, {"output": "depth"}, "has no output 'depth'; its outputs are disparity"),
        ({}, {"colours": "grey"}, r"1 channels do not fit: colours=rgb; its inputs are left \(1x3x\?x\?\)"),
        ({"outputs": 2}, {}, r"2 outputs could be the map of 64x32 px; choose one by output=NAME: disparity \(1x1x"),
        ({"size": (200_000, 200_000)}, {}, "takes more pixels than 64000000; its inputs are"),
        ({"kind": "INT64"}, {}, "no numbers of one known type"),
        ({"beside": "../gain.bin"}, {}, "its weights lie outside its folder, in '../gain.bin'"),
        ({"beside": "/gain.bin"}, {}, "its weights lie outside its folder, in '/gain.bin'"),
        ({}, {"mean": "a"}, "mean is 'a'; it must be one number"),
        ({}, {"std": "0"}, "std is '0'; it must be one number above 0"),
        ({"size": (16, 64)}, {"pad": 8}, "pad=8 changes nothing here: it takes a model that takes any size"),
    ],
)
def test_what_does_not_fit_is_one_line(
    form: dict[str, Any], options: dict[str, Any], words: str, tmp_path: Path
) -> None:
    model = made(tmp_path, **form)

    def whole() -> None:
        instance = build("onnx", Onnx, {"model": str(model), **options})
        refuse_silent("onnx", instance, options)
        instance.solve(scene(), Context())

    with pytest.raises(UserError, match=words) as told:
        whole()
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("spoilt", ["junk", "half", "empty", "text", "folder", "missing", "operator", "beside"])
def test_a_damaged_model_is_one_line(spoilt: str, tmp_path: Path) -> None:
    model = made(tmp_path, **({"beside": "gain.bin"} if spoilt == "beside" else {}))
    data = model.read_bytes()
    if spoilt == "operator":
        model.write_bytes(data.replace(b"ArgMin", b"ArgMix"))
    elif spoilt == "beside":
        (tmp_path / "gain.bin").unlink()
    else:
        model.unlink()
        if spoilt == "folder":
            model.mkdir()
        elif spoilt != "missing":
            junk = np.random.default_rng(0).bytes(1024)
            model.write_bytes(
                {"junk": junk, "half": data[: len(data) // 2], "empty": b"", "text": b"weights\n"}[spoilt]
            )
    with pytest.raises(UserError, match=r"^(onnx: )?model .*net\.onnx") as told:
        build("onnx", Onnx, {"model": str(model)}).solve(scene(), Context())
    assert "\n" not in str(told.value)


def test_without_onnxruntime_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = made(tmp_path)
    monkeypatch.setattr(onnx, "find_spec", lambda name: None)
    with pytest.raises(UserError, match=r"onnxruntime, which is not installed: pip install 'matbench-stereo\[onnx\]'"):
        build("onnx", Onnx, {"model": str(model)})


def test_a_device_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    import onnxruntime

    if "CUDAExecutionProvider" in onnxruntime.get_available_providers():
        pytest.skip("there is one")
    with pytest.raises(UserError, match="device=cuda: onnxruntime has no CUDAExecutionProvider"):
        solved(made(tmp_path), scene(), device="cuda")


@pytest.mark.parametrize("changed", ["net.onnx", "gain.bin"])
def test_another_content_is_another_cell(changed: str, tmp_path: Path) -> None:
    model = made(tmp_path, beside="gain.bin")

    def key() -> str:
        ready = prepare([f"onnx[model='{model}']"], "synthetic/box[size=48x36]", out=tmp_path / "run", write=False)
        return ready.plan.cells[0].key

    before = key()
    assert key() == before
    place = tmp_path / changed
    if changed == "gain.bin":
        place.write_bytes(np.array(2, "<f4").tobytes())
    else:
        block_matcher(model, beside="gain.bin", gain=2.0, names=("left", "other"))
    assert key() != before


def test_it_stands_in_a_table_with_others(tmp_path: Path) -> None:
    model = made(tmp_path)
    results = matbench.compare([f"onnx[model='{model}']", "sgbm"], "synthetic/box[size=96x72]", out=tmp_path / "run")
    mine = results[(results["algorithm"] == "onnx") & (results["metric"] == "invalid")]
    assert set(mine["value"].dropna()) == {0}


def test_the_seed_and_the_threads_change_nothing(tmp_path: Path) -> None:
    instance = build("onnx", Onnx, {"model": str(made(tmp_path)), "views": "all"})
    easy = check_scenes.trials()["easy"].scene
    one, two = (instance.solve(easy, Context(seed, threads)) for seed, threads in ((0, 1), (3, 2)))
    np.testing.assert_array_equal(one.disparity[easy.ref], two.disparity[easy.ref])
