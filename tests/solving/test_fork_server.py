"""The fork server adopts what its processes leave, and no other process does."""

import subprocess
import sys

import pytest

CODE = """
import multiprocessing, os, sys
from matbench.solving import processes

def main():
    processes.start_server([])
    server = processes.server()
    process = multiprocessing.get_context("forkserver").Process(target=os.system, args=("sleep 600 >/dev/null 2>&1 &",))
    process.start()
    process.join()
    import psutil
    (sleep,) = psutil.Process(server).children()  # by now what started it has ended
    found = sleep.ppid() == server
    sleep.kill()
    print(found, "matbench.solving.fork_server" in sys.modules)

if __name__ == "__main__":
    main()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="done by Linux's calls")
def test_the_fork_server_adopts_orphans() -> None:
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, timeout=300, check=False)
    assert (done.stdout.split(), done.stderr) == (["True", "False"], "")
