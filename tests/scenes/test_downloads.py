"""Which scenes can be fetched, by their names."""

import pytest

from matbench.errors import UserError
from matbench.scenes.downloads import downloads


@pytest.mark.parametrize(
    ("selectors", "names", "left_out"),
    [
        ("paper", ["middlebury2001/tsukuba", "middlebury2006/Rocks1", "middlebury2003/teddy"], []),
        (["middlebury2003/teddy[size=half]"], ["middlebury2003/teddy[size=half]"], []),
        (["middlebury2003/teddy[size=quarter,half]"], ["middlebury2003/teddy", "middlebury2003/teddy[size=half]"], []),
        (["middlebury2003/*", "middlebury2003/teddy"], ["middlebury2003/cones", "middlebury2003/teddy"], []),
        ("paper[size=half]", ["middlebury2006/Rocks1[size=half]", "middlebury2003/teddy[size=half]"], ["tsukuba"]),
        (
            "middlebury2005/D*[size=full]",
            ["middlebury2005/Dolls[size=full]", "middlebury2005/Dwarves"],
            ["Drumsticks"],
        ),
    ],
)
def test_selectors(selectors, names: list[str], left_out: list[str]) -> None:
    chosen, others = downloads(selectors)
    assert [one.name for one in chosen] == names
    assert all(name in said for name, said in zip(left_out, others, strict=True))


@pytest.mark.parametrize(
    ("selector", "said"),
    [
        ("middlebury2006/aloe", "unknown scene 'middlebury2006/aloe': did you mean 'middlebury2006/Aloe'?"),
        ("middelbury2006/*", "no scene that can be fetched is called 'middelbury2006/*'"),
        ("middelbury2006/Aloe", "unknown dataset 'middelbury2006': did you mean 'middlebury2006'?"),
        ("middlebury2006/Aloe[size=full]", "size full is not known, known: third, half"),
        ("middlebury2001/*[size=half]", "size half is not known"),
        ("middlebury2005/Drumsticks", "none of its files is known"),
        ("middlebury2006/Aloe[views=0:3]", "unknown option 'views' of fetch"),
        ("synthetic/box", "the scenes of synthetic are not downloaded"),
        ("teddy", "scene 'teddy' has no dataset"),
        ("middlebury2006/[", "cannot read"),
    ],
)
def test_what_cannot_be_fetched_is_refused_in_one_line(selector: str, said: str) -> None:
    with pytest.raises(UserError) as caught:
        downloads(selector)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
