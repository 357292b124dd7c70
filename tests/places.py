"""Where the tests' own files lie."""

from pathlib import Path

TESTS = Path(__file__).parent
ROOT = TESTS.parent
METHODS, ROUGH, UNRULY, AT_HOME, HOSTILE, LAUNCHER = (
    TESTS / f"{name}.py" for name in ("methods", "rough", "unruly", "at_home", "hostile", "launcher")
)
PROGRAMS = TESTS / "programs"
