"""Remarks that are made once."""

import warnings

from matbench.files.remarks import remark_once


def test_a_remark_is_made_once_also_where_python_has_forgotten_it() -> None:
    with warnings.catch_warnings(record=True) as told:
        for _ in range(3):
            warnings.simplefilter("default")  # has Python forget what it has shown
            remark_once("it has no locks")
    assert [str(one.message) for one in told] == ["it has no locks"]
