"""What a run ran on, whether methods repeat themselves, and times that may not be compared."""

from matbench.runs import provenance


def test_facts_of_several_machines_are_all_shown() -> None:
    assert provenance.combined([{"machine": "a", "numpy": "2"}, {"machine": "b", "numpy": "2"}]) == {
        "machine": "a; b",
        "numpy": "2",
    }
