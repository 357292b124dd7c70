"""A scene as bytes and back, to the bit."""

from hashlib import sha256

import numpy as np
import pytest
from attrs import evolve, fields
from scenes_alike import alike

from matbench.scene import HeldOut, Range, Scene
from matbench.scenes.packed import packed, unpacked

RNG = np.random.default_rng(3)
SHAPE = 3, 5, 7


def made(**changes: object) -> Scene:
    """A scene of which no part has its default."""
    truth = {view: RNG.normal(size=SHAPE[1:]).astype(np.float32) for view in (2, 0)}
    truth[2][1, 2:4] = np.nan, -0.0
    whole = Scene(
        name="synthetic/odd[noise=0.1 n=3]",
        views=RNG.integers(0, 256, (*SHAPE, 3), np.uint8),
        labels=("a", "ä", "雪"),
        ref=1,
        disparities=Range(-1 / 3, 8),
        truth=truth,
        pair_steps=0.1 + 0.2,
        regions={name: RNG.random(SHAPE[1:]) < 0.5 for name in ("occ", "all")},
        visible={view: RNG.random(SHAPE) < 0.5 for view in (2, 1)},
        metrics="hci",
        positions=(0, 1.5, 1 / 3 + 2),
        sparse=True,
    )
    return evolve(whole, **changes)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"pair_steps": 2, "disparities": Range(0, 7), "positions": (), "sparse": False, "metrics": ""},
        {"truth": {}, "regions": {}, "visible": {}},
        {"regions": {}},
        {"visible": {}},
    ],
    ids=["all", "plain", "views", "no regions", "no visibility"],
)
def test_all_of_it_comes_back(changes: dict[str, object]) -> None:
    scene = made(**changes)
    alike(unpacked(packed(scene, "key"), "key"), scene)


def test_nothing_of_a_scene_is_forgotten() -> None:
    """A field that a scene will have one day must be written, too; and `made` must set it."""
    defaults = Scene("x/y", np.zeros((3, 5, 7, 3), np.uint8), ("", "", ""), 0, Range(0, 1), {}, 1)
    same = [one.name for one in fields(Scene) if repr(getattr(made(), one.name)) == repr(getattr(defaults, one.name))]
    assert same == ["held_out"]


def test_what_is_read_can_be_used_as_it_lies() -> None:
    scene = unpacked(packed(made(), "key"), "key")
    for array in (scene.views, *scene.truth.values(), *scene.regions.values(), *scene.visible.values()):
        assert array.flags.aligned
        assert array.flags.c_contiguous
        assert not array.flags.writeable
    copied = [mask for mask in (*scene.regions.values(), *scene.visible.values()) if mask.base is None]
    assert not copied, "masks lie in one array"


def test_views_do_not_lie_beside_the_truth() -> None:
    scene = unpacked(packed(made(), "key"), "key")
    array: object = scene.views
    while isinstance(array, np.ndarray) and array.base is not None:
        array = array.base
    assert len(memoryview(array).cast("B")) == scene.views.nbytes  # type: ignore[arg-type]


def test_a_view_that_is_held_out_is_not_written() -> None:
    scene = made(held_out=HeldOut("9", 1, np.zeros((5, 7, 3), np.uint8)))
    with pytest.raises(ValueError, match="a view is held out"):
        packed(scene, "key")


def test_every_changed_bit_is_noticed() -> None:
    content = packed(made(), "key")
    for place in range(len(content)):
        changed = bytearray(content)
        changed[place] ^= 1 << place % 8
        with pytest.raises(ValueError, match="cut, or has changed"):
            unpacked(bytes(changed), "key")


def test_whatever_is_missing_or_too_much_is_noticed() -> None:
    content = packed(made(), "key")
    for size in range(len(content)):
        with pytest.raises(ValueError, match="cut, or has changed"):
            unpacked(content[:size], "key")
    with pytest.raises(ValueError, match="cut, or has changed"):
        unpacked(content + b"\0", "key")


def test_another_scene_is_noticed() -> None:
    with pytest.raises(ValueError, match=r"holds no scene: .*it is key, not other"):
        unpacked(packed(made(), "key"), "other")


def sealed(body: bytes) -> bytes:
    return sha256(body).hexdigest().encode() + body


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b'"truth": [2, 0]', b'"truth": [2]'),
        (b'"truth": [2, 0]', b'"truth": [2, 1, 0]'),
        (b'"truth": [2, 0]', b'"truth": [2, 3]'),
        (b'"truth": [2, 0]', b'"truth": [[], 0]'),
        (b'"truth": [2, 0], ', b""),
        (b'"shape": [3, 5, 7, 3]', b'"shape": [3, -5, 7, 3]'),
        (b'"shape": [3, 5, 7, 3]', b'"shape": [3, -5, -7, 3]'),
        (b'"shape": [3, 5, 7, 3]', b'"shape": [3, 5e400, 7, 3]'),
        (b'"shape": [3, 5, 7, 3]', b'"shape": [3, 99999999999999999999999, 7, 3]'),
        (b'"shape": [3, 5, 7, 3]', b'"shape": [3, 5, 7]'),
        (b'"ref": 1', b'"ref": 9'),
        (b'"ref": 1', b'"ref": "1"'),
        (b'"disparities": [', b'"disparities": [9, '),
        (b'"sparse": true', b'"sparse": true, "held": 1'),
        (b'"name": ', b'"name": [], "was": '),
        (b'"regions": ["occ", "all"]', b'"regions": ["occ", "a\\nb"]'),
        (b"{", b"["),
    ],
)
def test_what_somebody_else_has_sealed_is_no_scene(old: bytes, new: bytes) -> None:
    body = packed(made(), "key")[64:]
    unpacked(sealed(body), "key")
    assert old in body
    with pytest.raises(ValueError, match="it holds no scene"):
        unpacked(sealed(body.replace(old, new, 1)), "key")


def test_without_a_first_line_it_is_no_scene() -> None:
    with pytest.raises(ValueError, match="it holds no scene"):
        unpacked(sealed(b"{}"), "key")


def test_many_brackets_are_not_parsed() -> None:
    with pytest.raises(ValueError, match=r"holds no scene: .*brackets"):
        unpacked(sealed(b"[" * 100_000 + b"\n"), "key")
