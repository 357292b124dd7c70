"""Where a person's scenes and compiled kernels lie, and what is said where there is no such place."""

import subprocess
import sys
from pathlib import Path

import pytest

from matbench.errors import UserError
from matbench.files.own_folders import cache_folder, data_folder, expanded

FOLDERS = [(data_folder, "XDG_DATA_HOME", ".local/share"), (cache_folder, "XDG_CACHE_HOME", ".cache")]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have other folders")
@pytest.mark.parametrize(("folder", "variable", "usual"), FOLDERS)
def test_below_home_or_where_the_variable_says(folder, variable, usual, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv(variable, raising=False)
    assert folder() == tmp_path / usual / "matbench"
    monkeypatch.setenv(variable, str(tmp_path / "elsewhere"))
    assert folder() == tmp_path / "elsewhere" / "matbench"


@pytest.mark.parametrize(("folder", "variable"), [one[:2] for one in FOLDERS])
def test_without_a_home_it_is_said_what_to_set(homeless, folder, variable, tmp_path: Path, monkeypatch) -> None:
    with pytest.raises(UserError, match=f"no home folder: .*set HOME,? or {variable}"):
        folder()
    monkeypatch.setenv(variable, str(tmp_path))
    assert folder() == tmp_path / "matbench"


def test_a_home_that_is_not_known_is_told(homeless, tmp_path: Path) -> None:
    assert expanded(tmp_path) == tmp_path
    for path in ("~/scenes", "~nobody-of-that-name/scenes"):
        with pytest.raises(UserError, match=f"'{path}': there is no such home folder; write the whole path"):
            expanded(path)


HOMELESS = """
import pwd, sys
def unknown(_):
    raise KeyError
pwd.getpwuid = unknown
from matbench.cli import main
main(sys.argv[1:])
"""


LINES = [["fetch", "middlebury2003/teddy", "--dry-run"], ["fetch", "paper", "--data", "~/x"], ["list", "--data", "~/x"]]


@pytest.mark.parametrize("line", LINES)
def test_commands_say_it_in_one_line(line: list[str], tmp_path: Path) -> None:
    command = [sys.executable, "-c", HOMELESS, *line]
    done = subprocess.run(command, env={"PATH": "/usr/bin:/bin"}, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    assert "home folder" in done.stderr
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have other folders")
def test_a_home_that_is_no_absolute_path_is_as_good_as_none(tmp_path: Path) -> None:
    """Libraries would make a folder of that name wherever one works: matplotlib does."""
    done = subprocess.run(
        [sys.executable, "-c", AND_THEN],
        env={"PATH": "/usr/bin:/bin", "HOME": "relative"},
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert list(tmp_path.iterdir()) == []


AND_THEN = """
from matbench.cli import main
try:
    main(["list", "--json"])
finally:
    import matplotlib
    matplotlib.get_configdir()
"""


def test_a_folder_that_is_no_absolute_path_is_refused(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("platformdirs.user_cache_path", lambda *_, **__: Path("relative/.cache/matbench"))
    with pytest.raises(UserError, match=r"'relative/.cache/matbench' is no absolute path, .*: set HOME"):
        cache_folder()
