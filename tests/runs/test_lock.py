"""Who works on a run."""

import json
from pathlib import Path

from matbench.runs.lock import Work


def test_what_lies_about_who_works_is_not_believed(tmp_path: Path) -> None:
    facts = {"pid": 1, "host": "here", "since": 1.0, "running": {"0123456789abcdef": 2.0}}
    (tmp_path / ".work.json").write_text(json.dumps(facts))
    assert Work.read(tmp_path) is not None
    for lie in ({"host": "\x1b[2J"}, {"since": float("inf")}, {"running": {"0": float("nan")}}, {"pid": "x"}):
        (tmp_path / ".work.json").write_text(json.dumps({**facts, **lie}))
        assert Work.read(tmp_path) is None
