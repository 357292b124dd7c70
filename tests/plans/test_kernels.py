"""Where compiled kernels are kept: below the person's cache, or in a temporary folder, and what is said of it."""

import resource
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import pytest
from forking import in_child

from matbench.files import temporary
from matbench.plans import kernels
from matbench.plans.plugins import kernel_cache


@pytest.fixture(autouse=True)
def nothing_handed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(kernels.VARIABLE, raising=False)


def said_and_found() -> list[str]:
    """What is warned of when a place is asked for twice, and the two places."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        places = [str(kernels.place("abc")), str(kernels.place("def"))]
    return [str(one.message) for one in told] + places


def test_kernels_lie_below_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert kernel_cache().parent == tmp_path / "matbench" / "kernels"
    assert list(kernel_cache().iterdir()) == [], "trying it out leaves nothing"
    assert kernels.aside() is None


def test_what_was_found_by_the_process_above_is_taken_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "own"))
    (tmp_path / "abc").mkdir()
    monkeypatch.setenv(kernels.VARIABLE, str(tmp_path / "abc"))
    assert kernels.place("abc") == tmp_path / "abc"
    assert kernels.place("def") == tmp_path / "own" / "matbench" / "kernels" / "def", "it is of other code"


def test_without_a_home_they_are_kept_as_long_as_the_process_lives(homeless: None) -> None:
    said, *places = in_child(said_and_found)
    assert said == (
        "compiled kernels are not kept, each run compiles its own: "
        "there is no home folder: set HOME, or XDG_CACHE_HOME to the absolute path of a folder"
    )
    assert [Path(place).name for place in places] == ["abc", "def"]
    assert len({Path(place).parent for place in places}) == 1
    code = "from matbench.plans import kernels; print(kernels.place('abc').parent)"
    unusable = {"HOME": "/proc", "PATH": "/usr/bin:/bin"}
    done = subprocess.run([sys.executable, "-c", code], env=unusable, capture_output=True, text=True, check=True)
    assert "/proc/.cache" in done.stderr
    assert not Path(done.stdout.strip()).exists(), "it goes when the process ends"


def test_those_of_a_killed_process_are_removed_by_the_next_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code = "import os; from matbench.plans import kernels; kernels.place('abc'); os.kill(os.getpid(), 9)"
    unusable = {"HOME": "/proc", "PATH": "/usr/bin:/bin", "TMPDIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], env=unusable, capture_output=True, check=False)
    assert len(list(tmp_path.iterdir())) == 1
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    temporary.sweep()
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_noticed_before_anything_is_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A limit on the size of files stands for the disk: the system refuses to write as it would there."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    def act() -> list[str]:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))
        return said_and_found()

    said, *places = in_child(act)
    assert said.startswith("compiled kernels are not kept, each run compiles its own: ")
    assert "File too large" in said
    assert not any(Path(place).is_relative_to(tmp_path) for place in places)


def test_a_file_where_the_folder_would_be_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    said, *_ = in_child(said_and_found)
    assert f"{tmp_path / 'file'}" in said
    assert "Not a directory" in said
