"""Layer one: how much work each method says it does on a fixed scene. Exact, the same on every machine.

Run as a program it prints what is counted, as JSON.
"""

import json
from pathlib import Path

from subjects import CONTEXT, METHODS, instance, scene

STORED = Path(__file__).with_name("counters.json")


def counted(name: str) -> dict[str, int]:
    """The counters of one solve."""
    return {key: int(count) for key, count in sorted(instance(name).solve(scene(), CONTEXT).work.items())}


def stored() -> dict[str, dict[str, int]]:
    """Method -> counters, as they were last accepted."""
    found: dict[str, dict[str, int]] = json.loads(STORED.read_text(encoding="utf-8"))
    return found


if __name__ == "__main__":
    print(json.dumps({name: counted(name) for name in METHODS}))
