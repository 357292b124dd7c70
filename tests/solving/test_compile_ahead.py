"""Kernels of the harness's own methods are compiled before the first cell, and only where none are kept."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from threading import Timer
from time import monotonic
from types import SimpleNamespace

import pytest

from matbench.errors import UserError
from matbench.plans import kernels, plugins
from matbench.plans.plan import Method
from matbench.solving import compile_ahead as module
from matbench.solving.compile_ahead import Ahead, methods_to_compile


def method_of(algorithm: str, changed: str = "", file: str = "") -> Method:
    return SimpleNamespace(algorithm=algorithm, changed=changed, file=file)  # type: ignore[return-value]


def test_only_methods_that_run_by_default_and_only_without_kernels(tmp_path: Path) -> None:
    program = method_of("command", "program=/bin/true")
    own = [method_of("own", file="own.py"), method_of("nobody"), program, method_of("ssd")]
    methods = [method_of("sgbm"), method_of("okutomi_kanade", "window=9"), *own]
    assert methods_to_compile(methods, tmp_path) == ["okutomi_kanade[window=9]", "sgbm"]
    (tmp_path / "deep").mkdir()
    kernel = tmp_path / "deep" / "kernel.nbi"
    kernel.touch()
    assert methods_to_compile(methods, tmp_path) == []
    os.utime(kernel, (1, 1))
    assert methods_to_compile(methods, tmp_path) == ["okutomi_kanade[window=9]", "sgbm"], "of code before"


def test_who_shares_most_with_the_others_is_last(tmp_path: Path) -> None:
    found = methods_to_compile(map(method_of, plugins.default_algorithms()), tmp_path)
    assert found[0] == "materiality"
    assert found[-1] == "multiview_sgm", "all its kernels are those of materiality"


def test_kernels_lie_there_afterwards_whatever_is_in_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path / "here"
    here.mkdir()
    (here / "numba.py").write_text("open('run', 'w').close()\n")
    monkeypatch.chdir(here)
    monkeypatch.setattr(module, "cores", lambda: 2)
    Ahead.begin(["no_such_method", "okutomi_kanade[window=3]", "sgbm"], tmp_path).wait()
    assert any("okutomi" in path.name or "sweep" in path.name for path in tmp_path.rglob("*.nbi"))
    assert not (here / "run").exists(), "a module of the working folder was run"


def test_nothing_is_started_for_one_method_or_one_core(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def started(*_: object, **__: object) -> None:
        raise AssertionError("a process")

    monkeypatch.setattr(subprocess, "Popen", started)
    monkeypatch.setattr(module, "cores", lambda: 2)
    Ahead.begin(["sgbm"], tmp_path).wait()
    monkeypatch.setattr(module, "cores", lambda: 1)
    Ahead.begin(["sgbm", "ssd"], tmp_path).wait()


def test_a_process_that_cannot_start_is_no_failure(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(module, "cores", lambda: 2)
    monkeypatch.setattr(sys, "executable", "/nowhere")
    Ahead.begin(["sgbm", "ssd"], tmp_path).wait()


@pytest.fixture
def endless(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Processes that compile for ever; where they write their numbers."""
    script = tmp_path / "endless"
    script.write_text(f"#!/bin/sh\necho $$ >> {tmp_path}/started\nexec sleep 60\n")
    script.chmod(0o755)
    monkeypatch.setattr(module, "cores", lambda: 2)
    monkeypatch.setattr(sys, "executable", str(script))
    return tmp_path / "started"


def gone(started: Path) -> bool:
    return not any(Path(f"/proc/{number}").exists() for number in started.read_text().split())


def test_an_interrupt_ends_it_at_once(endless: Path, tmp_path: Path) -> None:
    # as SIGTERM of a batch system: it reaches this process alone, not those that it has started
    timer, begun = Timer(1, os.kill, (os.getpid(), signal.SIGINT)), monotonic()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        Ahead.begin(["sgbm", "ssd", "scanline"], tmp_path).wait()
    assert monotonic() - begun < 30
    assert endless.read_text()
    assert gone(endless)


def test_a_plan_that_cannot_be_made_ends_it(endless: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from matbench import comparison

    begun: list[Ahead] = []

    def begin(selectors: list[str], kept: Path) -> Ahead:
        begun.append(Ahead.begin(selectors, kept))
        while not endless.exists() or len(endless.read_text().split()) < 2:
            pass
        return begun[-1]

    def none_are_kept(_: str) -> Path:
        (tmp_path / "none").mkdir(exist_ok=True)
        return tmp_path / "none"

    monkeypatch.setattr(kernels, "place", none_are_kept)
    monkeypatch.setattr(comparison, "Ahead", SimpleNamespace(begin=begin))
    with pytest.raises(UserError, match="no_such_scene"):
        comparison.prepare(["sgbm", "okutomi_kanade"], "synthetic/no_such_scene", out=tmp_path / "run")
    assert begun
    assert gone(endless)
    comparison.prepare(["sgbm", "okutomi_kanade"], "synthetic/box[size=48x36]", out=tmp_path / "run", write=False)
    assert len(begun) == 1, "where nothing is written nothing is compiled"
