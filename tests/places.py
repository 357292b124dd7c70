"""Where the tests' own files lie."""

from pathlib import Path

TESTS = Path(__file__).parent
ROOT = TESTS.parent
METHODS, ROUGH, UNRULY, LAUNCHER = (TESTS / f"{name}.py" for name in ("methods", "rough", "unruly", "launcher"))
PROGRAMS = TESTS / "programs"
