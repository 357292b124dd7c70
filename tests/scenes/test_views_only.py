"""What a method may see of a scene, on its way between processes."""

from pathlib import Path

import numpy as np
import pytest

from matbench import load_scene
from matbench.errors import UserError
from matbench.scenes import views_only


def test_what_is_written_is_read_back_without_truth(tmp_path: Path) -> None:
    scene = load_scene("synthetic/spheres[size=96x72 predict=right]")
    assert scene.truth
    assert scene.held_out is not None
    views_only.write_views(scene, tmp_path / "views.npz")
    seen = views_only.read_views(tmp_path / "views.npz")
    assert seen.digest == scene.digest
    assert (seen.name, seen.labels, seen.pair_steps) == (scene.name, scene.labels, scene.pair_steps)
    assert not seen.truth
    assert not seen.regions
    assert not seen.visible
    assert seen.held_out is None
    with np.load(tmp_path / "views.npz") as arrays:
        assert sorted(arrays.files) == ["facts", "views"]


def test_a_process_that_runs_methods_loads_views_only(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = load_scene("synthetic/box[size=48x36]")
    monkeypatch.setenv(views_only.VARIABLE, "1")
    seen = load_scene("synthetic/box[size=48x36]")
    assert seen.digest == whole.digest
    assert whole.truth
    assert not seen.truth
    with pytest.raises(UserError, match="unknown scene 'bxo' of synthetic"):
        load_scene("synthetic/bxo")


def test_a_reader_that_cannot_even_speak_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.executable", "/bin/false")
    with pytest.raises(UserError, match="reading synthetic/box ended with status 1"):
        views_only.from_another_process("synthetic/box", None)
