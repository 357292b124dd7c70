"""Starts runs again and again, to be killed: reads a run folder from each line, says which process works on it."""

import os
import sys
from pathlib import Path

from matbench import comparison

SCENE = "synthetic/box[size=48x36]"
METHODS = ["steady", "seeded"]
SEEDS = range(25)


def main(plugin: Path) -> None:
    for line in sys.stdin:
        pid = os.fork()
        if not pid:
            try:
                os.setsid()
                folder = Path(line.strip())
                ready = comparison.prepare(METHODS, SCENE, out=folder, seed=SEEDS, plugin=plugin, command="launcher")
                ready.run()
            finally:
                os._exit(0)
        print(pid, flush=True)
        os.waitpid(pid, 0)
        print("ended", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
