"""Memory as the kernel counts it for a control group."""

import subprocess
import sys
from pathlib import Path

import pytest

from matbench.solving.control_group import ControlGroup

_HOLDS = """
import os, sys
sys.stdin.readline()
number = os.memfd_create("held")
for _ in range(60):
    os.write(number, bytes(1 << 20))
held = bytearray(40 << 20)
print("ready", flush=True)
sys.stdin.readline()
"""


def test_what_a_process_allocates_counts_in_its_group() -> None:
    group = ControlGroup.make()
    if group is None:
        pytest.skip("this user can make no control group here")
    line = [sys.executable, "-c", _HOLDS]
    try:
        with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdin is not None
            assert process.stdout is not None
            group.take(process.pid)
            process.stdin.write("\n")
            process.stdin.flush()
            process.stdout.readline()
            assert 98 < (group.used() or 0) < 120
            process.communicate("\n")
    finally:
        group.remove()
    assert not group.folder.exists()


def test_where_there_is_none_there_is_none(tmp_path: Path) -> None:
    assert ControlGroup.make(tmp_path) is None
    assert list(tmp_path.rglob("matbench-*")) == []


def test_both_versions_are_read(tmp_path: Path) -> None:
    # what the files look like: only one version is there on any one machine
    group = ControlGroup(tmp_path)
    assert group.used() is None
    (tmp_path / "memory.stat").write_text("anon 1048576\nfile 99999999\nshmem 2097152\n")
    assert group.used() == 3
    (tmp_path / "memory.stat").write_text("cache 99999999\nrss 1048576\nshmem 2097152\ntotal_rss 1048576\n")
    assert group.used() == 3
