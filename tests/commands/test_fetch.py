"""`matbench fetch` as a person types it, in processes of its own; scenes of a third party's package."""

import io
import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from hashlib import sha256
from pathlib import Path

import pytest
from real import Real
from waiting import wait_until

from matbench.scenes.catalogue import PAPER_SCENES

PLUGIN = """\
import json, os
from pathlib import Path, PurePosixPath
from matbench.scenes.dataset import Download, Remote


class Toys:
    def listings(self, root):
        return []

    def load(self, name, options, root):
        raise NotImplementedError

    def downloads(self):
        known = json.loads(Path(os.environ["TOYS"]).read_text())
        files = {scene: tuple(Remote(*file) for file in files) for scene, files in known["files"].items()}
        return {
            scene: {"full": Download(f"toys/{scene}", PurePosixPath("toys", scene), some, known["site"],
                                     (f"zip/{scene}.zip", f"{scene}/"))}
            for scene, some in files.items()
        }


TOYS = Toys()
"""
FILES = {scene: {f"view{k}.png": os.urandom(60_000) for k in range(4)} for scene in ("box", "ball")}


def zipped(scene: str) -> bytes:
    raw = io.BytesIO()
    with zipfile.ZipFile(raw, "w") as archive:
        for name, content in FILES[scene].items():
            archive.writestr(f"{scene}/{name}", content)
    return raw.getvalue()


ARCHIVES = {scene: zipped(scene) for scene in FILES}


class Person:
    """Types `matbench fetch`, with a package of toy scenes installed."""

    def __init__(self, home: Path, site) -> None:
        self.home, self.root = home, home / "data"
        (home / "site" / "toys-1.0.dist-info").mkdir(parents=True)
        (home / "site" / "toys.py").write_text(PLUGIN)
        facts = home / "site" / "toys-1.0.dist-info"
        (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: toys\nVersion: 1.0\n")
        (facts / "entry_points.txt").write_text("[matbench.datasets]\ntoys = toys:TOYS\n")
        files = {
            scene: [[name, len(raw), sha256(raw).hexdigest()] for name, raw in some.items()]
            for scene, some in FILES.items()
        }
        (home / "toys.json").write_text(json.dumps({"site": site.url, "files": files}))
        self.environment = {name: value for name, value in os.environ.items() if name != "MATBENCH_DATA"}
        self.environment |= {"PYTHONPATH": str(home / "site"), "TOYS": str(home / "toys.json")}
        self.environment |= {"XDG_DATA_HOME": str(home / "own")}

    def start(self, *tokens: str, **options) -> subprocess.Popen[str]:
        line = [sys.executable, "-m", "matbench", "fetch", *tokens]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        return subprocess.Popen(line, cwd=self.home, env=self.environment, **pipes, **options)

    def fetch(self, *tokens: str, **options) -> tuple[int, str, str]:
        process = self.start(*tokens, **options)
        out, err = process.communicate(timeout=300)
        return process.returncode, out, err


@pytest.fixture
def person(tmp_path: Path, site) -> Person:
    return Person(tmp_path, site)


def placed(root: Path) -> dict[str, dict[str, bytes]]:
    return {
        scene: {path.name: path.read_bytes() for path in (root / "toys" / scene).glob("*")}
        for scene in FILES
        if (root / "toys" / scene).exists()
    }


def test_scenes_of_a_package_come_and_the_account_tells(person: Person, site) -> None:
    site.files |= {f"zip/{scene}.zip": raw for scene, raw in ARCHIVES.items()}
    status, out, err = person.fetch("toys/*", "--data", "data")
    assert (status, err) == (0, "")
    assert "came  toys/box: 4 files, 0.2 MB" in out
    assert f"2 scenes came (0.5 MB), 0 there already, 0 failed; folder: {person.root}" in out
    assert placed(person.root) == FILES
    status, out, _ = person.fetch("toys/*", "--data", "data")
    assert status == 0
    assert "there  toys/box: 4 files" in out
    assert "0 scenes came (0.0 MB), 2 there already, 0 failed" in out


def test_what_fails_is_told_with_reasons_and_what_to_do_by_hand(person: Person, site) -> None:
    site.files["zip/box.zip"] = ARCHIVES["box"]
    site.files["ball/view2.png"] = b"not the picture"
    status, out, err = person.fetch("toys/*", "--data", "data")
    assert (status, err) == (1, "")
    assert "failed  toys/ball: 4 of 4 files missing" in out
    assert f"{site.url}zip/ball.zip: 404 Not Found" in out
    assert f"{site.url}ball/view2.png: is not the published picture" in out
    assert f"by hand from {site.url}zip/ball.zip\n  or from {site.url}ball/\n  to {person.root}/toys/ball/\n" in out
    assert "1 scene came (0.2 MB), 0 there already, 1 failed" in out
    assert set(placed(person.root)) == {"box"}
    # placed by hand, it is checked and found
    (person.root / "toys/ball").mkdir()
    for name, raw in FILES["ball"].items():
        (person.root / "toys/ball" / name).write_bytes(raw)
    status, out, _ = person.fetch("toys/*", "--data", "data")
    assert status == 0
    assert "2 there already" in out


def test_a_dry_run_asks_nobody_and_writes_nothing(person: Person, site) -> None:
    status, out, _ = person.fetch("toys/*", "--data", "data", "--dry-run")
    assert status == 0
    assert f"toys/box: 4 of 4 files, 0.2 MB, to {person.root}/toys/box" in out
    assert f"from {site.url}zip/box.zip" in out
    assert "in all 0.5 MB" in out
    assert site.requests == []
    assert not person.root.exists()
    status, out, _ = person.fetch("toys/box", "--dry-run", "--mirror", "http://mirror.example/stereo")
    assert "from http://mirror.example/stereo/zip/box.zip" in out
    assert str(person.home / "own" / "matbench") in out


@pytest.mark.parametrize(
    ("tokens", "said"),
    [
        (["toys/bx"], "unknown scene 'toys/bx': did you mean 'toys/box'? Possible: toys/ball, toys/box"),
        (["toys/box[views=1]"], "unknown option 'views' of fetch in 'toys/box[views=1]'"),
        (["toys/box", "--mirror", "ftp://x/"], "mirror 'ftp://x/' is no address"),
        (["toys/box", "--data", "toys.json"], "toys.json' is a file"),
        (["toys/box", "--timeout", "0"], "timeout 0 is not between"),
        (["toys/box", "--retries=-1"], "retries -1 is not"),
        ([], "SCENE"),
    ],
)
def test_wrong_usage_is_one_line_and_status_2(person: Person, site, tokens: list[str], said: str) -> None:
    status, out, err = person.fetch(*tokens)
    assert (status, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
    assert site.requests == []


def test_killed_half_way_and_gone_on_with(person: Person, site) -> None:
    """kill -9 while the archive comes: no file is half there, and the next fetch goes on from the part."""
    raw = ARCHIVES["box"]
    site.files["zip/box.zip"] = raw
    site.faults["zip/box.zip"] = [("slow", 100_000, 0.2)]
    part = person.root / "toys/box/.fetch/box.zip.part"
    process = person.start("toys/box", "--data", "data")
    wait_until(lambda: part.exists() and part.stat().st_size > 80_000)
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=150)
    assert process.returncode == -signal.SIGKILL
    assert not any((person.root / "toys/box").glob("*.png"))
    size = part.stat().st_size
    assert part.read_bytes() == raw[:size]
    status, out, err = person.fetch("toys/box", "--data", "data")
    assert (status, err) == (0, ""), out
    assert placed(person.root) == {"box": FILES["box"]}
    assert site.requests[-1] == ["zip/box.zip", f"bytes={size}-", len(raw) - size]
    assert not (person.root / "toys/box/.fetch").exists()


def test_killed_while_it_unpacks_and_gone_on_with(person: Person, site) -> None:
    """Whatever of the members is there then is whole; the archive need not come again."""
    (stage := person.root / "toys/box/.fetch").mkdir(parents=True)
    (stage / "box.zip").write_bytes(ARCHIVES["box"])
    (stage / "unpacked").write_bytes(b"half a picture")
    status, _, _ = person.fetch("toys/box", "--data", "data")
    assert status == 0
    assert placed(person.root) == {"box": FILES["box"]}
    assert site.requests == []


def test_interrupted_from_the_keyboard(person: Person, site) -> None:
    site.files["zip/box.zip"] = ARCHIVES["box"]
    site.files["zip/ball.zip"] = ARCHIVES["ball"]
    site.faults["zip/ball.zip"] = [("slow", 100_000, 0.2)]
    part = person.root / "toys/ball/.fetch/ball.zip.part"
    process = person.start("toys/box", "toys/ball", "--data", "data")
    wait_until(lambda: part.exists() and part.stat().st_size > 80_000)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=150)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert "came  toys/box" in out
    assert "interrupted: the same command goes on from here" in out
    assert part.stat().st_size > 80_000
    assert person.fetch("toys/box", "toys/ball", "--data", "data")[0] == 0
    assert placed(person.root) == FILES


def test_two_fetches_at_once_share_the_work(person: Person, site) -> None:
    site.files["zip/box.zip"] = ARCHIVES["box"]
    site.files["zip/ball.zip"] = ARCHIVES["ball"]
    site.faults["zip/box.zip"] = [("slow", 100_000, 0.05)]
    part = person.root / "toys/box/.fetch/box.zip.part"
    first = person.start("toys/box", "toys/ball", "--data", "data")
    wait_until(part.exists)
    second = person.start("toys/box", "toys/ball", "--data", "data")
    said = [process.communicate(timeout=300) for process in (first, second)]
    assert [first.returncode, second.returncode] == [0, 0], said
    assert "waiting: toys/box is being fetched by another matbench" in said[1][0]
    assert "there  toys/box" in said[1][0]
    assert placed(person.root) == FILES
    assert sorted(path for path, *_ in site.requests) == ["zip/ball.zip", "zip/box.zip"], "each came once"


def test_a_fetch_that_was_killed_holds_no_lock(person: Person, site) -> None:
    site.files["zip/box.zip"] = ARCHIVES["box"]
    site.faults["zip/box.zip"] = [("stall", 50_000)]
    first = person.start("toys/box", "--data", "data")
    wait_until(lambda: bool(site.requests))
    second = person.start("toys/box", "--data", "data")
    assert second.stdout is not None
    assert "waiting: toys/box" in second.stdout.readline()
    first.kill()
    first.communicate(timeout=150)
    second.communicate(timeout=300)
    assert second.returncode == 0
    assert placed(person.root) == {"box": FILES["box"]}


def test_a_stalled_server_is_given_up_in_time(person: Person, site) -> None:
    for path in ("zip/ball.zip", "ball/view0.png"):
        site.files[path] = ARCHIVES["ball"]
        site.faults[path] = [("stall", 0)]
        site.forever.add(path)
    start = time.monotonic()
    status, out, _ = person.fetch("toys/ball", "toys/box", "--data", "data", "--timeout", "0.3", "--retries", "0")
    assert status == 1
    assert "does not answer: the connection stalled" in out
    assert "0 scenes came (0.0 MB), 0 there already, 2 failed" in out
    assert time.monotonic() - start < 20
    assert "not tried" in out
    assert [path for path, *_ in site.requests] == ["zip/ball.zip", "ball/view0.png"]


def test_scenes_go_where_the_loaders_look(person: Person, site) -> None:
    site.files["zip/box.zip"] = ARCHIVES["box"]
    assert person.fetch("toys/box")[0] == 0
    own = person.home / "own" / "matbench"
    assert placed(own) == {"box": FILES["box"]}
    code = "from matbench.scenes.catalogue import data_root; print(data_root())"
    line = [sys.executable, "-c", code]
    found = subprocess.run(line, env=person.environment, capture_output=True, text=True, check=True).stdout.strip()
    assert Path(found) == own.resolve()


def test_the_papers_scenes_come_from_a_copy_of_the_site_and_load(
    tmp_path: Path, serve, real: Real, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Real pictures, from a server that is laid out as the official one: as single files."""
    from matbench.scenes.catalogue import load_scene

    root = real(*PAPER_SCENES[:2], "middlebury2003/teddy[size=quarter]", "middlebury2006/Rocks1[size=third]")
    site = serve(root / "middlebury")
    line = [sys.executable, "-m", "matbench", "fetch", "paper", "--mirror", site.url, "--data", str(tmp_path / "new")]
    done = subprocess.run(line, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 scenes came (6.7 MB), 0 there already, 0 failed" in done.stdout
    for name in PAPER_SCENES:
        new, old = load_scene(name, tmp_path / "new"), load_scene(name, root)
        assert (new.digest, new.truth_digest) == (old.digest, old.truth_digest)
    again = subprocess.run(line, capture_output=True, text=True, timeout=120)
    assert "0 scenes came (0.0 MB), 3 there already" in again.stdout


@pytest.mark.parametrize("archive", ["teddyH-ppm-9.zip", "teddyH-ppm-2.zip"])
def test_views_that_are_offered_under_another_name_are_renamed(tmp_path: Path, serve, real: Real, archive) -> None:
    """The half size of 2003, whose archives may call view2 im2, in a folder of another name."""
    site = serve()
    source = real("middlebury2003/teddy[size=half]") / "middlebury/scenes2003/newdata/half/teddy"
    kept = {path.name: path.read_bytes() for path in source.iterdir() if path.suffix in (".ppm", ".pgm")}
    if archive.endswith("-2.zip"):
        kept = {name: raw for name, raw in kept.items() if name[-5] in "26"}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as made:
        for name, raw in kept.items():
            made.writestr(f"teddyH/{name.replace('view', 'im')}", raw)
    site.files[f"scenes2003/newdata/full/{archive}"] = packed.getvalue()
    line = [sys.executable, "-m", "matbench", "fetch", "middlebury2003/teddy[size=half]"]
    done = subprocess.run([*line, "--mirror", site.url, "--data", str(tmp_path)], capture_output=True, timeout=120)
    assert done.returncode == (1 if archive.endswith("-2.zip") else 0), done.stdout
    folder = tmp_path / "middlebury/scenes2003/newdata/half/teddy"
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == kept
    from matbench.scenes.catalogue import load_scene

    assert load_scene("middlebury2003/teddy[size=half views=2+6]", tmp_path).n == 2


def test_every_real_picture_comes_out_of_an_archive_as_published(tmp_path: Path, serve, real: Real) -> None:
    """A scene of each set, packed as its official archive is: a folder named after it, one more file in it."""
    site = serve()
    sets = {
        "middlebury2006/Aloe": "scenes2006/ThirdSize",
        "middlebury2006/Aloe[size=half]": "scenes2006/HalfSize",
        "middlebury2005/Reindeer[size=full]": "scenes2005/FullSize",
    }
    root = real("middlebury2006/Aloe[size=third]", *sets)
    for name, folder in sets.items():
        scene = name.partition("/")[2].partition("[")[0]
        raw = io.BytesIO()
        with zipfile.ZipFile(raw, "w") as archive:
            for path in sorted((root / "middlebury" / folder / scene).iterdir()):
                archive.write(path, f"{scene}/{path.name}")
        site.files[f"{folder}/zip-7views/{scene}-7views.zip"] = raw.getvalue()
    line = [sys.executable, "-m", "matbench", "fetch", *sets, "--mirror", site.url, "--data", str(tmp_path)]
    done = subprocess.run(line, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    for name, folder in sets.items():
        scene = name.partition("/")[2].partition("[")[0]
        there = {path.name: path.read_bytes() for path in (tmp_path / "middlebury" / folder / scene).iterdir()}
        original = {path.name: path.read_bytes() for path in (root / "middlebury" / folder / scene).iterdir()}
        original.pop("dmin.txt", None)
        assert there == original
    assert [path for path, *_ in site.requests] == list(site.files), "one request for each scene"
