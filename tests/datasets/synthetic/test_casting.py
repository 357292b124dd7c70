"""Rays that meet surfaces, against plain twins."""

import numpy as np
import pytest
from odd_solids import KINDS, SKIN, hit, hits, solid

from matbench.datasets.synthetic import casting, solids
from matbench.datasets.synthetic.dice import Dice
from matbench.datasets.synthetic.solids import Model, flat


def on_surface(kind: int, row: np.ndarray, point: np.ndarray) -> float:
    """0 on the surface (without regard to where it ends), of another sign on either side."""
    a, b, c = row[3:12].reshape(3, 3) @ (point - row[:3])
    if kind < solids.BALL:
        return float(a)
    if kind in (solids.BALL, solids.HOLLOW):
        return float(a * a + b * b + c * c - 1)
    return float(a * a + b * b - (1 + row[12] * c) ** 2)


def holds(kind: int, row: np.ndarray, point: np.ndarray) -> bool:
    """Does the surface end before that point, which lies on it? Written out by angles and rounding."""
    _, a, b = (row[3:12].reshape(3, 3) @ (point - row[:3])).tolist()
    if kind in (solids.TUBE, solids.CONE):
        return abs(b) <= 1 and 1 + row[12] * b > 0
    if kind in (solids.BALL, solids.HOLLOW, solids.PLANE):
        return True
    size, square = max(abs(a), abs(b)), a * a + b * b
    if kind == solids.BLOB:
        # the spokes stand at equal steps of |a| + |b| along the square around the middle
        a, b = a / (abs(a) + abs(b)), b / (abs(a) + abs(b))
        step = 4 * ((a if b >= 0 else 2 - a) + 1)
        return bool(size <= 1 and np.sqrt(square) <= np.interp(step, range(17), [*row[12:28], row[12]]))
    if kind == solids.LATTICE:
        bars = [((v + 1) / 2 * n) % 1 < w for v, n, w in zip((a, b), row[12:14], row[14:16], strict=True)]
        return size <= 1 and any(bars)
    return {
        solids.BOX: size <= 1,
        solids.ELLIPSE: square <= 1,
        solids.LEAF: a * a + abs(b) <= 1,
        solids.RING: row[12] <= square <= 1,
    }[kind]


def twin(kind: int, row: np.ndarray, eye: float, right: float, down: float) -> float:
    """The first crossing of the surface, found by small steps along the ray and bisection."""
    way, start = np.array([right, down, 1.0]), np.array([eye, 0.0, 0.0])
    places = np.linspace(1e-6, 30, 3001)
    values = np.array([on_surface(kind, row, start + z * way) for z in places])
    crossings = np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))
    if kind == solids.HOLLOW:
        crossings = crossings[1:]
    for k in crossings:
        low, high = places[k], places[k + 1]
        for _ in range(60):
            middle = (low + high) / 2
            same = np.sign(on_surface(kind, row, start + middle * way)) == np.sign(values[k])
            low, high = (middle, high) if same else (low, middle)
        if holds(kind, row, start + low * way):
            return low
    return np.inf


@pytest.mark.parametrize("kind", [*KINDS, solids.PLANE])
def test_a_ray_meets_what_its_twin_meets(kind: int) -> None:
    dice, hits = Dice(kind, 1), 0
    for _ in range(6):
        one = solid(kind, dice)
        row = np.array(one.row)
        for _ in range(7):
            eye, right, down = dice.between(-0.1, 0.1), dice.between(-0.25, 0.25), dice.between(-0.2, 0.2)
            found, expected = hit(kind, row, eye, right, down), twin(kind, row, eye, right, down)
            assert found == pytest.approx(expected, abs=1e-9)
            hits += bool(np.isfinite(found))
    assert hits >= 3


@pytest.mark.parametrize("kind", [*KINDS, solids.PLANE])
def test_many_rays_at_a_time_meet_what_each_meets_alone(kind: int) -> None:
    """To the last bit: several are computed at a time, and what is left over one by one."""
    dice, rights = Dice(kind, 2), np.linspace(-0.4, 0.4, casting.ROOM + 7)
    row, down = np.array(solid(kind, dice).row), dice.between(-0.1, 0.1)
    together = hits(kind, row, 0.05, rights, down, 7, casting.ROOM)
    alone = [hit(kind, row, 0.05, right, down) for right in rights[7:]]
    np.testing.assert_array_equal(together, alone)


@pytest.fixture(scope="module")
def model() -> Model:
    dice = Dice(5)
    wall = flat(solids.PLANE, (0.0, 0.0, 4.0), (1.0, 0.0, 0.2), (0.0, 1.0, 0.0), SKIN)
    return Model.of([wall, *(solid(kind, dice) for kind in KINDS for _ in range(2))])


RIGHTS, DOWNS = np.linspace(-0.5, 0.5, 41), np.linspace(-0.4, 0.4, 31)


def cast(model: Model, eye: float) -> tuple[np.ndarray, np.ndarray]:
    depth, index = np.empty((31, 41)), np.empty((31, 41), np.int64)
    casting.depths(model.kinds, model.rows, model.windows(eye), eye, RIGHTS, DOWNS, depth, index)
    return depth, index


def brute(model: Model, eye: float, right: float, down: float) -> tuple[float, int]:
    """The nearest of all surfaces, each of them tried."""
    found = [hit(kind, row, eye, right, down) for kind, row in zip(model.kinds, model.rows, strict=True)]
    return min(found), int(np.argmin(found))


@pytest.mark.parametrize("eye", [-0.2, 0.0, 0.3])
def test_no_surface_is_missed_by_windows(model: Model, eye: float) -> None:
    depth, index = cast(model, eye)
    for y, down in enumerate(DOWNS):
        for x, right in enumerate(RIGHTS):
            assert (depth[y, x], index[y, x]) == brute(model, eye, right, down)
    assert len(np.unique(index)) >= 9


def test_a_point_is_seen_unless_something_lies_before_it(model: Model) -> None:
    depth, _ = cast(model, 0.0)
    eye, focal, middle = 0.15, 40.0, 20.0
    places = (RIGHTS * depth - eye) / depth * focal + middle
    seen = np.zeros(depth.shape, bool)
    casting.seen(model.kinds, model.rows, model.windows(eye), eye, middle, focal, DOWNS, 0.0, places, depth, seen)
    framed = (places >= -0.5) & (places < 40.5)
    for y, x in np.ndindex(depth.shape):
        first, _ = brute(model, eye, (places[y, x] - middle) / focal, DOWNS[y])
        assert seen[y, x] == (framed[y, x] and first >= depth[y, x] * (1 - 1e-7))
    assert 0.3 < seen.mean() < 0.95
    lowered = np.ones(depth.shape, bool)
    casting.seen(model.kinds, model.rows, model.windows(eye), eye, middle, focal, DOWNS, 25.0, places, depth, lowered)
    assert not lowered[6:].any(), "out of the frame at its lower end"
    np.testing.assert_array_equal(lowered[:6], seen[:6])
