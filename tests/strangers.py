"""Commands run as in a bare container: by a user whom nobody knows, without HOME, in an environment that is empty."""

import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from places import ROOT

_SHUT = 'mount --bind "$1" "$1" && mount -o remount,ro,bind "$1" && shift && exec "$@"'
"""The checkout becomes read-only, as an installed package is to its users."""

KNOWN_TO_NOBODY = 54321
_AS_STRANGER = ("unshare", "--user", f"--map-user={KNOWN_TO_NOBODY}", f"--map-group={KNOWN_TO_NOBODY}")


def run(place: Path, line: Sequence[object], **environment: str) -> subprocess.CompletedProcess[str]:
    """Run ``matbench`` with these words, in the folder `place`, with no variables but PATH and those given."""
    variables = [f"{name}={value}" for name, value in {"PATH": "/usr/bin:/bin", **environment}.items()]
    shut = ["unshare", "-rm", "sh", "-c", _SHUT, "sh", str(ROOT), *_AS_STRANGER, "env", "-i", *variables]
    if shutil.which("unshare") is None or subprocess.run([*shut, "true"], capture_output=True).returncode:
        pytest.skip("this system lets nobody be another user in a namespace of their own")
    words = [sys.executable, "-m", "matbench", *map(str, line)]
    return subprocess.run([*shut, *words], cwd=place, capture_output=True, text=True, timeout=300)
