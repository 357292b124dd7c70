"""A method, and a run folder from elsewhere, whose texts are made to harm: walked through every command."""

import csv
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typing_commands import run as typed

from matbench.cli import app

HOSTILE = "=1+1\x1b[2J\x1b]0;title\x07\x9b31m\u202egnp\u2028\x7f\r"
METHOD = '''
import numpy as np
from matbench import Estimate

class Loud:
    """Tells counters and curves by names that are made to harm."""

    def __init__(self, note: str = "plain") -> None:
        self.note = note

    def solve(self, scene, context):
        print("\\x1b]0;title\\x07 \\udc80")
        names = ["=1+1", "\\x1b[2J", "half \\udc80", "\\u202egnp", "+1", "@SUM", 7]
        answer = {scene.ref: np.ones((scene.height, scene.width), np.float32)}
        return Estimate(answer, history={name: [3.0, 2.0, 1.0] for name in names}, work=dict.fromkeys(names, 2))

class Angry:
    """Fails with a message that is made to harm."""

    def solve(self, scene, context):
        raise ValueError("=HYPERLINK(1)\\x1b[2J \\u202egnp \\udc80")

class Refusing:
    """Refuses every scene, in words that are made to harm."""

    def unsupported_reason(self, scene):
        return "=1+1 \\x1b[2J \\udc80"

    def solve(self, scene, context):
        raise AssertionError
'''
TINY = "synthetic/box[size=48x36]"
NUMBER = re.compile(r"[+-]?[\d.]+(e[+-]?\d+)?")
Capture = pytest.CaptureFixture[str]


def assert_inert(text: str) -> None:
    odd = {c for c in text if c != "\n" and (ord(c) < 32 or 127 <= ord(c) < 160 or "\u2028" <= c <= "\u202e")}
    assert not odd, f"{sorted(odd)} in {text!r}"
    text.encode()


def assert_computes_nothing(folder: Path) -> None:
    tables = list(folder.rglob("*.csv"))
    assert tables
    for table in tables:
        assert_inert(table.read_text())
        for row in csv.reader(table.read_text().splitlines()):
            for cell in row:
                assert cell[:1] not in tuple("=+-@") or NUMBER.fullmatch(cell), f"{cell!r} in {table.name}"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("hostile")


@pytest.fixture(scope="module")
def made(place: Path) -> Path:
    """A run of the hostile methods."""
    (place / "loud.py").write_text(METHOD)
    from matbench import comparison

    comparison.compare(
        ["loud[note=-1+1,'a\u00a0b',\u200d]", "angry", "refusing"], TINY, out=place / "run", plugin=place / "loud.py"
    )
    return place / "run"


def test_what_a_method_calls_things_costs_no_table_and_computes_nothing(made: Path) -> None:
    assert_computes_nothing(made)
    assert_inert(re.sub(r"\r|\t", "", (made / "report.html").read_text()))
    with (made / "cells.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["ok", "ok", "ok", "failed", "skipped"]
    assert rows[0]["params"] == "note=-1+1"
    assert rows[0]["work"].startswith("'=1+1=2 \\x1b[2J=2 half \\x80=2")
    assert rows[3]["reason"].startswith("ValueError: =HYPERLINK(1)")
    assert rows[4]["reason"] == "'=1+1"


def _foreign(made: Path, copy: Path) -> Path:
    """The run as somebody else may send it: every text in it that no name is checked against is hostile."""
    shutil.copytree(made, copy)

    def spoilt(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: spoilt(one) for key, one in value.items()}
        return HOSTILE if isinstance(value, str) else value

    for path in copy.glob("cells/*/cell.json"):
        facts = json.loads(path.read_text())
        told = facts["outcome"]
        for key in ("ran_on", "reason", "doubt"):
            told[key] = spoilt(told[key] or HOSTILE)
        told["work"] |= {HOSTILE: 1}
        told["ran_on"] |= {HOSTILE: HOSTILE}
        path.write_text(json.dumps(facts))
        (path.parent / "log.txt").write_text(HOSTILE)
    plan = json.loads((copy / "plan.json").read_text())
    (copy / "plan.json").write_text(json.dumps(plan | {"command": HOSTILE}))
    scores = json.loads((copy / "scores.json").read_text())
    (copy / "scores.json").write_text(json.dumps(scores | {"scorer": HOSTILE, "unsteady": [HOSTILE]}))
    return copy


COMMANDS: list[tuple[str, Callable[[Path, Path], list[object]]]] = [
    ("status", lambda run, _: [run]),
    ("status", lambda run, _: [run, "--json"]),
    ("export", lambda run, _: [run]),
    ("score", lambda run, place: [run, "--plugin", place / "loud.py"]),
    ("status", lambda run, _: [run]),
    ("report", lambda run, _: [run]),
    ("report", lambda run, _: [run, "--format", "md"]),
    ("report", lambda run, _: [run, "--format", "tex"]),
    ("report", lambda run, _: [run, "--format", "csv"]),
    ("figure", lambda run, place: ["maps", run, "--plugin", place / "loud.py", "--out", place / "maps.pdf"]),
    ("view", lambda run, _: [run, HOSTILE]),
    ("export", lambda run, place: [run, "--out", place / "run.zip"]),
    ("compare", lambda run, place: ["-a", "angry", "-s", TINY, "--plugin", place / "loud.py", "--dry-run"]),
    ("list", lambda run, place: ["--plugin", place / "loud.py"]),
    ("scene", lambda run, place: ["check", HOSTILE]),
    ("scene", lambda run, place: ["show", f"./{HOSTILE}"]),
    ("maps", lambda run, place: ["check", HOSTILE, "-s", TINY]),
    ("fetch", lambda run, place: [HOSTILE]),
    ("check", lambda run, place: [HOSTILE]),
    ("bench", lambda run, place: [HOSTILE]),
    ("ablate", lambda run, place: [HOSTILE]),
    (HOSTILE, lambda run, place: []),
]


def test_a_run_from_elsewhere_is_walked_through_every_command(
    made: Path, place: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(place)
    run = _foreign(made, place / "foreign")
    for name, tokens in COMMANDS:
        status, out, err = typed(capsys, name, *tokens(run, place))
        assert status in (0, 1, 2), (name, err)
        assert_inert(out + err)
        assert len(err.splitlines()) <= 2, (name, err)
    assert_computes_nothing(run)
    named = {name for name, _ in COMMANDS}
    assert {name for name in app if not name.startswith("-")} <= named, "every command is walked through"
