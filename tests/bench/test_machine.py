"""Kinds of machine, told apart and named."""

import os
import re

import pytest

from matbench.bench import machine


def test_this_machine_has_a_kind() -> None:
    found = machine.kind()
    assert found == machine.kind(), "the same every time"
    assert found["cores"] == str(os.cpu_count())
    assert all(found.values())
    assert re.fullmatch(r"\d+\.\d+", found["numba"]), "patch releases do not count"
    assert machine._minor("no-such-library") == "none"


@pytest.mark.parametrize(
    ("processor", "slug"),
    [
        ("Intel(R) Xeon(R) Processor @ 2.10GHz 6/143/8", "intel-xeon-processor-2-10ghz-6-143-8"),
        ("../../evil/\n name", "evil-name"),
        ("x" * 99, "x" * 40),
    ],
)
def test_files_have_readable_names_that_stay_in_their_folder(processor: str, slug: str) -> None:
    name = machine.file_name({"processor": processor, "cores": "2"})
    assert re.fullmatch(rf"{slug}-[0-9a-f]{{8}}\.json", name)
    assert name != machine.file_name({"processor": processor, "cores": "4"})
    assert name == machine.file_name({"cores": "2", "processor": processor}), "whatever the order"


def test_differences_are_told_one_by_one() -> None:
    one, other = {"numba": "0.67", "cores": "2"}, {"cores": "2", "numba": "0.68", "python": "3.13"}
    assert machine.differences(one, other) == ["numba 0.67 -> 0.68", "python none -> 3.13"]
    assert machine.differences(one, dict(one)) == []
