"""Scenes fetched from a real server, with generated archives and everything that can go wrong."""

import io
import re
import shutil
import stat
import subprocess
import zipfile
from functools import partial
from hashlib import sha256
from pathlib import Path, PurePosixPath

import cv2
import numpy as np
import pytest
from attrs import evolve

from matbench.errors import UserError
from matbench.files.images import has_pixels, pixel_digests
from matbench.files.transfer import Patience
from matbench.scenes.dataset import Download, Remote
from matbench.scenes.fetching import Result, fetch, look, site_of

QUICK = Patience(timeout=20, retries=1, pause=0.01)


SHORT = Patience(timeout=0.5, retries=1, pause=0.01)


FOLDER = PurePosixPath("toys/small/box")


NAMES = ("im0.ppm", "im1.ppm", "im2.ppm", "disp1.pgm")


rng = np.random.default_rng(3)


PIXELS = {name: rng.integers(0, 256, (30, 40, 3) if name.endswith("ppm") else (30, 40), np.uint8) for name in NAMES}


def encoded(name: str, pixels: np.ndarray) -> bytes:
    done, raw = cv2.imencode(Path(name).suffix, pixels)
    assert done
    return raw.tobytes()


PICTURES = {name: encoded(name, pixels) for name, pixels in PIXELS.items()}


OTHER = encoded("im0.ppm", np.zeros((30, 40, 3), np.uint8))


@pytest.fixture
def toy(site, tmp_path: Path) -> Download:
    """A scene of four files; the site has nothing yet."""
    files = []
    for name, raw in PICTURES.items():
        (tmp_path / name).write_bytes(raw)
        pixels = next(iter(pixel_digests(tmp_path / name)))
        (tmp_path / name).unlink()
        also = (f"{Path(name).stem}.png",)
        files.append(Remote(name, len(raw), sha256(raw).hexdigest(), also, holds=partial(has_pixels, digest=pixels)))
    return Download("toys/box", FOLDER, tuple(files), site.url, ("zip/box.zip", "box/"))


def zipped(*contents: tuple[str | zipfile.ZipInfo, bytes]) -> bytes:
    raw = io.BytesIO()
    with zipfile.ZipFile(raw, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents:
            archive.writestr(name, content)
    return raw.getvalue()


WHOLE = zipped(*((f"box/{name}", raw) for name, raw in PICTURES.items()), ("box/dmin.txt", b"1"))


def bring(toy: Download, root: Path, **options) -> Result:
    (result,) = fetch([toy], root, **{"patience": QUICK, **options})
    return result


def inside(root: Path) -> dict[str, bytes]:
    """Every file below the root but the locks, by its path."""
    return {
        str(path.relative_to(root)): path.read_bytes()
        for path in root.rglob("*")
        if path.is_file() and path.suffix != ".lock"
    }


PLACED = {str(FOLDER / name): raw for name, raw in PICTURES.items()}


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return tmp_path / "data"


def test_from_an_archive(site, toy: Download, root: Path) -> None:
    site.files["zip/box.zip"] = WHOLE
    result = bring(toy, root)
    assert (result.came, result.there, result.missing, result.reasons) == (NAMES, (), (), ())
    assert result.bytes == len(WHOLE)
    assert inside(root) == PLACED
    assert [path.name for path in (root / FOLDER).iterdir() if path.is_dir()] == []
    assert [path for path, *_ in site.requests] == ["zip/box.zip"]


def test_from_single_files_where_there_is_no_archive(site, toy: Download, root: Path) -> None:
    site.files |= {f"box/{name}": raw for name, raw in PICTURES.items()}
    result = bring(toy, root)
    assert result.came == NAMES
    assert inside(root) == PLACED
    assert result.bytes == sum(map(len, PICTURES.values()))


def test_each_source_adds_what_it_has(site, toy: Download, root: Path) -> None:
    site.files["zip/box.zip"] = zipped(("im0.ppm", PICTURES["im0.ppm"]), ("disp1.pgm", PICTURES["disp1.pgm"]))
    site.files["box/im1.ppm"] = PICTURES["im1.ppm"]
    result = bring(toy, root)
    assert set(result.came) == {"im0.ppm", "im1.ppm", "disp1.pgm"}
    assert result.missing == ("im2.ppm",)
    assert any("holds no plain file im1.ppm, im2.ppm" in reason for reason in result.reasons)
    assert any("box/im2.ppm: 404" in reason for reason in result.reasons)
    assert inside(root) == {path: raw for path, raw in PLACED.items() if "im2" not in path}, "what came is kept"
    site.files["box/im2.ppm"] = PICTURES["im2.ppm"]
    again = bring(toy, root)
    assert (again.came, len(again.there), again.missing) == (("im2.ppm",), 3, ())


@pytest.mark.parametrize("where", ["archive", "folder"])
def test_the_same_pixels_in_another_format_are_the_same_picture(site, toy: Download, root: Path, where: str) -> None:
    others = {f"{Path(name).stem}.png": encoded("a.png", pixels) for name, pixels in PIXELS.items()}
    if where == "archive":
        site.files["zip/box.zip"] = zipped(*others.items())
    else:
        site.files |= {f"box/{name}": raw for name, raw in others.items()}
    result = bring(toy, root)
    assert result.missing == ()
    assert inside(root) == {str(FOLDER / name): raw for name, raw in others.items()}
    assert bring(toy, root).there == tuple(others)


@pytest.mark.parametrize("where", ["archive", "folder"])
@pytest.mark.parametrize("content", [OTHER, PICTURES["im1.ppm"], b"<!DOCTYPE html>", b"", PICTURES["im0.ppm"][:-5]])
def test_a_wrong_digest_is_never_placed(site, toy: Download, root: Path, where: str, content: bytes) -> None:
    contents = PICTURES | {"im0.ppm": content}
    if where == "archive":
        site.files["zip/box.zip"] = zipped(*contents.items())
    else:
        site.files |= {f"box/{name}": raw for name, raw in contents.items()}
    result = bring(toy, root)
    assert result.missing == ("im0.ppm",)
    assert any("im0.ppm is not the published picture" in reason.replace(": is", " is") for reason in result.reasons)
    assert inside(root) == {path: raw for path, raw in PLACED.items() if "im0" not in path}, "the others are placed"


def test_what_is_there_is_checked_and_not_fetched(site, toy: Download, root: Path) -> None:
    site.files["zip/box.zip"] = WHOLE
    bring(toy, root)
    asked = len(site.requests)
    result = bring(toy, root)
    assert (result.came, result.there, result.missing) == ((), NAMES, ())
    assert len(site.requests) == asked
    (seen,) = look([toy], root)
    assert seen.there == NAMES


def test_a_folder_that_may_only_be_read_is_enough_if_all_is_there(site, toy: Download, root: Path) -> None:
    site.files["zip/box.zip"] = WHOLE
    bring(toy, root)
    shutil.rmtree(root / ".fetch")
    assert bring(toy, root).there == NAMES
    assert not (root / ".fetch").exists()


def test_somebody_elses_file_is_not_written_over(site, toy: Download, root: Path) -> None:
    site.files["zip/box.zip"] = WHOLE
    (root / FOLDER).mkdir(parents=True)
    (root / FOLDER / "im0.ppm").write_bytes(OTHER)
    (root / FOLDER / "im1.png").mkdir()
    result = bring(toy, root)
    assert result.missing == ("im0.ppm", "im1.ppm")
    assert (root / FOLDER / "im0.ppm").read_bytes() == OTHER
    said = " ".join(result.reasons)
    assert f"{root / FOLDER / 'im0.ppm'} is not the published file: move it away" in said
    assert f"{root / FOLDER / 'im1.png'} is a folder" in said
    assert set(result.came) == {"im2.ppm", "disp1.pgm"}


def test_nothing_stays_of_a_scene_that_is_nowhere(site, toy: Download, root: Path) -> None:
    result = bring(toy, root)
    assert result.missing == NAMES
    assert "zip/box.zip: 404" in result.reasons[0]
    assert not (root / FOLDER).exists()
    assert result.urls == (f"{site.url}zip/box.zip", f"{site.url}box/")


def test_a_mirror_takes_the_place_of_the_site(serve, site, toy: Download, root: Path) -> None:
    mirror = serve()
    mirror.files["stereo/zip/box.zip"] = WHOLE
    assert bring(toy, root, mirror=f"{mirror.url}stereo/").missing == ()
    assert site.requests == []


LINK = zipfile.ZipInfo("box/im0.ppm")
LINK.create_system, LINK.external_attr = 3, (stat.S_IFLNK | 0o777) << 16


@pytest.mark.parametrize(
    "members",
    [
        [("../../../../im0.ppm", PICTURES["im0.ppm"])],
        [("/im0.ppm", PICTURES["im0.ppm"])],
        [(LINK, b"/etc/passwd")],
        [("box/im0.ppm/", b"")],
        [("box/im0.ppm", bytes(20 << 20))],
    ],
    ids=["parent", "absolute", "link", "folder", "bomb"],
)
def test_a_hostile_member_is_not_placed_and_spoils_nothing(site, toy: Download, root: Path, members) -> None:
    rest = [(f"box/{name}", raw) for name, raw in PICTURES.items() if name != "im0.ppm"]
    site.files["zip/box.zip"] = zipped(*members, *rest)
    before = inside(root.parent)
    result = bring(toy, root)
    assert result.missing == ("im0.ppm",)
    assert inside(root.parent) == before | {f"data/{path}": raw for path, raw in PLACED.items() if "im0" not in path}
    assert not any(path.is_symlink() for path in root.rglob("*"))


def test_of_several_members_with_one_name_the_right_one_is_taken(site, toy: Download, root: Path) -> None:
    rest = [(name, raw) for name, raw in PICTURES.items() if name != "im0.ppm"]
    doubled = [("im0.ppm", OTHER), ("im0.ppm", PICTURES["im0.ppm"]), ("im0.ppm", b"")]
    with pytest.warns(UserWarning, match="Duplicate"):
        site.files["zip/box.zip"] = zipped(*doubled, *rest)
    assert bring(toy, root).missing == ()
    assert inside(root) == PLACED


def test_duplicates_cannot_fill_the_disk(site, toy: Download, root: Path) -> None:
    """The sum of all that is unpacked has a limit, too: it ends with a reason, not with a full disk."""
    with pytest.warns(UserWarning, match="Duplicate"):
        site.files["zip/box.zip"] = zipped(*[("im0.ppm", bytes(900_000))] * 20)
    result = bring(toy, root)
    assert result.missing == NAMES
    limits = [int(found) for found in re.findall(r"unpacks to more than (\d+)", " ".join(result.reasons))]
    assert limits
    assert min(limits) < 900_000, "what is left of the sum"


@pytest.mark.parametrize("content", [b"", b"<html>", WHOLE[:-30]])
def test_a_damaged_archive_falls_back_to_single_files(site, toy: Download, root: Path, content: bytes) -> None:
    site.files["zip/box.zip"] = content
    site.files |= {f"box/{name}": raw for name, raw in PICTURES.items()}
    assert bring(toy, root).missing == ()
    assert inside(root) == PLACED


@pytest.mark.parametrize("whole", [False, True])
def test_a_part_of_another_archive_is_dropped(site, toy: Download, root: Path, whole: bool) -> None:
    stage = root / FOLDER / ".fetch"
    stage.mkdir(parents=True)
    (stage / ("box.zip" if whole else "box.zip.part")).write_bytes(b"x" * 1000)
    (stage / "tmp1234").write_bytes(b"left by a killed process")
    site.files["zip/box.zip"] = WHOLE
    result = bring(toy, root)
    assert result.missing == ()
    assert inside(root) == PLACED


def test_a_part_of_another_single_file_is_dropped(site, toy: Download, root: Path) -> None:
    stage = root / FOLDER / ".fetch"
    stage.mkdir(parents=True)
    (stage / "im0.ppm.part").write_bytes(b"x" * 1000)
    site.files |= {f"box/{name}": raw for name, raw in PICTURES.items()}
    assert bring(toy, root).missing == ()
    assert inside(root) == PLACED


def test_a_truncated_archive_keeps_its_part_and_goes_on(site, toy: Download, root: Path) -> None:
    whole = zipped(*PICTURES.items(), ("noise", rng.bytes(50_000)))
    site.files["zip/box.zip"] = whole
    site.faults["zip/box.zip"] = [("cut", 40_000), 503, 503]
    site.faults["box/im0.ppm"] = [503, 503]
    result = bring(toy, root)
    assert result.missing == NAMES
    assert "does not answer: 503" in result.reasons[-1]
    parts = list((root / FOLDER / ".fetch").iterdir())
    assert [path.name for path in parts] == ["box.zip.part"]
    kept = parts[0].stat().st_size
    assert 0 < kept <= 40_000
    assert bring(toy, root).missing == ()
    assert site.requests[-1] == ["zip/box.zip", f"bytes={kept}-", len(whole) - kept]
    assert inside(root) == PLACED


def test_a_site_that_stalls_is_given_up_for_all_scenes(site, toy: Download, root: Path) -> None:
    site.files |= {"zip/box.zip": WHOLE, "zip/two.zip": WHOLE, "box/im0.ppm": PICTURES["im0.ppm"]}
    site.faults["zip/box.zip"] = site.faults["box/im0.ppm"] = [("stall", 10)]
    site.forever |= {"zip/box.zip", "box/im0.ppm"}
    scenes = [toy, evolve(toy, name="toys/two", folder=PurePosixPath("toys/two"), sources=("zip/two.zip",))]
    one, two = fetch(scenes, root, patience=SHORT)
    assert "does not answer: the connection stalled" in one.reasons[-1]
    assert two.missing == NAMES
    assert "not tried" in two.reasons[0]
    assert site.sent("zip/two.zip") == []


def test_one_file_that_stalls_harms_no_other_scene(site, toy: Download, root: Path) -> None:
    site.faults["zip/box.zip"] = [("stall", 0)]
    site.forever.add("zip/box.zip")
    site.files["zip/box.zip"] = site.files["zip/two.zip"] = WHOLE
    scenes = [toy, evolve(toy, name="toys/two", folder=PurePosixPath("toys/two"), sources=("zip/two.zip",))]
    one, two = fetch(scenes, root, patience=SHORT)
    assert one.missing == NAMES
    assert "stalled" in one.reasons[0]
    assert two.missing == ()


def test_a_full_disk_ends_in_words_and_is_gone_on_with(site, toy: Download, tmp_path: Path) -> None:
    """A file system of 64 KiB; where none can be mounted, the limit of a file's size stands in (below)."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)], capture_output=True)
    if mounted.returncode:
        pytest.skip(f"no small file system can be mounted: {mounted.stderr.decode().strip()}")
    try:
        site.files["zip/box.zip"] = zipped(*PICTURES.items(), ("noise", rng.bytes(100_000)))
        full = bring(toy, disk / "data")
        assert full.missing == NAMES
        assert "there is no space left under" in full.reasons[-1]
        assert len(site.requests) == 1, "no other source is tried on a full disk"
        subprocess.run(["mount", "-o", "remount,size=1m", str(disk)], check=True)
        assert bring(toy, disk / "data").missing == ()
        assert inside(disk / "data") == PLACED
        assert site.requests[-1][1] is not None, "it went on from the part"
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_a_folder_that_cannot_be_made_ends_in_words(site, toy: Download, tmp_path: Path) -> None:
    site.files["zip/box.zip"] = WHOLE
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "toys").write_text("a file in the way")
    result = bring(toy, tmp_path / "data")
    assert result.missing == NAMES
    assert "toys" in result.reasons[-1]
    assert "cannot be written" in result.reasons[-1]


@pytest.mark.parametrize("mirror", ["", "ftp://host/", "file:///data", "localhost:8000", "http://", "https:///x"])
def test_what_is_no_mirror_is_refused(mirror: str) -> None:
    with pytest.raises(UserError, match=r"no address: write http://HOST/PATH/"):
        site_of(mirror)
    assert site_of("http://localhost:8000/x") == "http://localhost:8000/x/"
