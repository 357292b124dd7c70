"""What lies beside the plug-in `at_home`."""

import time

import numpy as np


def tripled(number: int) -> int:
    return 3 * number


def held(mebibytes: int) -> int:
    """Hold memory, a little more at a time, for a while."""
    kept = []
    for _ in range(mebibytes // 8):
        kept.append(np.ones(1 << 20))
        time.sleep(0.02)
    time.sleep(3)
    return 3
