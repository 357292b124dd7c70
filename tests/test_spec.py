"""Selectors and typed parameters."""

import re
from dataclasses import dataclass
from time import process_time
from typing import Literal

import pytest
from attrs import evolve, field, frozen, validators
from hypothesis import given
from hypothesis import strategies as st

from matbench import spec
from matbench.errors import UserError
from matbench.parameters import Parameter, build, changed, flat, parameters, refuse_silent, required, values_of
from matbench.spec import Spec, expand, labelled, parse, split_label, text


@frozen
class Sample:
    window: int = field(default=5, validator=validators.ge(1))
    sigma: float = 2.5
    pairs: Literal["all", "consecutive"] = "consecutive"
    fill: bool = True

    presets = {"paper": {"window": 3, "fill": False}}  # noqa: RUF012


def test_a_bare_name_has_no_options() -> None:
    assert parse("sgbm") == [Spec("sgbm")]


def test_commas_give_every_combination_in_order() -> None:
    specs = parse("materiality[pairs=all,consecutive binarization=plane,volume]")
    assert [str(s) for s in specs] == [
        "materiality[pairs=all binarization=plane]",
        "materiality[pairs=all binarization=volume]",
        "materiality[pairs=consecutive binarization=plane]",
        "materiality[pairs=consecutive binarization=volume]",
    ]


def test_brackets_are_read_before_patterns_and_slices() -> None:
    assert parse("middlebury2003/t*[views=0:9:2 size=half]") == [
        Spec("middlebury2003/t*", {"views": "0:9:2", "size": "half"})
    ]


def test_quotes_hold_blanks_and_commas_together_and_are_written_again() -> None:
    (one, two) = parse("a[x='my folder/a, b',c y=\"it's\"]")
    assert one == Spec("a", {"x": "my folder/a, b", "y": "it's"})
    assert two.options["x"] == "c"
    assert parse(str(one)) == [one]


def test_commas_outside_brackets_separate_selectors() -> None:
    assert [s.name for s in expand(["a,b[x=1,2]", "a"])] == ["a", "b", "b"]


@pytest.mark.parametrize(
    "bad", ["", "a[", "a]b", "a[x]", "a[=1]", "a[x=]", "a[x=1,]", "a[x=1][y=2]", "a b", "a[x=1 x=2]"]
)
def test_malformed_selectors_are_refused_in_one_line(bad: str) -> None:
    with pytest.raises(UserError) as error:
        parse(bad)
    assert "\n" not in str(error.value)


@given(st.text(max_size=30))
def test_any_text_is_read_or_refused(selector: str) -> None:
    try:
        specs = parse(selector)
    except UserError:
        return
    assert all(spec.name for spec in specs)


def test_written_values_become_typed_ones() -> None:
    sample = build("sample", Sample, {"window": "7", "sigma": "1e-3", "pairs": "all", "fill": "no"})
    assert sample == Sample(7, 1e-3, "all", False)


def test_values_survive_being_stored_and_built_again() -> None:
    sample = Sample(9, 4.0, "all", False)
    assert build("sample", Sample, values_of(sample)) == sample


def test_only_changed_parameters_name_a_method() -> None:
    assert text(changed(Sample(fill=False, sigma=3.0))) == "sigma=3.0 fill=false"
    assert changed(Sample()) == {}


def test_a_preset_names_a_method_with_what_differs_from_it() -> None:
    sample = build("sample", Sample, {"preset": "paper", "fill": "true"})
    assert text(changed(sample, "paper")) == "preset=paper fill=true"
    assert text(changed(Sample(3, fill=False), "paper")) == "preset=paper"


def test_a_preset_is_a_start_that_options_override() -> None:
    assert build("sample", Sample, {"preset": "paper", "fill": "true"}) == Sample(3, fill=True)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"windw": "3"}, "unknown parameter 'windw' of sample: did you mean 'window'?"),
        ({"window": "three"}, "sample: window=three is not a whole number"),
        ({"window": "2.5"}, "sample: window=2.5 is not a whole number"),
        ({"window": 2.5}, "sample: window=2.5 is not a whole number"),
        ({"fill": "perhaps"}, "sample: fill=perhaps is not true or false"),
        ({"pairs": "some"}, "sample: pairs=some is not all or consecutive"),
        ({"sigma": "wide"}, "sample: sigma=wide is not a number"),
        ({"sigma": "inf"}, "sample: sigma=inf is not a number"),
        ({"sigma": float("nan")}, "sample: sigma=nan is not a number"),
        ({"preset": "best"}, "unknown preset 'best' of sample"),
        ({"window": "0"}, "sample: 'window' must be >= 1: 0"),
    ],
)
def test_wrong_parameters_are_named_with_what_is_possible(options: dict[str, object], said: str) -> None:
    with pytest.raises(UserError) as error:
        build("sample", Sample, options)
    assert str(error.value).startswith(said)


def test_dataclasses_and_plain_classes_have_parameters_too() -> None:
    @dataclass(frozen=True)
    class Data:
        window: int = 3

    class Plain:
        def __init__(self, window: int = 3) -> None:
            self.window = window

    class Nothing:
        pass

    assert build("data", Data, {"window": "4"}).window == 4
    assert build("plain", Plain, {"window": "4"}).window == 4
    assert parameters(Nothing) == {}


def test_a_parameter_without_default_must_be_given() -> None:
    class Plain:
        def __init__(self, window: int) -> None:
            self.window = window

    with pytest.raises(UserError, match="window must be given"):
        build("plain", Plain, {})


def test_parameters_without_annotation_have_the_type_of_their_default() -> None:
    class Plain:
        def __init__(self, share=0.5, name=None):  # type: ignore[no-untyped-def]
            self.share, self.name = share, name

    assert build("plain", Plain, {"share": "2"}).share == 2.0
    assert build("plain", Plain, values_of(Plain())).name is None


@pytest.mark.parametrize("value", [object(), [1], {}])
def test_a_parameter_must_be_kept_as_a_simple_value(value: object) -> None:
    class Plain:
        def __init__(self, share: float = 0.5) -> None:
            self.share = value

    class Forgets:
        def __init__(self, share: float = 0.5) -> None:
            pass

    for cls in (Plain, Forgets):
        with pytest.raises(UserError, match=r"must be kept as self\.share"):
            values_of(cls())


def test_an_annotation_that_names_nothing_is_said() -> None:
    class Odd:
        def __init__(self, share: "nowhere" = 0.5) -> None:  # type: ignore[name-defined]  # noqa: F821
            pass

    with pytest.raises(UserError, match="cannot be read"):
        parameters(Odd)


@frozen
class Cost:
    window: int = field(default=5, validator=validators.ge(1))
    sigma: float = 2.5


@frozen
class Search:
    cost: Cost = field(factory=Cost)
    passes: int = 3


@flat
@frozen
class Grouped:
    fill: bool = True
    search: Search = Search(passes=4)

    presets = {"paper": {"window": 3, "passes": 9}}  # noqa: RUF012

    @property
    def silent(self) -> dict[str, str]:
        return {} if self.search.passes else {"sigma": "passes above 0", "fill": "passes above 0"}


def test_the_fields_of_a_group_are_parameters_under_their_own_names() -> None:
    assert parameters(Grouped) == {
        "fill": Parameter(bool, True),
        "window": Parameter(int, 5, "search"),
        "sigma": Parameter(float, 2.5, "search"),
        "passes": Parameter(int, 4, "search"),
    }
    made = build("grouped", Grouped, {"sigma": "1", "fill": "no"})
    assert made == Grouped(False, Search(Cost(sigma=1.0), passes=4))
    assert values_of(made) == {"fill": False, "window": 5, "sigma": 1.0, "passes": 4}
    assert build("grouped", Grouped, values_of(made)) == made
    assert text(changed(made)) == "fill=false sigma=1.0"
    from_preset = build("grouped", Grouped, {"preset": "paper", "passes": "4"})
    assert text(changed(from_preset, "paper")) == "preset=paper passes=4"
    with pytest.raises(UserError, match="grouped: 'window' must be >= 1: 0"):
        build("grouped", Grouped, {"window": "0"})
    with pytest.raises(UserError, match="unknown parameter 'search' of grouped"):
        build("grouped", Grouped, {"search": "1"})


def test_a_group_of_a_plain_class_needs_nothing_else() -> None:
    class Plain:
        def __init__(self, cost: Cost, share: float = 0.5) -> None:
            self.cost, self.share = cost, share

    assert required(Plain) == []
    assert build("plain", Plain, {"window": "7"}).cost == Cost(7)
    assert values_of(build("plain", Plain, {})) == {"window": 5, "sigma": 2.5, "share": 0.5}


def test_python_takes_flat_names_too() -> None:
    made = Grouped(window=7)  # type: ignore[call-arg]
    assert made == Grouped(search=Search(Cost(7), 4))
    assert evolve(made, sigma=1.0, fill=False) == Grouped(False, Search(Cost(7, 1.0), 4))
    assert Grouped(search=Search(Cost(7)), passes=2) == Grouped(search=Search(Cost(7), 2))  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="windw"):
        Grouped(windw=7)  # type: ignore[call-arg]


def test_two_parameters_of_one_name_are_refused() -> None:
    @frozen
    class Other:
        sigma: int = 3

    @frozen
    class Twice:
        cost: Cost = field(factory=Cost)
        other: Other = field(factory=Other)

    @frozen
    class Named:
        sigma: Cost = field(factory=Cost)

    for cls in (Twice, Named):
        with pytest.raises(UserError, match=r"parameter 'sigma' of group .* has the name of another"):
            parameters(cls)


def test_a_parameter_that_changes_nothing_is_refused_where_it_is_set() -> None:
    with pytest.raises(ValueError, match=r"sigma=1\.0 changes nothing here: it takes passes above 0"):
        Grouped(passes=0, sigma=1.0)  # type: ignore[call-arg]
    still = Grouped(passes=0, sigma=2.5)  # type: ignore[call-arg]
    assert build("grouped", Grouped, {"passes": 0, "sigma": 1.0}).search.cost.sigma == 1, "a stored run goes on"
    refuse_silent("grouped", still, {"passes": "0", "window": "3"})
    for option, value in [("sigma", "2.5"), ("fill", "true")]:
        with pytest.raises(UserError, match=f"^grouped: {option}={value} changes nothing here: it takes passes above"):
            refuse_silent("grouped", still, {"passes": "0", option: value})
    refuse_silent("sample", Sample(), {"fill": "true"})


def test_a_silent_that_means_something_else_is_let_be() -> None:
    @frozen
    class Quiet:
        silent: bool = True

    refuse_silent("quiet", Quiet(), {"silent": "true"})


def test_a_silent_that_fails_is_one_line() -> None:
    class Fails:
        @property
        def silent(self) -> dict[str, str]:
            raise ValueError("no window\nand more")

    with pytest.raises(UserError, match="fails: its silent parameters cannot be told: no window") as error:
        refuse_silent("fails", Fails(), {})
    assert "\n" not in str(error.value)


def test_more_combinations_than_memory_holds_are_counted_and_not_made(monkeypatch: pytest.MonkeyPatch) -> None:
    many = "synthetic/box[" + " ".join(f"o{k}=1,2" for k in range(40)) + "]"
    assert spec.count(many) == 2**40
    with pytest.raises(UserError, match=r"^'synthetic/box.*' means 1099511627776 combinations: 100000 are possible$"):
        spec.parse(many)
    assert spec.read_scene(many).name == many
    monkeypatch.setattr(spec, "MOST", 100)
    with pytest.raises(UserError, match="101 names are asked for: 100 are possible"):
        spec.expand([f"a{k}" for k in range(101)])


def test_a_selector_of_commas_alone_is_read_in_no_time() -> None:
    begin = process_time()
    assert spec.count("a" + ",b" * 30_000) == 30_001
    with pytest.raises(UserError, match="is no selector: it has 200002 characters, 65536 at most"):
        spec.parse("a" + "," * 200_000 + "b")
    assert process_time() - begin < 2


@given(st.text("a,[]=x ", max_size=12))
def test_selectors_are_split_where_no_bracket_is_open(selector: str) -> None:
    """As the plain rule says it, which takes the square of the length."""
    assert spec._split(selector) == re.split(r",(?![^\[]*\])", selector)


@pytest.mark.parametrize(
    ("typed", "found"),
    [
        ("mine as before", [("mine", "before", ())]),
        (
            "mine[x=1,2 y=3] as 'wide, [slow]', sgbm",
            [("mine[x=1 y=3]", "wide, [slow]", ("x",)), ("mine[x=2 y=3]", "wide, [slow]", ("x",)), ("sgbm", "", ())],
        ),
        ('a as "it\'s", b as c-1.2+d', [("a", "it's", ()), ("b", "c-1.2+d", ())]),
        ("old/mine.py:Mine[x=1] as  before ", [("old/mine.py:Mine[x=1]", "before", ())]),
        ("my files/as was/mine.py:Mine", [("my files/as was/mine.py:Mine", "", ())]),
        ("command[args='run as root']", [("command[args='run as root']", "", ())]),
        ("command[args=\"a as 'b', c\"]", [("command[args=\"a as 'b', c\"]", "", ())]),
        ("sgbm as 間", [("sgbm", "間", ())]),
        ("mine as '../x'", [("mine", "../x", ())]),
        ("./as it was/a as b.py:Mine", [("./as it was/a as b.py:Mine", "", ())]),
        ("'./a, b[1].py:Mine'[x=1] as b, sgbm", [("'./a, b[1].py:Mine'[x=1]", "b", ()), ("sgbm", "", ())]),
    ],
)
def test_a_label_follows_a_method(typed: str, found: list[tuple[str, str, tuple[str, ...]]]) -> None:
    said = [(str(one.spec), one.label, one.swept) for one in labelled(typed)]
    assert said == [(str(parse(text)[0]), label, swept) for text, label, swept in found]


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("mine as", "a label of several words stands in quotes"),
        ("mine as two words", "a label of several words stands in quotes"),
        ("mine as ' '", "the label in \"mine as ' '\" is empty"),
        ("mine as 'a\tb'", "label 'a\\tb' holds a tab"),
        ("mine as '\u202egnp'", "holds the hidden character U+202E"),
        (f"mine as '{'x' * 5000}'", "label has 5000 characters"),
        ("as before", "cannot read"),
        ("mine as ../x", "the label in 'mine as ../x': one with a slash stands in quotes"),
        ("sgbm, mine as a/b", "the label in 'mine as a/b': one with a slash stands in quotes"),
    ],
)
def test_labels_that_cannot_be_are_one_line(typed: str, said: str) -> None:
    with pytest.raises(UserError) as caught:
        labelled(typed)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@given(st.text(max_size=30), st.sampled_from(["", " as x", " as 'y, z'", ' as "', " as "]))
def test_any_text_with_a_label_is_read_or_refused(selector: str, label: str) -> None:
    try:
        found = labelled(selector + label)
    except UserError:
        return
    assert all(one.spec.name for one in found)
    if label == " as x":
        assert found[-1].label == "x"


def test_scenes_have_no_labels() -> None:
    with pytest.raises(UserError, match="cannot read 'synthetic as box'"):
        expand("synthetic as box")
    assert split_label("runs/old as before") == ("runs/old", "before")


@given(st.text("ab,[]=' \"/.1", min_size=1, max_size=9).filter(lambda name: name.strip() == name))
def test_a_name_with_brackets_and_commas_is_written_in_quotes_and_read_again(name: str) -> None:
    if '"' in name and "'" in name:
        return
    for one in (Spec(f"./{name}"), Spec(f"./{name}", {"views": "0+2"})):
        assert parse(f"{one},b") == [one, Spec("b")]


def test_a_name_with_blanks_that_is_no_path_is_written_in_quotes_and_read_again() -> None:
    for one in (Spec("my scene"), Spec("left as right", {"views": "0+2"})):
        assert expand(f'"{one.name}"') == [Spec(one.name)]
        assert parse(str(one)) == [one]
    assert str(Spec("./my scene")) == "./my scene"
