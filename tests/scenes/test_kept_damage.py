"""Computed scenes kept on disk: what is damaged is made again, and where nothing can be written nothing is kept."""

import os
import resource
import shutil
import signal
import socket
from collections.abc import Callable
from pathlib import Path

import pytest
from forking import in_child
from keeping import KEY, got, held, keys, scene_of

from matbench.scenes import kept
from matbench.scenes.packed import packed

pytestmark = pytest.mark.usefixtures("there")
MIB = 1 << 20


def cut(size: int) -> Callable[[Path], object]:
    return lambda place: place.write_bytes(place.read_bytes()[:size])


def flipped(at: int) -> Callable[[Path], object]:
    def damage(place: Path) -> None:
        content = bytearray(place.read_bytes())
        content[at] ^= 4
        place.write_bytes(content)

    return damage


def replaced(make: Callable[[Path], object]) -> Callable[[Path], object]:
    def damage(place: Path) -> None:
        place.unlink()
        make(place)

    return damage


def a_link(place: Path) -> None:
    elsewhere = place.with_name("elsewhere")
    shutil.copy(place, elsewhere)
    place.unlink()
    place.symlink_to(elsewhere)


def a_socket(place: Path) -> None:
    with socket.socket(socket.AF_UNIX) as one:
        os.chdir(place.parent)  # names of sockets are short
        one.bind(place.name)


DAMAGE: dict[str, Callable[[Path], object]] = {
    "empty": cut(0),
    "within the seal": cut(20),
    "nothing but the seal": cut(64),
    "half": cut(400),
    "the last byte": cut(-1),
    "seal": flipped(3),
    "line": flipped(120),
    "truth": flipped(600),
    "last": flipped(-1),
    "garbage": lambda place: place.write_bytes(os.urandom(5000)),
    "a pickle": lambda place: place.write_bytes(b"cos\nsystem\n(S'touch pwned'\ntR."),
    "another scene": lambda place: place.write_bytes(packed(scene_of(2), keys(1)[0])),
    "far too much": lambda place: os.truncate(place, 13 * MIB),
    "a link": a_link,
    "a link to itself": replaced(lambda place: place.symlink_to(place)),
    "a link to nothing": replaced(lambda place: place.symlink_to("missing")),
    "a pipe": replaced(os.mkfifo),
    "a socket": replaced(a_socket),
}


@pytest.mark.parametrize("what", DAMAGE)
def test_what_is_damaged_is_made_again_and_replaced(
    what: str, there: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(there.parents[2])
    assert not got()
    DAMAGE[what](there / f"{KEY}.scene")
    assert [got(), got()] == [False, True]
    assert capfd.readouterr() == ("", "")
    assert (there / f"{KEY}.scene").is_file()
    assert not (there / f"{KEY}.scene").is_symlink()
    assert not Path("pwned").exists()


def test_what_a_link_names_is_left_alone(there: Path) -> None:
    assert not got()
    a_link(there / f"{KEY}.scene")
    (there / "elsewhere").write_text("the user's")
    assert not got()
    assert (there / "elsewhere").read_text() == "the user's"


def test_another_user_s_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not got()
    user = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: user + 1)
    assert not got()


def test_a_folder_in_its_place_stays(there: Path) -> None:
    (there / f"{KEY}.scene" / "mine").mkdir(parents=True)
    assert [got(), got()] == [False, False]
    assert held(there) == {f"{KEY}.scene"}, "and no draft"


def test_what_may_not_be_read_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not got()

    def forbidden(path: Path, **_: object) -> None:  # root may read everything
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(kept, "open_plain", forbidden)
    assert not got()


@pytest.mark.parametrize("level", [0, 1, 2])
def test_where_no_folder_can_be_made_nothing_is_kept(
    level: int, there: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    place = [there, *there.parents][level]
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text("a file")
    assert [got(), got()] == [False, False]
    assert place.read_text() == "a file"
    assert capfd.readouterr() == ("", "")


def test_what_cannot_be_written_as_a_whole_leaves_nothing(there: Path) -> None:
    def limited() -> list[bool]:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))
        return [got(), got()]

    assert in_child(limited) == [False, False]
    assert held(there) == set()


def test_a_disk_that_is_nearly_full_is_left_to_others(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    size, block = len(packed(scene_of(1), KEY)), 4096
    for free, is_kept in ((kept._FREE + size - block, False), (kept._FREE + size + block, True)):
        facts = os.statvfs_result((block, block, 1 << 40, 1 << 40, free // block, 0, 0, 0, 0, 255))
        monkeypatch.setattr(os, "statvfs", lambda _, facts=facts: facts)
        assert not got()
        assert got() is is_kept
