"""A small run of ``tests/proofs/scale.py``: all that is made of a run of many cells is made, and in proportion."""

import pytest
from proofs import scale


def test_tables_page_and_status_of_a_run_that_was_made_up(capsys: pytest.CaptureFixture[str]) -> None:
    spent = scale.measured(40)
    assert {"storing", "left", "tables", "sweeps", "page", "status", "MiB", "page MB"} == set(spent)
    assert spent["page MB"] < 15
    assert "40 cells: " in capsys.readouterr().out
