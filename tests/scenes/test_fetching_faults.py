"""What is hostile, damaged, late, full or in the way while scenes are fetched."""

import errno
import fcntl
import re
import stat
import subprocess
import zipfile
from contextlib import ExitStack
from pathlib import Path, PurePosixPath
from urllib.parse import quote

import pytest
from attrs import evolve
from toy_downloads import (
    FOLDER,
    NAMES,
    OTHER,
    PICTURES,
    PLACED,
    SHORT,
    WHOLE,
    bring,
    inside,
    rng,
    zipped,
)

from matbench.files.locking import held
from matbench.scenes.dataset import Download
from matbench.scenes.fetching import fetch

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
    assert "cannot be used" in result.reasons[-1]


def test_where_another_fetch_is_under_way_this_one_waits_for_it(site, toy: Download, root: Path) -> None:
    site.files["zip/box.zip"] = WHOLE
    lock = root / ".fetch" / f"{quote(str(FOLDER), safe='')}.lock"
    lock.parent.mkdir(parents=True)
    other, told = ExitStack(), []
    other.enter_context(held(lock))

    def listen(event: str, *_: object) -> None:
        told.append(event)
        if event == "waiting":
            assert not site.requests
            other.close()

    assert bring(toy, root, listen=listen).came == NAMES
    assert told.count("waiting") == 1


def test_where_nothing_can_be_locked_it_is_said_and_the_scene_comes(
    site, toy: Download, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Simulated: the answer of a file system without locks."""

    def none(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", none)
    site.files["zip/box.zip"] = WHOLE
    with pytest.warns(UserWarning, match="nothing can be locked under"):
        assert bring(toy, root).came == NAMES
