"""Typed parameters: what they may be, groups of them, and those that nothing reads."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pandas as pd
import pytest
from attrs import evolve, field, frozen, validators

from matbench.cli import main
from matbench.errors import UserError
from matbench.parameters import Parameter, build, changed, flat, parameters, refuse_silent, required, values_of
from matbench.spec import text

MINE = '''
import numpy as np
from attrs import field, frozen
from matbench import Context, Estimate, Scene

@frozen
class Guess:
    share: float = 0.5
    steps: int = 1

@frozen
class Mine:
    """A flat guess."""

    guess: Guess = field(factory=Guess)
    blind: bool = False

    @property
    def silent(self):
        return {"share": "blind=false"} if self.blind else {}

    def solve(self, scene: Scene, context: Context) -> Estimate:
        share = 0 if self.blind else self.guess.share
        flat = np.full((scene.height, scene.width), share * scene.disparities.largest, np.float32)
        return Estimate({scene.ref: flat})
'''
SCENE = "synthetic/box[size=64x48]"


def run(capsys: pytest.CaptureFixture[str], *tokens: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stop:
        main(list(tokens))
    said = capsys.readouterr()
    return int(stop.value.code or 0), said.out, said.err


def test_a_plug_in_with_a_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(MINE)
    plugin = ("--plugin", "mine.py")
    _, out, _ = run(capsys, "list", "--json", *plugin)
    assert json.loads(out)["algorithms"]["mine"]["parameters"] == {
        "share": {"type": "a number", "default": 0.5, "group": "guess"},
        "steps": {"type": "a whole number", "default": 1, "group": "guess"},
        "blind": {"type": "true or false", "default": False},
    }

    line = ("ablate", "mine[share=0.2,0.9]", "-s", SCENE, "--out", "run", *plugin)
    assert run(capsys, *line)[0] == 0
    change = pd.read_csv("run/ablation.csv")
    assert set(zip(change["factor"], change["base"], change["level"], strict=True)) == {("share", 0.2, 0.9)}
    assert (change["change"] != 0).any()

    def written() -> dict[Path, int]:
        return {path: path.stat().st_mtime_ns for path in Path("run").glob("cells/*/*")}

    before = written()
    assert run(capsys, *line)[0] == 0
    assert len(before) >= 2
    assert written() == before, "what is stored is found again"
    assert run(capsys, "score", "run")[0] == 0

    status, _, err = run(capsys, "ablate", "mine[blind=true share=0.2,0.9]", "-s", SCENE, *plugin)
    assert (status, err) == (2, "matbench: mine: share=0.2 changes nothing here: it takes blind=false\n")


def test_a_refused_number_is_told_without_the_words_of_attrs() -> None:
    @frozen
    class Sign:
        sign: int = field(default=1, validator=validators.in_((1, -1)))

    with pytest.raises(UserError) as told:
        build("m", Sign, {"sign": 2})
    assert str(told.value) == "m: 'sign' must be in (1, -1) (got 2)"


@frozen
class Sample:
    window: int = field(default=5, validator=validators.ge(1))
    sigma: float = 2.5
    pairs: Literal["all", "consecutive"] = "consecutive"
    fill: bool = True

    presets = {"paper": {"window": 3, "fill": False}}  # noqa: RUF012


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
