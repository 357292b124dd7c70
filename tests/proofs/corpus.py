"""Real files of every kind that are stored or received, and what reads each: the fuzzer starts from these."""

import json
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import cv2
import dataset_layouts
import numpy as np
from attrs import frozen
from onnx_models import block_matcher
from places import METHODS, TESTS
from recordings import Teller, make_scene
from scene_files import Layers, pfm_bytes, write_pair, write_png

from matbench import comparison, spec
from matbench.algorithm import Context
from matbench.algorithms.cameras import Rig
from matbench.algorithms.command import Command
from matbench.algorithms.onnx import slot_of
from matbench.datasets.hci import read_range
from matbench.datasets.scaffold import write_scene_toml
from matbench.errors import UserError
from matbench.files import images, pfm, unzip
from matbench.files.onnx_file import read_model
from matbench.measures.volumes import StoredVolume
from matbench.plans.record_option import RecordOption
from matbench.plans.request import read_request
from matbench.plans.settings import Settings
from matbench.recording import told
from matbench.recording.probe import CapturingProbe
from matbench.reports import run_tables
from matbench.rescoring import open_run
from matbench.results import archive, freshness, scores
from matbench.results.status import standing
from matbench.runs import parcels
from matbench.runs.lock import Work
from matbench.runs.store import Store
from matbench.scene import Range, Scene
from matbench.scenes.catalogue import load_scene
from matbench.solving import intake
from matbench.solving.cluster_worker import Reply

SCENE = "synthetic/box[size=48x36]"
PLUGINS = [METHODS, TESTS / "sureness.py"]


@frozen
class Target:
    """Files, and what reads them.

    Parameters
    ----------
    place
        A folder, copied before one of its files is spoilt.
    files
        Those that are spoilt, below it.
    read
        Called with the copy.
    allowed
        What it may raise, said in one line.
    slow
        Is it much slower than others? It is then tried less often.
    sent
        Does it come over a line, as bytes? Then no pipe or link lies in its place.
    """

    name: str
    place: Path
    files: tuple[str, ...]
    read: Callable[[Path], object]
    allowed: tuple[type[Exception], ...] = (UserError,)
    slow: bool = False
    sent: bool = False


def build(folder: Path) -> list[Target]:
    """Make the corpus: a run with volumes, its archive, and so on."""
    run = folder / "run"
    ready = comparison.prepare(
        ["flat", "solid", "sure"], SCENE, out=run, plugin=PLUGINS, command="typed", settings=Settings(volumes=True)
    )
    ready.run()
    ready.report(ready.tables())
    scene, plan = ready.scenes[SCENE], ready.plan
    solid = next(cell for cell in plan.cells if cell.method.algorithm == "solid")
    sure = next(cell for cell in plan.cells if cell.method.algorithm == "sure")
    (folder / "archive").mkdir()
    archive.export(run, folder / "archive" / "run.zip")
    work = {"pid": 1, "host": "there", "since": 1.0e9, "running": {solid.key: 1.1e9}}
    (run / ".work.json").write_text(json.dumps(work))
    cell_files = tuple(f"cells/{solid.key}/{name}" for name in ("cell.json", "disparity.npz", "volume.npz"))
    cell_files += f"cells/{sure.key}/confidence.npz", f"cells/{sure.key}/cell.json"
    tables = ("results.csv", "cells.csv", "reliability.csv", "sparsification.csv", "scores.json")

    def status(place: Path) -> None:
        standing(place)
        Work.read(place)

    def table(place: Path) -> None:
        store = Store(place)
        found = scores.tables(plan, store, {SCENE: scene})
        freshness.fault(plan, store)
        with suppress(ValueError):  # they are made anew: `Comparison.kept`
            scores.read(place, (), found.outcomes)

    def whole(place: Path) -> None:
        opened, _ = open_run(place, plugin=PLUGINS)
        opened.tables()

    def export(place: Path) -> None:
        archive.export(place, place / "out.zip")

    def unpacked(place: Path) -> None:
        archive.unpack(place / "run.zip", place / "out")
        standing(place / "out")
        scores.tables(plan, Store(place / "out"), {SCENE: scene})

    def parcel(place: Path) -> None:
        beside = Store(place / "store")
        (beside.folder / "cells").mkdir(parents=True)
        parcels.put(beside, solid, (place / "parcel.zip").read_bytes())

    def reply(place: Path) -> None:
        Reply.unpacked((place / "reply").read_bytes())

    def answer(place: Path) -> None:
        (place / "taken").mkdir()
        intake.outcome(place)
        intake.maps(place / "disparity.npz", scene)
        intake.confidence(place / "confidence.npz", scene)
        for name in ("volume.npz", "log.txt"):
            intake.take(place / name, place / "taken" / name)

    def fetched(place: Path) -> None:
        with unzip.opened(place / "run.zip") as opened:
            for info in unzip.members(opened, ["plan.json", "cell.json", "disparity.npz"]):
                target = place / "one"
                target.unlink(missing_ok=True)
                unzip.unpack(opened, info, target, 1 << 24)

    parcel_place = folder / "parcel"
    parcel_place.mkdir()
    (parcel_place / "parcel.zip").write_bytes(parcels.pack(ready.store.cell(solid)))
    reply_place = folder / "reply"
    reply_place.mkdir()
    (reply_place / "reply").write_bytes(Reply("tcp://there:1", b"parcel" * 9, "").packed())
    answer_place = folder / "answer"
    shutil.copytree(ready.store.cell(solid), answer_place)
    shutil.copy(ready.store.cell(sure) / "confidence.npz", answer_place)
    # as the process of a cell writes it
    (answer_place / "outcome.json").write_text(json.dumps(ready.store.facts(solid)["outcome"]))
    scenes = _scenes(folder)
    recording = _recording(folder)
    request = folder / "request"
    request.mkdir()
    (request / "a.toml").write_text(
        'algorithms = ["sgbm[block_size=3,5]"]\nscenes = ["synthetic/box[n=3,5 seed=0]", "b"]\n'
    )

    def asked(place: Path) -> None:
        algorithms, named = read_request(place / "a.toml")
        for one in [*algorithms, *(named or [])]:
            spec.count(one)
            spec.read_scene(one)
            if spec.count(one) < 100:
                spec.expand(one)

    refused = (ValueError, OSError)
    return [
        Target("status", run, ("plan.json", "scores.json", *tables[:4], ".work.json", cell_files[0]), status),
        Target("tables", run, (*tables, *cell_files), table),
        Target("score", run, ("plan.json", "results.csv", *cell_files), whole, slow=True),
        Target("export", run, ("plan.json", *tables, *cell_files), export),
        Target("archive", folder / "archive", ("run.zip",), unpacked, slow=True),
        Target("fetch", folder / "archive", ("run.zip",), fetched, (UserError, unzip.ArchiveError)),
        Target("parcel", parcel_place, ("parcel.zip",), parcel, (UserError, unzip.ArchiveError), sent=True),
        Target(
            "reply",
            reply_place,
            ("reply",),
            lambda p: Reply.unpacked((p / "reply").read_bytes()),
            (ValueError,),
            sent=True,
        ),
        Target(
            "answer",
            answer_place,
            ("outcome.json", "disparity.npz", "confidence.npz", "volume.npz", "log.txt"),
            answer,
            refused,
        ),
        Target("volume", answer_place, ("volume.npz",), lambda p: StoredVolume.read(p / "volume.npz", scene), refused),
        Target("recording", recording, ("told.npz",), lambda p: told.read_told(p / "told.npz"), (ValueError,)),
        Target("tables", run, ("results.csv", "cells.csv"), run_tables.read_run),
        Target("curves", run, ("sparsification.csv",), run_tables.read_points),
        Target("request", request, ("a.toml",), asked),
        *scenes,
    ]


def _scenes(folder: Path) -> list[Target]:
    layers = Layers(width=48, height=36)
    own = folder / "own"
    own.mkdir()
    for number in range(3):
        write_png(own / f"im{number}.png", layers.view(number - 1))
    (own / "truth.pfm").write_bytes(pfm_bytes(layers.truth()))
    write_png(own / "truth.png", np.full((36, 48), 700, np.uint16))
    (own / "scene.toml").write_text(
        'views = ["im0.png", "im1.png", "im2.png"]\ndisparities = [-2, 3]\nreference = "im1.png"\npair_steps = 1\n'
        '[truth."im1.png"]\nfile = "truth.pfm"\n[truth."im0.png"]\nfile = "truth.png"\nscale = 256\nunknown = 0\n'
    )
    pair = folder / "pair"
    write_pair(pair, Layers())
    other = folder / "other"
    other.mkdir()
    view = layers.view(0)
    (other / "a.ppm").write_bytes(b"P6\n# made\n48 36\n255\n" + view.tobytes())
    (other / "a.pgm").write_bytes(b"P5 48 36 65535\n" + bytes(2 * 48 * 36))
    (other / "parameters.cfg").write_text("[meta]\nscene = a\ndisp_min = -1.5\ndisp_max = 2\n[light]\nfield = 9\n")

    def files(place: Path) -> None:
        for name, read in (("a.ppm", images.read_rgb), ("a.pgm", images.read_levels), ("a.pgm", images.encoding)):
            read(place / name)
        read_range(place)

    return [
        Target(
            "own scene",
            own,
            ("scene.toml", "im0.png", "im1.png", "truth.pfm", "truth.png"),
            lambda p: load_scene(str(p)),
        ),
        Target("pair", pair, ("calib.txt", "im0.png", "disp0.pfm"), lambda p: load_scene(str(p))),
        Target("images", other, ("a.ppm", "a.pgm", "parameters.cfg"), files),
        Target("map", own, ("truth.pfm",), lambda p: pfm.read_disparities(p / "truth.pfm")),
        *_as_they_come(folder),
    ]


def _as_they_come(folder: Path) -> list[Target]:
    """Scenes in published layouts and other formats, a folder that `scene new` looks at, and what programs leave."""
    layers, mixed = Layers(width=48, height=36), folder / "mixed"
    mixed.mkdir()
    write_png(mixed / "a.png", layers.view(-1).astype(np.uint16) * 257)
    for name, step in (("b.jpg", 0), ("c.tif", 1.5)):
        assert cv2.imwrite(str(mixed / name), layers.view(step)[..., ::-1])
    np.save(mixed / "truth.npy", layers.truth())
    np.savez_compressed(mixed / "truth.npz", layers.truth(-1))
    assert cv2.imwrite(str(mixed / "truth.tif"), layers.truth(1.5))
    write_png(mixed / "seen.png", np.full((36, 48), 255, np.uint8))
    (mixed / "scene.toml").write_text(
        "views = ['a.png', 'b.jpg', 'c.tif']\npositions = [0, 1, 2.5]\nvertical = true\ndisparities = [-2, 3]\n"
        "[truth.a]\nfile = 'truth.npz'\n[truth.b]\nfile = 'truth.npy'\nmask = 'seen.png'\nsparse = false\n"
        "[truth.c]\nfile = 'truth.tif'\nunknown = 0\n"
    )
    eth3d = dataset_layouts.eth3d(folder / "eth3d")
    kitti, sintel = dataset_layouts.kitti(folder / "kitti"), dataset_layouts.sintel(folder / "sintel")
    flow = dataset_layouts.sceneflow(folder / "sceneflow")
    frame = "alley_1/frame_0001.png"
    answer = folder / "program"
    answer.mkdir()
    np.save(answer / "depth.npy", 40 / (layers.truth() + 3))
    rig = Rig.of(Scene("six", np.zeros((2, 36, 48, 3), np.uint8), ("0", "1"), 0, Range(-2, 3), {}, 1))

    def drafted(place: Path) -> None:
        (place / "scene.toml").unlink(missing_ok=True)
        write_scene_toml(place)

    def loaded(place: Path) -> None:
        load_scene(str(place))

    networks = folder / "networks"
    networks.mkdir()
    block_matcher(networks / "net.onnx", size=(36, "width"), outputs=2)
    block_matcher(networks / "beside.onnx", joined=1, beside="gain.bin")

    def network(place: Path) -> None:
        for name in ("net.onnx", "beside.onnx"):
            slot_of(read_model(place / name), "", "", 3, "auto")

    left = (UserError, RuntimeError)
    return [
        Target("mixed scene", mixed, tuple(sorted(path.name for path in mixed.iterdir())), loaded),
        Target("folder", mixed, ("a.png", "b.jpg", "c.tif", "truth.npy"), drafted, slow=True),
        Target("eth3d", eth3d, ("calib.txt", "mask0nocc.png", "disp0GT.pfm"), loaded),
        Target(
            "kitti", kitti, tuple(f"{one}/000000_10.png" for one in ("image_3", "disp_occ_0", "disp_noc_0")), loaded
        ),
        Target("sintel", sintel, (f"disparities/{frame}", f"occlusions/{frame}", f"clean_right/{frame}"), loaded),
        Target("sceneflow", flow, ("disparity/TRAIN/A/0000/left/0006.pfm",), loaded),
        Target("network", networks, ("net.onnx", "beside.onnx"), network),
        Target("program", answer, ("depth.npy",), lambda p: Command("true")._read_one(p, rig), left),
    ]


def _recording(folder: Path) -> Path:
    place = folder / "recording"
    place.mkdir()
    toy = make_scene()
    probe = CapturingProbe(RecordOption(rows=(5,)).at(toy.height))
    estimate = Teller(toy).solve(toy, Context(probe=probe))
    told.write_told(place / "told.npz", told.Told(probe, estimate))
    return place
