"""Scenes fetched from a real server: from archives or single files, from the site or a mirror."""

import shutil
from pathlib import Path

import pytest
from toy_downloads import FOLDER, NAMES, OTHER, PICTURES, PIXELS, PLACED, WHOLE, bring, encoded, inside, zipped

from matbench.errors import UserError
from matbench.scenes.dataset import Download
from matbench.scenes.fetching import look, site_of


def test_from_an_archive(site, toy: Download, root: Path) -> None:
    site.files["zip/box.zip"] = WHOLE
    result = bring(toy, root)
    assert (result.came, result.there, result.missing, result.reasons) == (NAMES, (), (), ())
    assert result.bytes == len(WHOLE)
    assert inside(root) == PLACED
    assert [path.name for path in (root / FOLDER).iterdir() if path.is_dir()] == []
    assert [path for path, *_ in site.requests] == ["zip/box.zip"]


def test_from_single_files_where_there_is_no_archive(site, toy: Download, root: Path) -> None:
    site.files |= {f"box/{name}": raw for name, raw in PICTURES.items()}
    result = bring(toy, root)
    assert result.came == NAMES
    assert inside(root) == PLACED
    assert result.bytes == sum(map(len, PICTURES.values()))


def test_each_source_adds_what_it_has(site, toy: Download, root: Path) -> None:
    site.files["zip/box.zip"] = zipped(("im0.ppm", PICTURES["im0.ppm"]), ("disp1.pgm", PICTURES["disp1.pgm"]))
    site.files["box/im1.ppm"] = PICTURES["im1.ppm"]
    result = bring(toy, root)
    assert set(result.came) == {"im0.ppm", "im1.ppm", "disp1.pgm"}
    assert result.missing == ("im2.ppm",)
    assert any("holds no plain file im1.ppm, im2.ppm" in reason for reason in result.reasons)
    assert any("box/im2.ppm: 404" in reason for reason in result.reasons)
    assert inside(root) == {path: raw for path, raw in PLACED.items() if "im2" not in path}, "what came is kept"
    site.files["box/im2.ppm"] = PICTURES["im2.ppm"]
    again = bring(toy, root)
    assert (again.came, len(again.there), again.missing) == (("im2.ppm",), 3, ())


@pytest.mark.parametrize("where", ["archive", "folder"])
def test_the_same_pixels_in_another_format_are_the_same_picture(site, toy: Download, root: Path, where: str) -> None:
    others = {f"{Path(name).stem}.png": encoded("a.png", pixels) for name, pixels in PIXELS.items()}
    if where == "archive":
        site.files["zip/box.zip"] = zipped(*others.items())
    else:
        site.files |= {f"box/{name}": raw for name, raw in others.items()}
    result = bring(toy, root)
    assert result.missing == ()
    assert inside(root) == {str(FOLDER / name): raw for name, raw in others.items()}
    assert bring(toy, root).there == tuple(others)


@pytest.mark.parametrize("where", ["archive", "folder"])
@pytest.mark.parametrize("content", [OTHER, PICTURES["im1.ppm"], b"<!DOCTYPE html>", b"", PICTURES["im0.ppm"][:-5]])
def test_a_wrong_digest_is_never_placed(site, toy: Download, root: Path, where: str, content: bytes) -> None:
    contents = PICTURES | {"im0.ppm": content}
    if where == "archive":
        site.files["zip/box.zip"] = zipped(*contents.items())
    else:
        site.files |= {f"box/{name}": raw for name, raw in contents.items()}
    result = bring(toy, root)
    assert result.missing == ("im0.ppm",)
    assert any("im0.ppm is not the published picture" in reason.replace(": is", " is") for reason in result.reasons)
    assert inside(root) == {path: raw for path, raw in PLACED.items() if "im0" not in path}, "the others are placed"


def test_what_is_there_is_checked_and_not_fetched(site, toy: Download, root: Path) -> None:
    site.files["zip/box.zip"] = WHOLE
    bring(toy, root)
    asked = len(site.requests)
    result = bring(toy, root)
    assert (result.came, result.there, result.missing) == ((), NAMES, ())
    assert len(site.requests) == asked
    (seen,) = look([toy], root)
    assert seen.there == NAMES


def test_a_folder_that_may_only_be_read_is_enough_if_all_is_there(site, toy: Download, root: Path) -> None:
    site.files["zip/box.zip"] = WHOLE
    bring(toy, root)
    shutil.rmtree(root / ".fetch")
    assert bring(toy, root).there == NAMES
    assert not (root / ".fetch").exists()


def test_somebody_elses_file_is_not_written_over(site, toy: Download, root: Path) -> None:
    site.files["zip/box.zip"] = WHOLE
    (root / FOLDER).mkdir(parents=True)
    (root / FOLDER / "im0.ppm").write_bytes(OTHER)
    (root / FOLDER / "im1.png").mkdir()
    result = bring(toy, root)
    assert result.missing == ("im0.ppm", "im1.ppm")
    assert (root / FOLDER / "im0.ppm").read_bytes() == OTHER
    said = " ".join(result.reasons)
    assert f"{root / FOLDER / 'im0.ppm'} is not the published file: move it away" in said
    assert f"{root / FOLDER / 'im1.png'} is a folder" in said
    assert set(result.came) == {"im2.ppm", "disp1.pgm"}


def test_nothing_stays_of_a_scene_that_is_nowhere(site, toy: Download, root: Path) -> None:
    result = bring(toy, root)
    assert result.missing == NAMES
    assert "zip/box.zip: 404" in result.reasons[0]
    assert not (root / FOLDER).exists()
    assert result.urls == (f"{site.url}zip/box.zip", f"{site.url}box/")


def test_a_mirror_takes_the_place_of_the_site(serve, site, toy: Download, root: Path) -> None:
    mirror = serve()
    mirror.files["stereo/zip/box.zip"] = WHOLE
    assert bring(toy, root, mirror=f"{mirror.url}stereo/").missing == ()
    assert site.requests == []


@pytest.mark.parametrize(
    "mirror",
    [
        "",
        "ftp://host/",
        "file:///data",
        "localhost:8000",
        "http://",
        "https:///x",
        "http://[",
        "http://host:port/",
        "http://host:99999/",
        "http://:80/",
        f"http://{'x' * 64}.org/",
        "http://é..org/",
    ],
)
def test_what_is_no_mirror_is_refused(mirror: str) -> None:
    with pytest.raises(UserError, match=r"no address: write http://HOST/PATH/"):
        site_of(mirror)
    assert site_of("http://localhost:8000/x") == "http://localhost:8000/x/"
