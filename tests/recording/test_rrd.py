"""Recordings, read back: what was told is what is in the file, and no half-written file is left."""

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from attrs import evolve

from matbench.algorithm import Context, Estimate, Probe
from matbench.measures.metrics import score
from matbench.plans.record_option import RecordOption
from matbench.recording import coloring, reduction, rrd, space_diagram
from matbench.recording.guide import ERROR_METRIC
from matbench.recording.perspective import DEEPEST, Perspective
from matbench.recording.probe import CapturingProbe
from matbench.recording.rrd import RecordingError, record, record_scene
from matbench.regions import VIEW_REGIONS
from matbench.scene import Range, Scene
from matbench.space import DisparitySpace, Volume, visibility

ROW, OTHER, PASSES = 9, 14, 7


def make_scene(n: int = 4, height: int = 20, width: int = 30, least: float = 0, largest: float = 7) -> Scene:
    random = np.random.default_rng(0)
    views = random.integers(0, 256, (n, height, width, 3), dtype=np.uint8)
    truth = np.full((height, width), least + 2, np.float32)
    truth[5:12, 10:20] = largest - 1
    truth[0] = np.nan
    known = np.isfinite(truth)
    regions = {"all": known, "nonocc": known & (truth < largest - 1)}
    labels = tuple(f"im{2 * i}" for i in range(n))
    return Scene("toy/box", views, labels, 1, Range(least, largest), {1: truth}, 2.0, regions)


class Teller:
    """A method that makes everything up and tells all of it; it reuses its arrays, as methods may."""

    def __init__(self, scene: Scene, passes: int = PASSES) -> None:
        self.space = DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width)
        self.passes, random = passes, np.random.default_rng(1)
        self.pairs = [random.random(self.space.shape, np.float32) for _ in range(scene.n - 1)]
        self.states = [random.random(self.space.shape, np.float32) for _ in range(passes)]
        self.slopes = [random.integers(-1, 2, self.space.shape).astype(np.float32) for _ in range(passes)]
        shape = (scene.height, scene.width)
        self.maps = [random.uniform(0, 7, shape).astype(np.float32) for _ in range(passes)]
        self.answer = random.uniform(0, 7, shape).astype(np.float32)
        self.answer[3:6, :5] = np.nan

    def solve(self, scene: Scene, context: Context) -> Estimate:
        views, probe = tuple(range(scene.n)), context.probe
        reused = np.empty(self.space.shape, np.float32)
        for i, pair in enumerate(self.pairs):
            reused[:] = pair
            probe.volume(f"similarity/{i}-{i + 1}", Volume(self.space, reused, views))
        for step in range(self.passes):
            reused[:] = self.states[step]
            energies = {"total": 10.0 - step, "data": 9.0 - step}
            slopes = Volume(self.space, self.slopes[step], views)
            probe.iteration(step, energies, Volume(self.space, reused, views), slopes, self.maps[step])
        volume = Volume(self.space, self.states[-1], views)
        return Estimate({scene.ref: self.answer}, volume, {"total": [0.0], "late": [3.0, 2.0]})


Row = tuple[int | None, dict[str, Any]]


def read(path: Path) -> dict[str, list[Row]]:
    """Entity -> (iteration or None, component -> value) in order."""
    found: dict[str, list[Row]] = {}
    for chunk in rr.chunk.RrdReader(path).stream():
        assert set(chunk.timeline_names) <= {"iteration"}
        for row in chunk.to_record_batch().to_pylist():
            values = {name: value[0] if isinstance(value, list) and value else value for name, value in row.items()}
            step = values.get("iteration")
            found.setdefault(str(chunk.entity_path), []).append((step, values))
    return {entity: sorted(rows, key=lambda row: -1 if row[0] is None else row[0]) for entity, rows in found.items()}


def picture(values: dict[str, Any], kind: str = "Image") -> np.ndarray:
    form = values[f"{kind}:format"]
    data = np.asarray(values[f"{kind}:buffer"], np.uint8)
    return data.reshape(form["height"], form["width"], -1)


def strips_of(path: Path, entity: str) -> np.ndarray:
    """(strips, points, 3) of lines that have as many points each."""
    (chunk,) = (chunk for chunk in rr.chunk.RrdReader(path).stream() if str(chunk.entity_path) == entity)
    return np.array(chunk.to_record_batch().column("LineStrips3D:strips")[0].as_py(), np.float64)


def tensor(values: dict[str, Any]) -> np.ndarray:
    data = values["Tensor:data"]
    inner = data["buffer"]
    return np.asarray(inner, np.uint8).reshape(data["shape"])


@pytest.fixture(scope="module")
def told() -> tuple[Scene, Teller]:
    scene = make_scene()
    return scene, Teller(scene)


@pytest.fixture(scope="module")
def path(told: tuple[Scene, Teller], tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene, teller = told
    path = tmp_path_factory.mktemp("cell") / "rrd.rrd"
    estimate = record(
        path,
        scene,
        lambda probe: teller.solve(scene, Context(probe=probe)),
        title="t on s/x",
        wanted=RecordOption(rows=(ROW, OTHER)),
    )
    assert estimate.disparity[1] is teller.answer
    return path


@pytest.fixture(scope="module")
def rows(path: Path) -> dict[str, list[Row]]:
    return read(path)


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


@pytest.mark.parametrize("has_truth", [True, False])
def test_a_scene_alone_is_its_views_truth_and_regions(tmp_path: Path, has_truth: bool) -> None:
    scene = make_scene() if has_truth else evolve(make_scene(), truth={}, regions={})
    record_scene(tmp_path / "scene.rrd", scene)
    rows = read(tmp_path / "scene.rrd")
    names = {entity for entity in rows if not entity.startswith(("/__", "/surface/cameras"))}
    expected = {"/about", *(f"/views/{label}" for label in scene.labels), f"/views/{scene.labels[scene.ref]}/rows"}
    if has_truth:
        expected |= {"/truth/disparity", "/regions", *(f"/regions/{name}" for name in scene.scored_regions)}
        expected |= {"/surface", "/surface/points"}
        expected |= {f"/surface/{line}{names}" for line in ("planes", "rays") for names in ("", "/names")}
        points = rows["/surface/points"][0][1]["Points3D:positions"]
        assert len(rows["/surface/points"]) == 1
        assert points is not None
    assert names == expected
    assert list(tmp_path.iterdir()) == [tmp_path / "scene.rrd"]


def test_one_recording_with_its_blueprint(path: Path) -> None:
    reader = rr.chunk.RrdReader(path)
    assert (len(reader.recordings()), len(reader.blueprints())) == (1, 1)
    assert list(path.parent.iterdir()) == [path]


def test_rerun_verifies_it(path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "rerun_cli", "rrd", "verify", str(path)], capture_output=True, text=True, check=True
    )
    assert "1 file verified without error" in done.stdout + done.stderr
    assert "WARN" not in done.stderr


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


def test_volumes_in_space_are_those_of_the_sliders(rows: dict[str, list[Row]]) -> None:
    for name in [entity for entity in rows if entity.startswith("/volumes/")]:
        bytes_ = tensor(rows[name][0][1])
        field = rows[name.replace("/volumes/", "/haze/")][0][1]
        data = field["Volume3D:data"] if "Volume3D:data" in field else field["Volume3D:values"]
        shape, values = data["shape"], np.asarray(data["buffer"]).astype(np.float32)
        expected = bytes_.transpose(1, 0, 2)[::-1] / 255  # nearest plane first, rows, columns
        assert tuple(shape) == expected.shape
        assert np.allclose(values.reshape(shape), expected, atol=1e-3)
        through = field["Volume3D:optical_density"] * np.mean(expected ** field["Volume3D:gamma"])
        assert through == pytest.approx(space_diagram.THROUGH_ALL, rel=0.01), "full or nearly empty, it is seen"


def test_rays_meet_in_the_target_point(path: Path, told: tuple[Scene, Teller]) -> None:
    """Equation 1 drawn: the views' rays, straight in disparity space, cross in one point of the pixel's plane."""
    scene, teller = told
    strips = strips_of(path, "/space/rays")
    assert strips.shape == (scene.n, 2, 3)
    plane = round(float(teller.answer[ROW, 15])) - teller.space.first
    depth = (teller.space.planes - plane - 0.5) / teller.space.planes * scene.width / 2
    near, far = strips[:, 0], strips[:, 1]
    share = (depth - near[:, 2]) / (far[:, 2] - near[:, 2])
    columns = near[:, 0] + share * (far[:, 0] - near[:, 0])
    assert np.allclose(columns, 15 + (plane + teller.space.first) * scene.ref + 0.5, atol=1e-3)
    # in perspective they meet in the surface's point, whose depth is inverse to its disparity
    seen = strips_of(path, "/surface/rays")
    assert np.allclose(seen[:, 1], seen[0, 1], atol=1e-5)
    perspective = Perspective.of(scene)
    assert seen[0, 1, 2] == pytest.approx(perspective.depth(float(teller.answer[ROW, 15])), rel=1e-4)


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


@pytest.mark.parametrize(("least", "largest"), [(0, 7), (-5, 2), (-3, -3), (0, 0), (4, 9), (1, 60)])
def test_depths_are_positive_and_bounded(least: float, largest: float) -> None:
    scene = evolve(make_scene(least=least, largest=largest), truth={})
    disparity = np.linspace(least, largest, 600, dtype=np.float32).reshape(20, 30)
    perspective = Perspective.of(scene)
    points, _, radii = perspective.surface(disparity, 1000)
    assert points[:, 2].min() == pytest.approx(1) or (least == largest and points[:, 2].min() > 1)
    assert points[:, 2].max() <= DEEPEST + 1e-4
    assert (radii > 0).all()
    assert perspective.is_true == (least == 4), "true perspective where it is possible"


@pytest.mark.parametrize("passes", [1, 2, 19, 20, 21, 50, 333])
@pytest.mark.parametrize("most", [20, 7, 1])
def test_few_passes_are_kept_of_many(passes: int, most: int) -> None:
    probe, state = CapturingProbe(RecordOption(passes=most, rows=(0,))), np.zeros((1, 1), np.float32)
    for step in range(passes):
        probe.iteration(step, {"total": 1.0}, disparity=state)
    kept = [frame.step for frame in probe.frames]
    assert len(probe.energies["total"]) == passes
    assert most == 1 or kept[0] == 0
    assert kept[-1] == passes - 1
    assert kept == sorted(set(kept))
    assert min(passes, most // 2 + 1) <= len(kept) <= most


def test_a_method_that_tells_nothing(tmp_path: Path) -> None:
    scene = make_scene()
    record(tmp_path / "r.rrd", scene, lambda probe: Estimate({1: scene.truth[1]}), title="quiet")
    entities = set(read(tmp_path / "r.rrd"))
    assert {"/estimate/error", "/surface/points"} <= entities
    assert not [e for e in entities if e.startswith(("/volumes", "/haze", "/slices", "/energy", "/passes", "/error/"))]
    assert "/space/answer" in entities, "a map has its place in disparity space, too"


def test_a_scene_of_which_nothing_is_known_and_an_empty_answer(tmp_path: Path) -> None:
    full = make_scene()
    scene = Scene(full.name, full.views, full.labels, 1, full.disparities, {}, 1.0)
    nothing = np.full((20, 30), np.nan, np.float32)
    record(tmp_path / "r.rrd", scene, lambda probe: Estimate({1: nothing}), title="empty")
    entities = set(read(tmp_path / "r.rrd"))
    assert "/estimate/disparity" in entities
    assert not {"/estimate/error", "/truth/disparity", "/regions"} & entities


def test_a_solve_that_fails_leaves_nothing(tmp_path: Path) -> None:
    def solve(probe: Probe) -> Estimate:
        probe.iteration(0, {"total": 1.0})
        raise RuntimeError("no")

    with pytest.raises(RuntimeError, match="no"):
        record(tmp_path / "r.rrd", make_scene(), solve, title="t")
    assert list(tmp_path.iterdir()) == []


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, scene = tmp_path / "r.rrd", make_scene()
    path.write_text("old")
    honest = rrd._write

    def cut(*args: Any) -> Any:
        written = honest(*args)
        os.truncate(args[0], os.path.getsize(args[0]) // 2)  # noqa: PTH202
        return written

    monkeypatch.setattr(rrd, "_write", cut)
    with pytest.raises(RecordingError, match="cannot be read back"):
        record(path, scene, lambda probe: Estimate({1: scene.truth[1]}), title="t")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_rerun_did_not_write_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, honest = make_scene(), rrd._write

    def more(*args: Any) -> Any:
        written = honest(*args)
        written["/estimate/lost"] += 1
        return written

    monkeypatch.setattr(rrd, "_write", more)
    with pytest.raises(RecordingError, match="lost"):
        record(tmp_path / "r.rrd", scene, lambda probe: Estimate({1: scene.truth[1]}), title="t")
    assert list(tmp_path.iterdir()) == []


def test_two_recordings_do_not_mix(tmp_path: Path) -> None:
    scene = make_scene()
    for passes in (2, 3):
        teller = Teller(scene, passes)
        solved = lambda probe: teller.solve(scene, Context(probe=probe))  # noqa: B023, E731
        record(tmp_path / f"{passes}.rrd", scene, solved, title="same title")
    for passes in (2, 3):
        assert len(read(tmp_path / f"{passes}.rrd")["/energy/total"]) == passes
    assert not rr.is_enabled()  # and no recording of this process is active


def test_a_row_outside_the_scene(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"row 20 is not one of 0\.\.19"):
        record(tmp_path / "r.rrd", make_scene(), lambda probe: Estimate({}), title="t", wanted=RecordOption(rows=(20,)))


@pytest.mark.parametrize("fineness", [1, 2])
def test_a_reduced_volume_is_exact_where_it_is_kept(fineness: int) -> None:
    space = DisparitySpace(3, 40, 60, -4, 9, fineness)
    values = np.random.default_rng(0).random(space.shape, np.float32)
    volume = Volume(space, values, (0, 1, 2))
    small = reduction.reduce_volume(volume, 17, limit=values.size // 8)
    assert small.values.size <= values.size // 8
    rows, planes, columns = small.steps
    assert planes == 1
    assert (17 - small.first_row) % rows == 0
    assert np.array_equal(small.values, np.rint(255 * values[small.first_row :: rows, :, ::columns]))
    seen = reduction.reduce_volume(volume, 17, view=2, limit=values.size // 8)
    assert np.array_equal(seen.values, np.rint(255 * visibility(volume, 2)[small.first_row :: rows, :, ::columns]))
    tiny = reduction.reduce_volume(volume, 17, limit=20)
    assert tiny.values.size <= 20


def test_a_quarter_size_cell_is_small_and_quick(tmp_path: Path) -> None:
    scene = make_scene(4, 375, 450, 0, 59)
    space = DisparitySpace.covering(scene.disparities, 4, 375, 450)
    random = np.random.default_rng(0)
    noise = Volume(space, random.random(space.shape, np.float32), (0, 1, 2, 3))  # nothing compresses it
    maps = random.uniform(0, 59, (375, 450)).astype(np.float32)

    def solve(probe: Probe) -> Estimate:
        for i in range(3):
            probe.volume(f"similarity/{i}-{i + 1}", noise)
        for step in range(20):
            probe.iteration(step, {"total": 1.0}, noise, noise, maps)
        return Estimate({1: maps}, noise)

    before = time.process_time()
    record(tmp_path / "r.rrd", scene, solve, title="large")
    seconds = time.process_time() - before
    size = (tmp_path / "r.rrd").stat().st_size
    print(f"{size / 1e6:.1f} MB, {seconds:.2f} s of CPU time")
    assert size < 60e6
    assert seconds < 3  # of CPU time, for what else runs on the machine does not count


def test_pairs_of_a_reference_fill_all_three_colours() -> None:
    space = DisparitySpace(5, 2, 4, 0, 1)
    probe = CapturingProbe(RecordOption(rows=(0,)))
    for pair, value in ((("0", "2"), 0.2), (("1", "2"), 0.4), (("2", "3"), 0.6), (("2", "4"), 0.8)):
        values = np.full(space.shape, value, np.float32)
        probe.volume(f"similarity/{'-'.join(pair)}", Volume(space, values, (0, 1, 2, 3, 4)))
    shown = probe.similarity("abcde")
    assert shown is not None
    assert shown.picture[0, 0, 0].tolist() == [51, 102, 153]  # 0-2, 1-2 and 2-3: those least apart
    assert shown.names == ("a-c", "b-c", "c-d")


def test_voxels_of_fewer_views_have_the_colours_of_the_disparity_map(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    views = rng.integers(0, 256, (5, 4, 8, 3), np.uint8)
    truth = np.tile(np.linspace(0, 2, 8, dtype=np.float32), (4, 1))
    scene = Scene("a", views, tuple("01234"), 0, Range(0, 2), {0: truth}, 1)
    space = DisparitySpace(3, 4, 8, 0, 4)  # views 0, 2, 4: disparities are twice those of the scene
    values = np.zeros(space.shape, np.float32)
    values[:, 2] = 1
    path = tmp_path / "a.rrd"
    record(path, scene, lambda probe: Estimate({0: truth}, Volume(space, values, (0, 2, 4))), title="a")
    grid = read(path)["/space/materiality"][0][1]
    colors = np.asarray(grid["VoxelGridMap:colors"]).ravel()
    middle = coloring.disparity_colors(np.array([[1.0]], np.float32), (0, 2))[0, 0]
    assert {tuple(int(c).to_bytes(4, "big")[:3]) for c in colors} == {tuple(middle.tolist())}
