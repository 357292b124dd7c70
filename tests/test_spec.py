"""Selectors: what is asked for, by name and options."""

import re
from time import process_time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from matbench import spec
from matbench.errors import UserError
from matbench.spec import Spec, expand, labelled, parse, split_label


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
