"""Computed scenes kept on disk: how much room they take."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from keeping import KEY, got, held, keys, scene_of

from matbench.scenes import kept
from matbench.scenes.packed import packed

pytestmark = pytest.mark.usefixtures("there")
MIB = 1 << 20


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


def test_what_another_process_removes_meanwhile_is_gone(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known = many(8, there, monkeypatch)
    listed, remove = os.scandir, kept._removed

    @contextmanager
    def removed_when_listed(place: Path) -> Iterator[list[os.DirEntry[str]]]:
        with listed(place) as entries:
            every = list(entries)
        (there / f"{known[3]}.scene").unlink()
        yield every

    def removed_twice(path: str) -> bool:
        return remove(path) and remove(path)

    monkeypatch.setattr(os, "scandir", removed_when_listed)
    assert not got(20, f"{20:064x}")
    monkeypatch.setattr(os, "scandir", listed)
    assert numbers(there) == [0, 1, 2, 4, 5, 6, 7, 20], "there was room already"
    monkeypatch.setattr(kept, "_removed", removed_twice)
    assert not got(21, f"{21:064x}")
    assert numbers(there) == [1, 2, 4, 5, 6, 7, 20, 21]


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
