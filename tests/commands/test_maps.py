"""`matbench maps check`."""

from pathlib import Path

import numpy as np
import pytest
from typing_commands import run as matbench

from matbench import load_scene


def test_scenes_are_found_and_measured(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for name, factor in (("box", 1), ("curved", 256)):
        scene = load_scene(f"synthetic/{name}")
        np.save(tmp_path / f"{name}.npy", scene.truth[scene.ref] * scene.pair_steps * factor)
    status, said, _ = matbench(capsys, "maps", "check", str(tmp_path), "-s", "synthetic/box")
    assert status == 0
    assert "✓ synthetic/box: box.npy: 0.0 % of the pixels" in said
    assert "1 of 1 scenes have a map; no problems" in said
    scenes = ["synthetic/box", "synthetic/curved", "synthetic/thin"]
    status, said, _ = matbench(capsys, "maps", "check", str(tmp_path), "-s", *scenes)
    assert status == 1
    assert "with scale=256" in said
    assert "✗ synthetic/thin" in said
    assert "no map of synthetic/thin" in said
    assert "2 of 3 scenes have a map; 2 problems" in said
    status, _, _ = matbench(capsys, "maps", "check", str(tmp_path), "-s", "synthetic/curved", "--scale", "256")
    assert status == 0


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--scale", "0"], "--scale 0"),
        (["--scale", "inf"], "--scale inf is not above 0 and finite"),
        (["--scale", "nan"], "--scale nan is not above 0 and finite"),
        (["--unknown", "inf"], "--unknown inf is not finite"),
        (["--sign", "2"], "--sign 2"),
        (["--unit", "mile"], "mile"),
    ],
)
def test_wrong_options_are_one_line(
    more: list[str], said: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    status, _, error = matbench(capsys, "maps", "check", str(tmp_path), "-s", "synthetic/box", *more)
    assert status == 2
    assert said in error
    assert error.count("\n") == 1


def test_a_folder_that_is_not_there_is_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, _, error = matbench(capsys, "maps", "check", str(tmp_path / "none"), "-s", "synthetic/box")
    assert status == 2
    assert "does not exist" in error
