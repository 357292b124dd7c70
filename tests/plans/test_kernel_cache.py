"""numba's cache is a comfort: damaged, full, read-only or absent, kernels give the right numbers."""

import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numba
import pytest
from places import ROOT

from matbench.plans import kernel_cache

TEXT = """
from numba import njit

@njit(cache=True)
def twice(x):
    return 2 * x
"""


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "kernels").mkdir()
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "kernels"))
    (tmp_path / "made.py").write_text(TEXT)
    return tmp_path


def hits(place: Path) -> int:
    """How often a kernel came from the cache, in a module imported anew; its answer is right in any case."""
    spec = importlib.util.spec_from_file_location("made", place / "made.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.twice(21) == 42
    return sum(module.twice.stats.cache_hits.values())


def files(place: Path, ending: str) -> list[Path]:
    return sorted(place.glob(f"kernels/*/*{ending}"))


def test_a_kernel_is_compiled_once(place: Path) -> None:
    assert hits(place) == 0
    assert len(files(place, ".nbi")) == len(files(place, ".nbc")) == 1
    assert hits(place) == 1


def flipped(content: bytes, at: int) -> bytes:
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "emptied": lambda content: b"",
    "halved": lambda content: content[: len(content) // 2],
    "zeros": lambda content: bytes(len(content)),
    "text": lambda content: b"not a pickle",
    "first bit": lambda content: flipped(content, 0),
    "middle bit": lambda content: flipped(content, len(content) // 2),
    "bit of the digest": lambda content: flipped(content, len(content) - 1),
    "without its digest": lambda content: content[:-1],
}


@pytest.mark.parametrize("ending", [".nbi", ".nbc"])
def test_what_is_damaged_is_thrown_away(place: Path, ending: str) -> None:
    hits(place)
    (file,) = files(place, ending)
    sound = file.read_bytes()
    for name, damage in DAMAGES.items():
        file.write_bytes(damage(sound))
        assert hits(place) == (1 if name == "without its digest" else 0), name
        assert hits(place) == 1, f"{name}: it was not kept again"


def test_a_part_that_is_lost_is_made_again(place: Path) -> None:
    hits(place)
    for ending in (".nbi", ".nbc"):
        for file in files(place, ending):
            file.unlink()
        assert hits(place) == 0
        assert hits(place) == 1


def test_what_cannot_be_kept_is_compiled_all_the_same(place: Path) -> None:
    """Where its folder has become a file, nothing can be read, removed or written."""
    hits(place)
    (folder,) = (place / "kernels").iterdir()
    folder.rename(place / "aside")
    folder.touch()
    assert hits(place) == 0
    folder.unlink()
    (place / "aside").rename(folder)
    assert hits(place) == 1


def test_numba_by_itself_reads_the_same_files(place: Path) -> None:
    answer = "import made; print(made.twice(21), sum(made.twice.stats.cache_hits.values()))"
    env = {**os.environ, "NUMBA_CACHE_DIR": str(place / "kernels"), "PYTHONPATH": str(place)}

    def said(before: str = "") -> str:
        done = subprocess.run([sys.executable, "-c", before + answer], env=env, capture_output=True, text=True)
        return done.stdout or done.stderr

    assert said() == "42 0\n"
    assert said("import matbench.plans.kernel_cache; ") == "42 1\n", "what numba has written has no digest"
    for file in files(place, ".nb?"):
        file.unlink()
    assert said("import matbench.plans.kernel_cache; ") == "42 0\n"
    assert said() == "42 1\n"


def test_without_a_home_a_kernel_makes_no_folder(homeless: None, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    monkeypatch.chdir(place)
    assert hits(place) == 0
    assert {path.name for path in place.iterdir()} == {"kernels", "made.py"}


def test_every_kernel_of_the_methods_is_kept_like_this() -> None:
    from matbench.algorithms import kernels

    assert type(kernels.fill._cache) is kernel_cache.KernelCache


SLOW = """
import json
import numpy as np
from attrs import evolve
from matbench import Context, Range, load_scene
from matbench.plans import plugins
from matbench.scenes.views_only import without_truth
whole = load_scene("synthetic/box[size=48x36 views=3]")
scene = evolve(without_truth(whole), views=whole.views[:, 15:21, 10:30], disparities=Range(0, 2))
found = {}
for name in plugins.default_algorithms():
    estimate = plugins.algorithm(name).make({}).solve(scene, Context())
    found[name] = [float(np.nan_to_num(estimate.disparity[scene.ref]).sum()), dict(estimate.work)]
print(json.dumps(found))
"""


def test_all_methods_work_without_a_compiler() -> None:
    """With NUMBA_DISABLE_JIT the kernels are plain Python: much slower, and the same numbers but for rounding."""

    def found(**more: str) -> dict[str, list[object]]:
        env = {**os.environ, **more}
        done = subprocess.run([sys.executable, "-c", SLOW], env=env, cwd=ROOT, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return dict(json.loads(done.stdout))

    slow, quick = found(NUMBA_DISABLE_JIT="1"), found()
    assert slow.keys() == quick.keys()
    for name in quick:
        assert slow[name][0] == pytest.approx(quick[name][0], rel=1e-3), name
        assert slow[name][1] == quick[name][1], name


@pytest.mark.parametrize("value", ["0", "-2"])
def test_a_number_of_threads_that_numba_refuses_is_told_by_the_name_of_its_variable(value: str) -> None:
    line = [sys.executable, "-m", "matbench", "compare", "-a", "ssd", "-s", "synthetic/box[size=48x36]", "--dry-run"]
    done = subprocess.run(line, env={**os.environ, "NUMBA_NUM_THREADS": value}, capture_output=True, text=True)
    assert done.returncode == 2
    assert f"NUMBA_NUM_THREADS is {value!r}: it must be a whole number above 0" in done.stderr
    assert done.stderr.count("\n") == 1
