"""Computed scenes kept on disk: what they are known by, damage, room, and many processes at once."""

import os
import platform
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from types import SimpleNamespace

import llvmlite
import numba
import numpy as np
import pytest
import scipy
from forking import in_child
from typing_commands import SMALL, run

import matbench
from matbench.errors import UserError
from matbench.files import writing
from matbench.scene import Range, Scene
from matbench.scenes import kept
from matbench.scenes.packed import packed, unpacked

KEY = "5" * 64
MIB = 1 << 20


@pytest.fixture(autouse=True)
def there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where scenes are kept in this test; 100 MiB of them."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv(kept.VARIABLE, "100")
    return tmp_path / "cache" / "matbench" / "scenes"


def scene_of(number: int, height: int = 6) -> Scene:
    rng = np.random.default_rng(number)
    views = rng.integers(0, 256, (2, height, 8, 3), np.uint8)
    truth = rng.random((height, 8), np.float32)
    return Scene(f"toy/{number}", views, ("0", "1"), 0, Range(0, 4), {0: truth}, 1, {"all": truth > 0.5})


def got(number: int = 1, key: str = KEY, height: int = 6) -> bool:
    """Is a scene read, and not made? Either way it must be the right one."""
    made = []

    def make() -> Scene:
        made.append(number)
        return scene_of(number, height)

    found, wanted = kept.scene(key, make), scene_of(number, height)
    assert (found.name, found.digest, found.truth_digest) == (wanted.name, wanted.digest, wanted.truth_digest)
    return not made


def keys(count: int) -> list[str]:
    return [f"{number:064x}" for number in range(count)]


def held(there: Path) -> set[str]:
    return {path.name for path in there.iterdir()}


# what is kept


def test_it_is_made_once_and_then_read(there: Path) -> None:
    assert [got(), got(), got()] == [False, True, True]
    assert held(there) == {f"{KEY}.scene"}
    assert unpacked((there / f"{KEY}.scene").read_bytes(), KEY).digest == scene_of(1).digest
    assert there.stat().st_mode & 0o777 == 0o700


def test_another_process_reads_it() -> None:
    assert not got()
    assert in_child(got)


def test_each_has_its_own() -> None:
    one, other = keys(2)
    assert [got(1, one), got(2, other), got(1, one), got(2, other)] == [False, False, True, True]


def test_what_is_made_from_nobody_knows_what_is_not_kept(there: Path) -> None:
    assert kept.scene(None, lambda: scene_of(1)).digest == scene_of(1).digest
    assert not there.exists()


def test_with_no_room_nothing_is_written_or_read(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kept.VARIABLE, "0")
    assert not got()
    assert not there.exists()
    monkeypatch.setenv(kept.VARIABLE, "100")
    assert [got(), got()] == [False, True]
    monkeypatch.setenv(kept.VARIABLE, "0")
    assert not got()


def test_without_a_home_nothing_is_kept(homeless: None) -> None:
    assert kept.folder() is None
    assert [got(), got()] == [False, False]


def test_by_default_it_is_a_gibibyte(monkeypatch: pytest.MonkeyPatch) -> None:
    for told in (None, ""):
        monkeypatch.delenv(kept.VARIABLE) if told is None else monkeypatch.setenv(kept.VARIABLE, told)
        assert kept.room() == 1 << 30


@pytest.mark.parametrize("told", ["a lot", "-1", "1.5", "1G", "９", "9999999999", " 1"])
def test_what_is_no_number_is_told_in_one_line(
    told: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(kept.VARIABLE, told)
    with pytest.raises(UserError, match="it must be a whole number of MiB"):
        got()
    status, _, said = run(capsys, "scene", "show", SMALL)
    assert status == 2
    assert said.splitlines() == [
        f"matbench: MATBENCH_CACHE_MB is {told!r}: it must be a whole number of MiB; 0 keeps no computed scenes"
    ]


# what it is known by


@pytest.fixture
def sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Path]]:
    """Two files that are as old as this process."""
    for name in ("a.py", "b.json"):
        (tmp_path / name).write_text(name)
    monkeypatch.setattr(matbench, "_LOADED", time.time() + 3600)
    anew()
    yield [tmp_path / "a.py", tmp_path / "b.json"]
    anew()


def anew() -> None:
    """As in a new process."""
    for cached in (kept._digest, kept._libraries, kept._processor):
        cached.cache_clear()


def test_the_same_question_has_the_same_key(sources: list[Path]) -> None:
    key = kept.key(sources, "world", {"seed": "7", "noise": "1"})
    assert key is not None
    assert len(key) == 64
    assert key == kept.key(list(sources), "world", {"noise": "1", "seed": "7"})
    code = (
        "import time, sys, matbench; matbench._LOADED = time.time() + 3600\n"
        "from pathlib import Path; from matbench.scenes import kept\n"
        "print(kept.key([Path(name) for name in sys.argv[1:]], 'world', {'seed': '7', 'noise': '1'}))"
    )
    for seed in ("1", "2"):
        line = [sys.executable, "-c", code, *map(str, sources)]
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        assert subprocess.run(line, env=environment, capture_output=True, text=True).stdout.strip() == key


def changed_source(number: int) -> Callable[[pytest.MonkeyPatch, list[Path]], None]:
    def change(_: pytest.MonkeyPatch, sources: list[Path]) -> None:
        sources[number].write_text(sources[number].read_text() + " ")

    return change


def changed(owner: object, name: str, value: object) -> Callable[[pytest.MonkeyPatch, list[Path]], None]:
    return lambda patch, _: patch.setattr(owner, name, value)


class Features:
    def flatten(self) -> str:
        return "+mmx"


CHANGES = {
    "first source": changed_source(0),
    "last source": changed_source(1),
    "a source more": lambda _, sources: sources.append(sources[0]),
    "a source less": lambda _, sources: sources.pop(),
    "a source is called otherwise": lambda _, sources: sources.append(sources.pop().rename("b2.json")),
    "format": changed(kept, "FORMAT", 0),
    "Python": changed(sys, "version", "3.99"),
    "NumPy": changed(np, "__version__", "0"),
    "SciPy": changed(scipy, "__version__", "0"),
    "numba": changed(numba, "__version__", "0"),
    "llvmlite": changed(llvmlite, "__version__", "0"),
    "architecture": changed(platform, "machine", lambda: "sparc"),
    "processor": changed(llvmlite.binding, "get_host_cpu_name", lambda: "z80"),
    "what it can do": changed(llvmlite.binding, "get_host_cpu_features", lambda: Features()),
    "mathematical functions": changed(os, "confstr", lambda _: "glibc 1"),
    "without compilation": changed(numba.config, "DISABLE_JIT", 1),
    "compiled for another": changed(numba.config, "CPU_NAME", "generic"),
    "compiled without": changed(numba.config, "CPU_FEATURES", "-avx512f"),
    "optimized less": changed(numba.config, "OPT", 0),
    "NumPy without": lambda patch, _: patch.setenv("NPY_DISABLE_CPU_FEATURES", "AVX2"),
}


@pytest.mark.parametrize("what", CHANGES)
def test_whatever_changes_the_key_changes(
    what: str, sources: list[Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    before = kept.key(sources, "world", {})
    anew()
    assert kept.key(sources, "world", {}) == before
    anew()
    CHANGES[what](monkeypatch, sources)
    after = kept.key(sources, "world", {})
    assert after is not None
    assert after != before


@pytest.mark.parametrize("asked", [("other", {}), ("world", {"seed": "7"}), ("world",), ("worl", "d", {})])
def test_another_question_has_another_key(asked: tuple[object, ...], sources: list[Path]) -> None:
    assert kept.key(sources, *asked) != kept.key(sources, "world", {})


def test_code_that_has_changed_since_it_was_loaded_is_not_known(
    sources: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What runs is then older than what lies there: kept under the new code's key, it would be a stale answer."""
    assert kept.key(sources) is not None
    began = max(source.stat().st_ctime for source in sources) + 1
    monkeypatch.setattr(matbench, "_LOADED", began)
    assert kept.key(sources) is not None
    while time.time() < began:
        time.sleep(0.05)
    sources[1].write_text("new")
    os.utime(sources[1], (0, 0))  # a copy may claim to be as old as the original
    assert kept.key(sources) is None


def test_a_source_that_is_not_there_is_not_known(sources: list[Path]) -> None:
    assert kept.key([*sources, sources[0].with_name("missing.py")]) is None


# damage


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


# where nothing can be written


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


# room


def many(count: int, there: Path, monkeypatch: pytest.MonkeyPatch, megabytes: int = 2) -> list[str]:
    """Scenes of a quarter MiB and less, of which eight have room in 2 MiB; all last used days ago, the first first."""
    monkeypatch.setenv(kept.VARIABLE, str(megabytes))
    for number, key in enumerate(keys(count)):
        assert not got(number, key)
        os.utime(there / f"{key}.scene", (1e9 + number, 1e9 + number))
    return keys(count)


def numbers(there: Path) -> list[int]:
    return sorted(int(path.name.partition(".")[0], 16) for path in there.glob("*.scene"))


def test_those_used_least_recently_make_room(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known = many(8, there, monkeypatch)
    assert numbers(there) == list(range(8))
    assert got(0, known[0]), "it is now the one used last"
    assert not got(20, f"{20:064x}")
    assert numbers(there) == [0, 2, 3, 4, 5, 6, 7, 20]
    assert not got(21, f"{21:064x}")
    assert numbers(there) == [0, 3, 4, 5, 6, 7, 20, 21]


def test_what_was_used_within_the_hour_stays(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of twelve scenes, run after run, eight are read: else none would be."""
    monkeypatch.setenv(kept.VARIABLE, "2")
    for _ in range(3):
        read = [got(number, key) for number, key in enumerate(keys(12))]
    assert read == [True] * 8 + [False] * 4
    hours_ago = time.time() - 3700
    os.utime(there / f"{keys(12)[3]}.scene", (hours_ago, hours_ago))
    assert not got(11, keys(12)[11])
    assert numbers(there) == [0, 1, 2, 4, 5, 6, 7, 11]


def test_what_claims_to_be_used_in_the_future_does_not_stay_for_ever(
    there: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for key in many(8, there, monkeypatch):
        os.utime(there / f"{key}.scene", (4e9, 4e9))
    assert not got(20, f"{20:064x}")
    assert 20 in numbers(there)
    assert len(numbers(there)) == 8


def test_less_room_holds_at_once(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    many(8, there, monkeypatch)
    for number, key in enumerate(keys(8)):
        os.utime(there / f"{key}.scene", (time.time() + number - 60, time.time() + number - 60))
    monkeypatch.setenv(kept.VARIABLE, "1")
    assert not got(20, f"{20:064x}")
    assert numbers(there) == [4, 5, 6, 7], "all were used just now, so none goes for another"


def test_a_scene_counts_by_its_size(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kept.VARIABLE, "8")
    large = 10_000  # rows: 0.8 MB
    assert 11 * len(packed(scene_of(1, large), KEY)) > 8 * MIB > 10 * len(packed(scene_of(1, large), KEY))
    for number, key in enumerate(keys(12)):
        assert not got(number, key, large)
        os.utime(there / f"{key}.scene", (1e9 + number, 1e9 + number))
    assert numbers(there) == list(range(2, 12))
    assert sum(path.stat().st_size for path in there.iterdir()) < 8 * MIB


def test_one_that_takes_more_than_its_share_is_not_kept(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kept.VARIABLE, "2")
    rows = next(rows for rows in range(2900, 3300) if len(packed(scene_of(1, rows), KEY)) > 2 * MIB // 8)
    assert [got(1, KEY, rows), got(1, KEY, rows)] == [False, False]
    assert not there.exists()
    assert [got(1, KEY, rows - 1), got(1, KEY, rows - 1)] == [False, True]


def test_what_is_not_ours_stays(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there.mkdir(parents=True)
    others = {"notes.txt", "0.scene", f"{KEY}.scene~", f".{KEY}.scene", f"{KEY.upper()}a.scene"}
    for name in others:
        (there / name).write_bytes(bytes(3 * MIB))
        os.utime(there / name, (1, 1))
    (there / f"{'6' * 64}.scene").mkdir()
    (there / f"{'6' * 64}.scene" / "mine").touch()
    os.utime(there / f"{'6' * 64}.scene", (1, 1))
    known = many(9, there, monkeypatch)
    assert others < held(there)
    assert (there / f"{'6' * 64}.scene" / "mine").exists()
    assert {f"{key}.scene" for key in known[2:]} < held(there)
    assert f"{known[1]}.scene" not in held(there), "a folder that cannot be removed takes room, too"


# many processes, and such as are killed


def in_turn(first: int) -> int:
    """Get forty scenes three times, beginning with another one; how often one was read."""
    order = [(first + number) % 40 for number in range(40)] * 3
    return sum(got(number, f"{number:064x}", 50 + number) for number in order)


def test_many_processes_get_what_is_right(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kept.VARIABLE, "5")  # half of them
    with ProcessPoolExecutor(4, get_context("fork")) as pool:
        read = list(pool.map(in_turn, [0, 0, 20, 33]))
    assert sum(read) > 40
    for path in there.iterdir():
        number = int(path.stem, 16)
        assert unpacked(path.read_bytes(), path.stem).digest == scene_of(number, 50 + number).digest
    assert len(held(there)) <= 20 + 4, "each may write one more, as it does not know of the others'"


@contextmanager
def killed_within(count: int, path: Path, settled: bool) -> Iterator[SimpleNamespace]:
    """A draft whose process is killed when so many bytes are written."""
    with writing.drafted(path, settled=settled) as file:

        def write(content: bytes) -> None:
            file.write(content[:count])
            file.flush()
            os.kill(os.getpid(), signal.SIGKILL)

        yield SimpleNamespace(write=write)


@pytest.mark.parametrize("written", [0, 100, None])
def test_a_process_that_is_killed_leaves_nothing_that_is_read(written: int | None, there: Path) -> None:
    pid = os.fork()
    if not pid:
        with suppress(BaseException):
            if written is None:  # the draft is whole, but not yet in its place
                writing.move = lambda *_: os.kill(os.getpid(), signal.SIGKILL)  # type: ignore[assignment]
            else:
                kept.drafted = partial(killed_within, written)  # type: ignore[assignment]
            kept.scene(KEY, lambda: scene_of(1))
        os._exit(1)
    assert os.waitpid(pid, 0)[1] == signal.SIGKILL
    (left,) = there.iterdir()
    assert left.name.startswith(f".{KEY}.scene.")
    assert [got(), got()] == [False, True]
    assert left.exists(), "it may be another process's, who is at it"
    os.utime(left, (1e9, 1e9))
    assert not got(2, keys(1)[0])
    assert held(there) == {f"{KEY}.scene", f"{keys(1)[0]}.scene"}
