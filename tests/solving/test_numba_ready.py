"""Processes forked after numba was made ready learn nothing of it any more."""

import subprocess
import sys

CODE = """
import sys
from collections import Counter
counted = Counter()

def count(frame, event, argument):
    if event == "call" and frame.f_code.co_name == "install_registry":
        counted[frame.f_code.co_name] += 1

if "ready" in sys.argv:
    import matbench.solving.numba_ready
from matbench.plans.kernel_cache import numba

@numba.njit
def kernel(a):
    return a[0] + 1

import numpy as np
sys.setprofile(count)
kernel(np.ones(3))
sys.setprofile(None)
print(counted["install_registry"] > 100)
"""


def _learns(*arguments: str) -> str:
    line = [sys.executable, "-c", CODE, *arguments]
    return subprocess.run(line, capture_output=True, text=True, timeout=300, check=True).stdout.strip()


def test_what_numba_learns_at_its_first_kernel_is_known_before() -> None:
    assert (_learns(), _learns("ready")) == ("True", "False")
