"""Descriptors of patches: the network against a walk over its taps, and against the library it was made for."""

from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from neighbours import random_scene
from tools import need

from matbench import load_scene
from matbench.algorithm import Context
from matbench.algorithms import mccnn
from matbench.algorithms.features import luma
from matbench.algorithms.mccnn import CHANNELS, RADIUS, STEPS, Layer, describe, descriptors, layers
from matbench.algorithms.sampling import fine_rows
from matbench.algorithms.similarity import Matcher, Matching
from matbench.errors import UserError
from matbench.files.onnx_file import read_model
from matbench.parameters import build
from matbench.plans import plugins


def made_up(seed: int = 0) -> tuple[Layer, ...]:
    """A network of the same form with other weights."""
    rng, channels = np.random.default_rng(seed), (1, *(CHANNELS,) * 5)

    def some(*shape: int) -> np.ndarray:
        return rng.normal(0, 1 / np.sqrt(np.prod(shape[1:]) or 1), shape).astype(np.float32)

    return tuple(Layer(some(one, 3, 3), some(one), some(other, one), some(other)) for one, other in pairwise(channels))


def slow(image: np.ndarray, network: tuple[Layer, ...]) -> np.ndarray:
    """(H, W, 64) descriptors, neighbour by neighbour in double precision."""
    values = np.pad(image.astype(float), RADIUS, mode="edge")[..., None]
    for number, layer in enumerate(network):
        height, width = values.shape[0] - 2, values.shape[1] - 2
        near = sum(
            layer.own[:, dy, dx].astype(float) * values[dy : dy + height, dx : dx + width]
            for dy in range(3)
            for dx in range(3)
        )
        values = (near + layer.own_bias) @ layer.mix.T.astype(float) + layer.mix_bias
        if number < 4:
            values = np.maximum(values, 0)
    return values / np.linalg.norm(values, axis=2, keepdims=True)


@pytest.fixture
def other_weights(monkeypatch: pytest.MonkeyPatch) -> tuple[Layer, ...]:
    """Tests without the package: the same form, other weights."""
    network = made_up()
    monkeypatch.setattr(mccnn, "network", lambda: network)
    monkeypatch.setattr(mccnn, "weights_file", lambda: Path("there"))
    return network


@pytest.mark.parametrize("size", [(1, 1), (3, 9), (70, 12)])
def test_the_network_is_its_equation(size: tuple[int, int]) -> None:
    image, network = np.random.default_rng(1).normal(0, 1, size).astype(np.float32), made_up(2)
    found = np.empty((*size, CHANNELS), np.int8)
    describe(image, network, found)
    # half a step of rounding
    assert np.abs(found / STEPS - slow(image, network)).max() <= 0.5 / STEPS + 1e-4
    assert len(np.unique(found)) > 20
    threaded = np.empty_like(found)
    describe(image, network, threaded, threads=3)
    np.testing.assert_array_equal(threaded, found)


def test_an_image_is_normalised_and_its_samples_are_those_of_shifted_images(other_weights: tuple[Layer, ...]) -> None:
    grey = luma(fine_rows(random_scene(2, 6, 9).views, 3))
    found = descriptors(grey, 3)
    assert found.shape == (2, 6, 27, CHANNELS)
    assert not found[:, :, 25:].any()
    for view in range(2):
        pixels = grey[view, :, ::3].astype(float)
        normal = (grey[view] - pixels.mean()) / pixels.std()
        for phase in range(3):
            expected = slow(normal[:, phase::3], other_weights)
            part = found[view, :, phase:25:3] / STEPS
            assert np.abs(part - expected[:, : part.shape[1]]).max() <= 0.5 / STEPS + 1e-4
    # another exposure of the same is the same
    np.testing.assert_allclose(descriptors(2 * grey + 9, 3).astype(int), found, atol=1)


def test_a_flat_image_has_the_same_descriptor_everywhere(other_weights: tuple[Layer, ...]) -> None:
    found = descriptors(np.full((1, 4, 7), 128, np.float32), 1)
    assert (found == found[:, :1, :1]).all()
    assert found.any()


@pytest.mark.parametrize(("window", "fineness"), [(1, 1), (3, 1), (3, 2), (5, 3)])
def test_similarity_is_the_product_of_descriptors(other_weights: tuple[Layer, ...], window: int, fineness: int) -> None:
    scene = random_scene(3, 4, 6)
    matcher = Matcher.of(scene, Matching(similarity="mccnn", window=window, fineness=fineness, pairs="all"))
    space, radius = matcher.space, window // 2
    fine = descriptors(luma(fine_rows(scene.views, fineness)), fineness).astype(int)
    expected = np.zeros((space.rows, len(matcher.pairs), space.planes, space.columns))
    for y, p, k, c in np.ndindex(expected.shape):
        i, j = matcher.pairs[p]
        ui, uj = c - space.start(i, k), c - space.start(j, k)
        if not (0 <= ui < space.samples and 0 <= uj < space.samples):
            continue
        apart = []
        for row in range(max(0, y - radius), min(space.rows, y + radius + 1)):
            for dx in range(-radius * fineness, radius * fineness + 1, fineness):
                if min(ui, uj) + dx >= 0 and max(ui, uj) + dx < space.samples:
                    product = fine[i, row, ui + dx] @ fine[j, row, uj + dx] / STEPS**2
                    apart.append(np.clip(1 - product, 0, 1))
        expected[y, p, k, c] = 1 - np.mean(apart)
    assert np.abs(matcher.all() / 255 - expected).max() <= 0.5 / 255 + 2e-5
    # on the rays of the reference view, whole pixels, where the windows end with the image, too
    rays = matcher.rays(matcher.phases(), 0, space.rows)
    for p, k in np.ndindex(rays.shape[1:3]):
        low, width, *_ = matcher.ray_spans(*matcher.pairs[p])[k]
        columns = space.start(scene.ref, k) + fineness * np.arange(low, low + width)
        if window == 1:
            assert np.abs(rays[:, p, k, low : low + width] / 255 - expected[:, p, k, columns]).max() <= 0.5 / 255 + 2e-5
        assert rays[:, p, k, low : low + width].any()


RELATIVES = [
    "dynamic_programming",
    "graph_cut",
    "guided_filter",
    "kang_szeliski",
    "kolmogorov_zabih",
    "niquin",
    "scanline",
    "ssd",
]


@pytest.mark.parametrize("name", RELATIVES)
def test_relatives_take_the_learned_costs(name: str, other_weights: tuple[Layer, ...]) -> None:
    scene, plugin = load_scene("synthetic/box[size=48x36 n=3]"), plugins.algorithm(name)
    found = {
        similarity: plugin.make({"similarity": similarity}).solve(scene, Context()).disparity[scene.ref]
        for similarity in ("published", "shared", "mccnn")
    }
    assert np.isfinite(found["mccnn"]).all()
    assert (found["mccnn"] != found["shared"]).any()
    threaded = plugin.make({"similarity": "mccnn"}).solve(scene, Context(threads=3)).disparity[scene.ref]
    np.testing.assert_array_equal(threaded, found["mccnn"])


def test_parameters_that_it_does_not_read_are_refused(other_weights: tuple[Layer, ...]) -> None:
    assert set(Matching(similarity="mccnn").silent) == {"sigma", "truncation", "texture", "alike", "colour"}


def test_without_the_package_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from matbench.algorithms.materiality import Materiality

    monkeypatch.setattr(mccnn, "find_spec", lambda name: None)
    with pytest.raises(UserError, match=r"^materiality: similarity is mccnn.*pip install 'matbench-stereo\[mccnn\]'$"):
        build("materiality", Materiality, {"similarity": "mccnn"})
    mccnn.network.cache_clear()
    with pytest.raises(UserError, match=r"not installed: pip install 'matbench-stereo\[mccnn\]'$"):
        mccnn.network()
    # another version of it may have other weights, under the same name
    place = tmp_path / "weights" / "mc_cnn_fast_dw.onnx"
    place.parent.mkdir()
    place.write_bytes(b"others")
    monkeypatch.setattr(mccnn, "find_spec", lambda name: SimpleNamespace(submodule_search_locations=[str(tmp_path)]))
    with pytest.raises(UserError, match="are not those of mccnn"):
        mccnn.network()
    mccnn.network.cache_clear()


def test_the_package_has_the_weights_and_its_library_computes_the_same() -> None:
    need("mccnn")
    mccnn.network.cache_clear()
    network, path = mccnn.network(), mccnn.weights_file()
    assert path is not None
    assert [layer.mix.shape for layer in network] == [(64, 1), *[(64, 64)] * 4]
    assert [one.own.tobytes() for one in layers(read_model(path).tensors)] == [one.own.tobytes() for one in network]
    need("onnx")
    import onnxruntime

    image = np.random.default_rng(0).normal(0, 1, (20, 31)).astype(np.float32)
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    (told,) = session.run(None, {"input": np.pad(image, RADIUS, mode="edge")})
    np.testing.assert_allclose(slow(image, network), np.moveaxis(told, 0, 2), atol=1e-4)
    found = np.empty((20, 31, CHANNELS), np.int8)
    describe(image, network, found)
    assert np.abs(found / STEPS - np.moveaxis(told, 0, 2)).max() <= 0.5 / STEPS + 1e-4
