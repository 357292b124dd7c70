"""Parameters of materiality: what is refused, and what nothing reads."""

import numpy as np
import pytest
from boxes import box_before_wall

from matbench.algorithm import Context
from matbench.algorithms.materiality import Materiality
from matbench.errors import UserError
from matbench.parameters import build, parameters, refuse_silent, values_of
from matbench.spec import parse


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("start", "hard"),
        ("sharpness", 0.0),
        ("count", -1.0),
        ("counted", "column"),
        ("target", "sum"),
        ("across", -1.0),
        ("along", -1.0),
        ("edge", 0.0),
        ("optimiser", "newton"),
        ("passes", -1),
        ("tolerance", -1.0),
        ("binarization", "cut"),
        ("hidden", -1.0),
        ("material", -1.0),
        ("adaptive", -1.0),
        ("alike", -1.0),
        ("mending", -1),
        ("confidence", "chance"),
    ],
)
def test_a_wrong_value_names_the_parameter(name, value):
    with pytest.raises(ValueError, match=name):
        Materiality(**{name: value})


@pytest.mark.parametrize("name", ["paper", "descent"])
def test_presets_set_nothing_that_is_not_read(name):
    method = Materiality(**Materiality.presets[name])
    assert not set(Materiality.presets[name]) & set(method.silent)


SILENT = [
    ({}, "count=1.0 counted=global target=union across=1.0 along=1.0 edge=5.0 sharpness=5.0 sigma=5.0 tolerance=0.1"),
    ({}, "form=linear"),
    ({"passes": 0}, "material=0.1 tolerance=0.1 visibility=false"),
    (
        {"passes": 0, "start": "soft"},
        "adaptive=5.0 mending=1 hidden=0.1 small_step=0.1 large_step=2.0 contrast=5.0 confidence=both",
    ),
    ({"window": 1}, "adaptive=5.0"),
    ({"similarity": "ssd"}, "alike=5.0"),
    ({"similarity": "census", "alike": 0.0}, "truncation=5.0 colour=false"),
    ({"optimiser": "fista", "passes": 5, "start": "soft"}, "adaptive=5.0 mending=1"),
    (
        {"optimiser": "fista", "passes": 5, "start": "mean", "binarization": "ray"},
        "hidden=0.1 material=0.1 contrast=5.0",
    ),
    ({"optimiser": "fista", "passes": 5, "across": 0.0, "along": 0.0}, "edge=5.0"),
    ({"optimiser": "fista", "passes": 5, "count": 0.0}, "counted=global target=union"),
    ({"optimiser": "fista", "passes": 2}, "tolerance=0.9 confidence=materiality visibility=false"),
]


@pytest.mark.parametrize(("base", "options"), SILENT, ids=str)
def test_what_changes_nothing_is_refused_and_changes_nothing(base, options):
    (one,) = parse(f"materiality[{options}]")
    scene = box_before_wall(n=3, height=12, width=20)
    plain = Materiality(**base)
    found = plain.solve(scene, Context())
    defaults = parameters(Materiality)
    for name, text in one.options.items():
        with pytest.raises(UserError, match=rf"^materiality: {name}=\S+ changes nothing here: it takes [a-z]"):
            refuse_silent("materiality", plain, {name: text})
        silent = build("materiality", Materiality, {**base, name: text})  # as a stored run may have it
        with pytest.raises(ValueError, match=f"{name}=.* changes nothing"):
            Materiality(**base, **{name: values_of(silent)[name]})
        Materiality(**base, **{name: defaults[name].default})
        other = silent.solve(scene, Context())
        np.testing.assert_array_equal(other.disparity[1], found.disparity[1])
        np.testing.assert_array_equal(other.volume.values, found.volume.values)


def test_only_a_descent_is_read_as_maps():
    with pytest.raises(ValueError, match="binarization=maps changes nothing"):
        Materiality(binarization="maps")
    assert not Materiality(optimiser="fista", start="soft", binarization="maps").silent.keys() & {
        "adaptive", "mending", "material", "hidden", "small_step",
    }  # fmt: skip


def test_ties_read_the_colours_that_a_census_does_not():
    options = {"similarity": "census", "alike": 0.0, "optimiser": "fista"}
    assert "colour" in Materiality(**options, across=0.0, along=0.0).silent
    assert "colour" not in Materiality(**options).silent
