"""What may be unpickled while a cluster is listened to."""

import os
import pickle
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from threading import Event, Thread

import pytest

from matbench.solving.data_only import Refused, data_only, is_guarded

unpickle = pickle.loads


def in_thread(call: Callable[..., object], *args: object, name: str = "IO loop") -> object:
    """What a call gives in a thread of that name; by default as Dask calls that of a client."""
    ended: Future[object] = Future()

    def run() -> None:
        try:
            ended.set_result(call(*args))
        except BaseException as error:
            ended.set_exception(error)

    thread = Thread(target=run, name=name)
    thread.start()
    thread.join()
    return ended.result()


class Running:
    """Makes a folder where it is unpickled."""

    def __init__(self, place: Path) -> None:
        self.place = str(place)

    def __reduce__(self) -> tuple[Callable[[str], None], tuple[str]]:
        return os.mkdir, (self.place,)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
@pytest.mark.parametrize("load", [unpickle, pickle._loads])  # type: ignore[attr-defined]  # in C and in Python
@pytest.mark.parametrize("thread", ["IO loop", "Dask-Offload_0"])
def test_nothing_runs(tmp_path: Path, protocol: int, load: Callable[[bytes], object], thread: str) -> None:
    sent = pickle.dumps(Running(tmp_path / "ran"), protocol)
    with data_only() as refused:
        assert in_thread(is_guarded, name=thread)
        with pytest.raises(Refused, match=r"(posix|os)\.mkdir was sent, which is no data: it was not run"):
            in_thread(load, sent, name=thread)
        assert refused in (["posix.mkdir"], ["os.mkdir"])
    assert not (tmp_path / "ran").exists()
    in_thread(load, sent, name=thread)
    assert (tmp_path / "ran").is_dir(), "without the guard it would have run"


def test_values_and_errors_come_through() -> None:
    values = [1, 2.5, "a", b"b", {"c": (None, True)}, {3}, bytearray(b"d")]
    with data_only() as refused:
        for protocol in (4, 5):  # Dask takes no older one
            assert in_thread(unpickle, pickle.dumps(values, protocol)) == values
            assert str(in_thread(unpickle, pickle.dumps(KeyError("lost"), protocol))) == "'lost'"
        assert not refused


@pytest.mark.parametrize("name", ["eval", "exec", "getattr", "__import__", "open", "compile", "map", "type"])
def test_no_function_of_python_itself(name: str) -> None:
    with data_only(), pytest.raises(Refused, match=name):
        in_thread(unpickle, f"cbuiltins\n{name}\n.".encode())


def test_other_threads_unpickle_what_they_like(tmp_path: Path) -> None:
    """A client of one's own that was there before, and threads that are none of Dask's."""
    sent, begin = [pickle.dumps(Running(tmp_path / name)) for name in ("one", "two")], Event()

    def read() -> None:
        begin.wait(20)
        unpickle(sent[0])

    before = Thread(target=read, name="IO loop")
    before.start()
    with data_only() as refused:
        begin.set()
        before.join()
        in_thread(unpickle, sent[1], name="mine")
        assert not refused
    assert (tmp_path / "one").is_dir()
    assert (tmp_path / "two").is_dir()


def test_what_dask_says_of_a_lost_task_comes_through() -> None:
    scheduler = pytest.importorskip("distributed.scheduler", reason="Dask is not installed")
    core = pytest.importorskip("distributed.core")
    if core.Status.running.__reduce_ex__(4)[0] is getattr:
        pytest.skip("this Python sends enumerations as calls of getattr, which are refused: the words are lost")
    state = scheduler.WorkerState(
        address="tcp://there:1",
        status=core.Status.running,
        pid=1,
        name="w",
        nthreads=1,
        memory_limit=1 << 30,
        local_directory="/tmp",  # noqa: S108
        nanny=None,
        server_id="w-1",
        services={},
        extra={},
    )
    sent = [
        pickle.dumps(scheduler.KilledWorker("task", state, 3)),
        core.error_message(ImportError("No module named 'mine'"))["exception"].data,
    ]
    with data_only() as refused:
        said = [str(in_thread(unpickle, one)) for one in sent]
    assert "all those workers died" in said[0]
    assert said[1] == "No module named 'mine'"
    assert not refused
