"""The process that reads a scene for one that may not see its truth."""

from pathlib import Path

import pytest
from shown import OWN_FILES
from typing_commands import SMALL

from matbench import load_scene
from matbench.scenes import views_only
from matbench.scenes.reader import main


def test_views_are_written(tmp_path: Path) -> None:
    main(str(tmp_path / "views.npz"), SMALL)
    read = views_only.read_views(tmp_path / "views.npz")
    assert read.digest == views_only.without_truth(load_scene(SMALL)).digest
    assert not read.truth


def test_scenes_of_a_persons_own_files_are_found(tmp_path: Path) -> None:
    (tmp_path / "walls.py").write_text(OWN_FILES["walls.py"])
    with pytest.raises(SystemExit, match="unknown dataset 'walls'"):
        main(str(tmp_path / "views.npz"), "walls/near")
    assert not (tmp_path / "views.npz").exists()
    main(str(tmp_path / "views.npz"), "walls/near", "", str(tmp_path / "walls.py"))
    assert views_only.read_views(tmp_path / "views.npz").name == "walls/near"


def test_a_folder_that_is_missing_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as said:
        main(str(tmp_path / "views.npz"), "middlebury2003/teddy", str(tmp_path / "none"))
    assert str(tmp_path / "none") in str(said.value)
    assert "\n" not in str(said.value)
