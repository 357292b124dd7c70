"""Rewrite ``appearance.json``: how surfaces and cameras of real scenes look, in numbers.

    python -m matbench.datasets.synthetic.make_appearance [--data DIR]

No picture is kept: of each scene 20 patches of 20 x 20 px without depth edges, described by six numbers each
(`PATCH`), the noise of its flattest places, and the spread of its sharpest edges.
"""

import argparse
import json
from collections.abc import Sequence
from math import erf, pi, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, uniform_filter

from matbench.scene import Scene
from matbench.scenes.catalogue import load_scene

APPEARANCE = Path(__file__).with_name("appearance.json")
SCENES = (
    *(f"middlebury2001/{name}" for name in ("sawtooth", "tsukuba", "venus")),
    "middlebury2003/teddy",
    "middlebury2005/Reindeer[size=half]",
    *(f"middlebury2006/{name}" for name in ("Aloe", "Baby1", "Bowling1", "Cloth1", "Lampshade1", "Plastic", "Rocks1")),
)
PATCH = ("brightness", "red", "blue", "contrast", "fine", "colourfulness")
"""Of a patch, in grey levels: the mean of its pixels' channels; by how much red and blue exceed it; the standard
deviation; that of what a Gaussian of 1 px takes away; that of the channels' departures from grey."""

_SIDE, _COUNT = 20, 20
_JUMP = 1.01  # px of the pair between neighbours: more is a depth edge
_EDGE = 40  # grey levels of a step whose spread is measured


def patches(scene: Scene, seed: int = 0) -> list[list[float]]:
    """Random patches without depth edges, each as `PATCH` says."""
    image, truth = scene.views[scene.ref].astype(np.float64), scene.truth[scene.ref] * scene.pair_steps
    grey = image.mean(axis=2)
    taken = grey - gaussian_filter(grey, 1.0)
    drawn, found = np.random.default_rng(seed), []
    for _ in range(200 * _COUNT):
        y, x = (int(drawn.integers(0, size - _SIDE)) for size in grey.shape)
        window = np.s_[y : y + _SIDE, x : x + _SIDE]
        here = truth[window]
        if not max(np.abs(np.diff(here, axis=axis)).max() for axis in (0, 1)) < _JUMP:  # unknown truth neither
            continue
        red, green, blue = image[window].mean(axis=(0, 1))
        mean = (red + green + blue) / 3
        colours = float((image[window] - grey[window][:, :, None]).std(axis=(0, 1)).mean())
        values = (mean, red - mean, blue - mean, grey[window].std(), taken[window].std(), colours)
        found.append([round(float(value), 1) for value in values])
        if len(found) == _COUNT:
            break
    return found


def noise(scene: Scene) -> float:
    """Standard deviation of a channel's noise in the flattest 2 % of the picture (Immerkaer 1996)."""
    level = scene.views[scene.ref][..., 1].astype(np.float64)
    mask = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], float)
    parts = sum(
        mask[j, i] * level[j : level.shape[0] - 2 + j, i : level.shape[1] - 2 + i] for j in range(3) for i in range(3)
    )
    size = uniform_filter(np.abs(parts), 7)
    return round(float(np.quantile(size, 0.02)) * sqrt(pi / 2) / 6, 2)


def sharpness(grey: NDArray[np.float64]) -> float:
    """Median share of a step that lies between two neighbouring pixels, over the isolated steps along the rows."""
    steps = np.diff(grey, axis=1)
    windows = np.lib.stride_tricks.sliding_window_view(steps, 7, axis=1)
    height = np.abs(windows.sum(axis=2))
    largest = np.abs(windows).max(axis=2)
    inner = np.abs(windows[:, :, 3])
    alone = (np.abs(windows).sum(axis=2) < 1.1 * height) & (height > _EDGE) & (inner == largest)
    alone &= np.abs(windows[:, :, [0, 1, 5, 6]]).max(axis=2) < 0.08 * height
    return float(np.median(largest[alone] / height[alone])) if alone.sum() > 30 else float("nan")


def spread(share: float) -> float:
    """Deviation in px of the Gaussian that, with square pixels, leaves that share of a step between two of them."""

    def left(sigma: float) -> float:
        places = np.linspace(-0.5, 0.5, 41)  # of the step between two pixels' middles
        fine = np.linspace(-0.5, 0.5, 21)

        def seen(at: float) -> float:
            return float(np.mean([0.5 * (1 + erf((at + f) / (sigma * sqrt(2)))) for f in fine]))

        return float(np.median([seen(0.5 - p) - seen(-0.5 - p) for p in places]))

    sigmas = np.linspace(0.05, 1.5, 59)
    return round(float(np.interp(-share, [-left(sigma) for sigma in sigmas], sigmas)), 2)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure the scenes and write the file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data")
    scenes = [load_scene(name, parser.parse_args(arguments).data) for name in SCENES]
    sharp = [sharpness(scene.views[scene.ref].astype(np.float64).mean(axis=2)) for scene in scenes]
    rows = ",\n  ".join(json.dumps(row) for number, scene in enumerate(scenes) for row in patches(scene, number))
    found = {
        "patch": PATCH,
        "patches": [],
        "noise": [noise(scene) for scene in scenes],
        "blur": sorted(spread(share) for share in sharp if np.isfinite(share)),
    }
    text = json.dumps(found, indent=1).replace('"patches": []', f'"patches": [\n  {rows}\n ]')
    APPEARANCE.write_text(text + "\n", "utf-8")


if __name__ == "__main__":
    main()
