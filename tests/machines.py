"""Dask clusters of several processes, as several machines would be."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil
from waiting import wait_until


class Machines:
    """A scheduler and its workers, each a process as `dask scheduler` and `dask worker` start it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.started: list[subprocess.Popen[bytes]] = []
        file = folder / "scheduler.json"
        self._start("scheduler", "--port", "0", "--no-dashboard", "--host", "127.0.0.1", "--scheduler-file", str(file))
        wait_until(file.exists)
        wait_until(lambda: file.stat().st_size)
        time.sleep(0.2)
        from distributed import Client

        self.client: Any = Client(scheduler_file=str(file), set_as_default=False)
        self.address = str(json.loads(file.read_text())["address"])

    def _start(self, what: str, *options: str) -> None:
        line = [sys.executable, "-m", f"distributed.cli.dask_{what}", *options]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": self.folder}
        self.started.append(subprocess.Popen(line, start_new_session=True, **quiet))  # type: ignore[call-overload]

    def add(self, *options: str) -> None:
        self._start("worker", self.address, "--nthreads", "1", "--no-dashboard", "--death-timeout", "60", *options)

    def pids(self) -> dict[str, int]:
        """The processes of the workers by their addresses."""
        found: dict[str, int] = self.client.run(os.getpid)
        return found

    def close(self) -> None:
        """End the workers, then their scheduler: a worker that loses it while it ends may wait for it forever."""
        scheduler, *workers = [psutil.Process(one.pid) for one in self.started]
        every = [each for one in (scheduler, *workers) for each in (one, *one.children(recursive=True))]
        self.client.close()
        for one in workers:
            one.terminate()
        psutil.wait_procs(workers, timeout=300)  # a worker itself waits 30 s for its threads
        scheduler.terminate()
        _, left = psutil.wait_procs(every, timeout=300)
        for process in left:
            process.kill()
        assert not left, f"nothing outlives the cluster: {left}"
