"""Opening a recording in the rerun viewer, in a window or in a browser."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import quote

from matbench import linux
from matbench.errors import UserError

_PATIENCE = 5.0  # seconds that the viewer has to end when it is told to


def view(path: Path, web: bool = False) -> None:
    """Show a recording, until the viewer is closed or Ctrl-C is typed.

    Parameters
    ----------
    path
        The recording.
    web
        Serve it to a browser on this machine, and print the address, instead of opening a window.

    Raises
    ------
    UserError
        If there is no such file, no display, or the viewer cannot start.
    """
    if not path.is_file():
        raise UserError(f"no recording {str(path)!r}: `matbench compare --record` writes them")
    if not web and sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise UserError("no display to open the native viewer on: add --web to view the recording in a browser")
    ports = _free_port(), _free_port()
    command = [str(_executable()), str(path), "--port", str(ports[0])]
    if web:
        # this machine only: by default it listens on all interfaces, and anybody could open the recording
        command += ["--web-viewer", "--bind", "127.0.0.1", "--web-viewer-port", str(ports[1])]
    # its analytics complain where there is no home folder
    quiet = {"RUST_LOG": "error,re_analytics=off", **os.environ}
    try:
        with _ended_by_signals(), _running(command, quiet) as viewer:
            if web and _answers(ports[1], viewer):
                source = quote(f"rerun+http://127.0.0.1:{ports[0]}/proxy", safe="")
                print(f"http://127.0.0.1:{ports[1]}/?url={source}  (Ctrl-C ends)", flush=True)
            status = viewer.wait()
    except KeyboardInterrupt:
        return
    if status != 0:
        advice = "" if web else "; add --web to view the recording in a browser"
        raise UserError(f"the rerun viewer ended with status {status}{advice}")


@contextmanager
def _running(command: Sequence[str], environment: Mapping[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    """A program that ends with the block, and with this process however that ends (Linux)."""
    process = os.getpid()
    # the function that runs before the program does nothing but two calls of the system
    program = subprocess.Popen(  # noqa: S603
        command,
        env=environment,
        preexec_fn=lambda: linux.die_with_parent(process),
    )
    try:
        yield program
    finally:
        program.terminate()
        try:
            program.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            program.kill()
            program.wait(_PATIENCE)


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Have SIGTERM and SIGHUP, as of a terminal that is closed, end the block; they end the process only afterwards."""
    if threading.current_thread() is not threading.main_thread():  # others cannot be asked
        yield
        return
    before = {number: signal.signal(number, _leave) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _leave(number: int, _: object) -> None:
    raise SystemExit(128 + number)


def _executable() -> Path:
    """The viewer's program inside the rerun-sdk package.

    The command `rerun` is a Python script that starts this program: ending the script would leave the viewer open.
    """
    package = find_spec("rerun_cli")
    folders = [Path(folder) for folder in (package and package.submodule_search_locations) or ()]
    name = "rerun.exe" if sys.platform == "win32" else "rerun"
    for folder in folders:
        for place in (folder / name, folder / "Rerun.app" / "Contents" / "MacOS" / "Rerun"):
            if place.is_file():
                return place
    raise UserError("rerun-sdk is installed without its viewer: `pip install --force-reinstall rerun-sdk`")


def _free_port() -> int:
    """A port that is free now: with a fixed one, only one viewer could be open at a time."""
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _answers(port: int, viewer: subprocess.Popen[bytes], seconds: float = 20.0) -> bool:
    """Wait until the web viewer can be reached; False if it has ended, or took longer than `seconds`."""
    end = time.monotonic() + seconds
    while time.monotonic() < end and viewer.poll() is None:
        with closing(socket.socket()) as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return True
        time.sleep(0.05)
    return False
