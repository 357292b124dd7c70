"""What a method told, on its way to the process that writes the recording."""

import json
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from matbench import load_scene
from matbench.algorithm import Context
from matbench.algorithms.materiality import Materiality
from matbench.plans.record_option import RecordOption
from matbench.recording import told
from matbench.recording.probe import CapturingProbe


def same(one: Any, other: Any) -> bool:
    """Are two values alike down to every bit of their arrays?"""
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=True)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if type(one) is not type(other):
        return False
    if attrs.has(type(one)):
        return all(same(getattr(one, field.name), getattr(other, field.name)) for field in attrs.fields(type(one)))
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    return bool(one == other)


@pytest.fixture(scope="module")
def heard() -> told.Told:
    scene = load_scene("synthetic/box[size=48x36]")
    probe = CapturingProbe(RecordOption(rows=(5, 20)).at(scene.height))
    estimate = Materiality(optimiser="fista", passes=4, views=3).solve(scene, Context(probe=probe))
    return told.Told(probe, estimate)


def test_what_is_written_is_read_back(heard: told.Told, tmp_path: Path) -> None:
    told.write_told(tmp_path / "told.npz", heard)
    again = told.read_told(tmp_path / "told.npz")
    assert same(again, heard)
    assert len(again.probe.frames) == len(heard.probe.frames) > 1
    assert same(again.probe.frames, heard.probe.frames)


def test_anything_else_is_refused(heard: told.Told, tmp_path: Path) -> None:
    path = tmp_path / "told.npz"
    path.write_bytes(b"no archive")
    with pytest.raises(ValueError, match="cannot be read"):
        told.read_told(path)
    facts: dict[str, Any] = {"probe": {}, "estimate": {"disparity": {"0": "array_7"}}}
    np.savez(path, facts=np.array(json.dumps(facts)))
    with pytest.raises(ValueError, match="cannot be read"):
        told.read_told(path)
    np.savez(path, facts=np.array([{"an": "object"}], object))  # numpy would have to unpickle it
    with pytest.raises(ValueError, match="cannot be read"):
        told.read_told(path)
