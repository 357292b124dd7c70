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

from matbench.plans import kernels
from matbench.plans.plan import Cell
from matbench.solving import compile_ahead as module
from matbench.solving.compile_ahead import compile_ahead, methods_to_compile


def cell_of(algorithm: str, changed: str = "", file: str = "") -> Cell:
    method = SimpleNamespace(algorithm=algorithm, changed=changed, file=file)
    return SimpleNamespace(method=method)  # type: ignore[return-value]


def test_only_methods_that_run_by_default_and_only_without_kernels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(kernels.VARIABLE, str(tmp_path))
    program = cell_of("command", "program=/bin/true")
    own = [cell_of("own", file="own.py"), cell_of("nobody"), program, cell_of("ssd")]
    cells = [cell_of("sgbm"), cell_of("okutomi_kanade", "window=9"), *own]
    assert methods_to_compile(cells) == ["sgbm", "okutomi_kanade[window=9]"]
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "kernel.nbi").touch()
    assert methods_to_compile(cells) == []
    monkeypatch.delenv(kernels.VARIABLE)
    assert methods_to_compile(cells) == [], "where they are kept is not known"


def test_kernels_lie_there_afterwards_whatever_is_in_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path / "here"
    here.mkdir()
    (here / "numba.py").write_text("open('run', 'w').close()\n")
    monkeypatch.chdir(here)
    monkeypatch.setenv(kernels.VARIABLE, str(tmp_path))
    monkeypatch.setattr(module, "cores", lambda: 2)
    compile_ahead(["no_such_method", "okutomi_kanade[window=3]", "sgbm"])
    assert any("okutomi" in path.name or "sweep" in path.name for path in tmp_path.rglob("*.nbi"))
    assert not (here / "run").exists(), "a module of the working folder was run"


def test_nothing_is_started_for_one_method_or_one_core(monkeypatch: pytest.MonkeyPatch) -> None:
    def started(*_: object, **__: object) -> None:
        raise AssertionError("a process")

    monkeypatch.setattr(subprocess, "Popen", started)
    monkeypatch.setattr(module, "cores", lambda: 2)
    compile_ahead(["sgbm"])
    monkeypatch.setattr(module, "cores", lambda: 1)
    compile_ahead(["sgbm", "ssd"])


def test_a_process_that_cannot_start_is_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "cores", lambda: 2)
    monkeypatch.setattr(sys, "executable", "/nowhere")
    compile_ahead(["sgbm", "ssd"])


def test_an_interrupt_ends_it_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    endless = tmp_path / "endless"
    endless.write_text(f"#!/bin/sh\necho $$ >> {tmp_path}/started\nexec sleep 60\n")
    endless.chmod(0o755)
    monkeypatch.setattr(module, "cores", lambda: 2)
    monkeypatch.setattr(sys, "executable", str(endless))
    # as SIGTERM of a batch system: it reaches this process alone, not those that it has started
    timer, begun = Timer(1, os.kill, (os.getpid(), signal.SIGINT)), monotonic()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        compile_ahead(["sgbm", "ssd", "scanline"])
    assert monotonic() - begun < 30
    numbers = [int(number) for number in (tmp_path / "started").read_text().split()]
    assert numbers
    assert not any(Path(f"/proc/{number}").exists() for number in numbers)
