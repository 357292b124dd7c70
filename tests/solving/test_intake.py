"""What a method's process has left is not believed."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from matbench import load_scene
from matbench.runs.outcome import Outcome
from matbench.solving import intake
from matbench.solving.worker import OUTCOME

SCENE = load_scene("synthetic/box[size=48x36]")


def test_plain_files_are_copied(tmp_path: Path) -> None:
    source, target = tmp_path / "a", tmp_path / "b"
    source.write_bytes(b"x" * 3_000_000)
    assert intake.take(source, target)
    assert target.read_bytes() == source.read_bytes()
    assert target.stat().st_ino != source.stat().st_ino
    assert not intake.take(tmp_path / "none", tmp_path / "c")


@pytest.mark.parametrize("kind", ["link", "pipe", "folder", "large"])
def test_other_files_are_refused_at_once(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = tmp_path / "a"
    if kind == "link":
        source.symlink_to("/etc/hostname")
    elif kind == "pipe":
        os.mkfifo(source)
    elif kind == "folder":
        source.mkdir()
    else:
        monkeypatch.setattr(intake, "_MOST_FILE", 10)
        source.write_bytes(b"x" * 11)
    with pytest.raises((ValueError, OSError)):
        intake.take(source, tmp_path / "b")
    assert not (tmp_path / "b").exists()


@pytest.mark.parametrize(
    "said", ["", "[]", "{}", '{"status": "splendid"}', '{"status": "ok", "seconds": "soon"}', "[" * 100_000]
)
def test_an_outcome_that_is_none_is_refused(said: str, tmp_path: Path) -> None:
    (tmp_path / OUTCOME).write_text(said)
    with pytest.raises(ValueError, match=r"."):
        intake.outcome(tmp_path)


def test_an_outcome_is_read(tmp_path: Path) -> None:
    (tmp_path / OUTCOME).write_text(json.dumps({"status": "ok", "seconds": 0.5, "work": {"passes": 3}}))
    assert intake.outcome(tmp_path) == Outcome("ok", 0.5, work={"passes": 3})


def test_maps_must_be_those_of_the_scene(tmp_path: Path) -> None:
    path = tmp_path / "maps.npz"
    right = np.zeros((36, 48), np.float32)
    np.savez(path, view_2=right)
    assert list(intake.maps(path, SCENE)) == [2] == [SCENE.ref]
    for arrays in ({"view_1": right}, {"view_2": right[1:]}, {"view_2": right, "view_9": right}):
        np.savez(path, **arrays)
        with pytest.raises(ValueError, match="view"):
            intake.maps(path, SCENE)


@pytest.mark.parametrize(("inside", "outside", "believed"), [(1.0, 1.02, 1.0), (0.0, 1.0, 1.0), (3.0, 1.0, 1.0)])
def test_seconds_are_believed_where_two_clocks_agree(inside: float, outside: float, believed: float) -> None:
    found = intake.corrected(Outcome("ok", inside), outside)
    assert found.seconds == believed
    assert bool(found.doubt) == (inside != believed)


def test_a_file_is_copied_and_not_moved(tmp_path: Path) -> None:
    source, target = tmp_path / "log.txt", tmp_path / "taken"
    content = np.random.default_rng(0).bytes((1 << 20) + 17)
    source.write_bytes(content)
    with source.open("r+b") as held:  # by whoever made it
        assert intake.take(source, target)
        held.write(b"changed later")
    assert target.read_bytes() == content
    assert not intake.take(tmp_path / "none", tmp_path / "other")
    with pytest.raises(FileExistsError):
        intake.take(source, target)
