"""Computed scenes kept on disk: what they are known by."""

import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import llvmlite
import numba
import numpy as np
import pytest
import scipy

import matbench
from matbench.scenes import kept

pytestmark = pytest.mark.usefixtures("there")


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
