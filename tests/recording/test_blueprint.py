"""Panels of a recording."""

from pathlib import Path

from attrs import evolve
from small_recordings import rows, scene, write

from matbench.recording import blueprint, side_by_side
from matbench.recording.blueprint import Contents


def views_of(contents: Contents) -> list[str]:
    def names(part: object) -> list[str]:
        inner = [name for child in getattr(part, "contents", ()) or () for name in names(child)]
        own = getattr(part, "name", None)
        return ([str(own)] if own else []) + inner

    return names(blueprint.layout(contents).root_container)


def test_panels_are_for_what_is_there(tmp_path: Path) -> None:
    """One blueprint for each kind of method."""
    with_volume = side_by_side.contents_of(write(tmp_path / "1.rrd", scene(), "m on toy/box", 3))
    once = side_by_side.contents_of(write(tmp_path / "2.rrd", scene(), "m on toy/box", 1))
    only_map = side_by_side.contents_of(write(tmp_path / "3.rrd", scene(), "m on toy/box", 0))
    names = views_of(with_volume)
    for name in ("Energy of each pass", "Error of each pass, total_bad_1 in %", "Epipolar slices, row 6", "Volumes"):
        assert name in names
    assert "Materiality in disparity space" in names
    assert not [name for name in views_of(once) if "each pass" in name], "one point is no curve"
    assert "**total**, told once: 0" in rows(tmp_path / "2.rrd")["/about"][0]["TextDocument:text"][0]  # type: ignore[index]
    names = views_of(only_map)
    assert "Answer in disparity space" in names
    assert not [name for name in names if name.startswith(("Epipolar", "Volumes", "Materiality"))]
    changed = evolve(once, told={"changed": [0.5, 0.1]})
    assert "Changed of each pass" in views_of(changed)
