"""The kind of machine this is: whatever decides how long compiled code takes."""

import os
import platform
import re
from collections.abc import Mapping
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

LIBRARIES = ("numba", "llvmlite", "numpy", "opencv-python-headless")


def _processor() -> str:
    """The processor's model, as the system names it, with its family, model and stepping."""
    found: dict[str, str] = {}
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            key, _, value = line.partition(":")
            found.setdefault(key.strip(), value.strip())
    except OSError:  # not Linux
        return platform.processor() or platform.machine()
    name = found.get("model name") or platform.processor() or platform.machine()
    numbers = "/".join(found.get(key, "?") for key in ("cpu family", "model", "stepping"))
    return f"{name} {numbers}"


def _minor(library: str) -> str:
    """Version of a library without its last part: patch releases rarely change speed, and would void baselines."""
    try:
        return ".".join(version(library).split(".")[:2])
    except PackageNotFoundError:
        return "none"


def kind() -> dict[str, str]:
    """What must be equal for stored ratios to apply: processor, system, compilers and numerical libraries."""
    return {
        "processor": _processor(),
        "architecture": platform.machine(),
        "cores": str(os.cpu_count()),
        "system": platform.system(),
        "python": ".".join(platform.python_version_tuple()[:2]),
        **{library: _minor(library) for library in LIBRARIES},
    }


def file_name(machine: Mapping[str, str]) -> str:
    """``intel-xeon-processor-1a2b3c4d.json``: readable, and one for each kind."""
    words = re.sub(r"\((r|tm)\)", "", machine["processor"].lower())
    slug = re.sub(r"[^a-z0-9]+", "-", words).strip("-")[:40].strip("-")
    return f"{slug}-{sha256(repr(sorted(machine.items())).encode()).hexdigest()[:8]}.json"


def differences(one: Mapping[str, str], other: Mapping[str, str]) -> list[str]:
    """How two kinds of machine differ, such as ``numba 0.67 -> 0.68``."""
    return [
        f"{key} {one.get(key, 'none')} -> {other.get(key, 'none')}"
        for key in dict.fromkeys((*one, *other))
        if one.get(key) != other.get(key)
    ]
