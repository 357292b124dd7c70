"""Errands of a keeper, in processes of their own."""

import os
import time
from multiprocessing import Pipe
from pathlib import Path

import pytest

from matbench.solving import errand


def test_an_errand_is_done_elsewhere(tmp_path: Path) -> None:
    inbox, _keep = Pipe()
    assert errand.run(lambda: (tmp_path / "pid").write_text(str(os.getpid())), inbox, None) == ""
    assert int((tmp_path / "pid").read_text()) != os.getpid()


def test_what_goes_wrong_is_told() -> None:
    inbox, _keep = Pipe()

    def fails() -> None:
        raise RuntimeError("no such scene")

    assert errand.run(fails, inbox, None).startswith("RuntimeError: no such scene")
    assert "has ended" in errand.run(lambda: os._exit(3), inbox, None)


def test_it_ends_in_time_or_when_nobody_wants_it(tmp_path: Path) -> None:
    inbox, other = Pipe()

    def dawdles() -> None:
        (tmp_path / "pid").write_text(str(os.getpid()))
        time.sleep(60)

    for seconds in (0.5, 5, 25):
        begin = time.monotonic()
        with pytest.raises(errand.Late):
            errand.run(dawdles, inbox, begin + seconds)
        if (tmp_path / "pid").exists():  # on a busy machine, it may not have come so far
            break
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)
    other.close()
    with pytest.raises(EOFError):
        errand.run(dawdles, inbox, None)
    assert time.monotonic() - begin < 55, "it would have slept for sixty"
