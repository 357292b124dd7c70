"""What a network is given of an image, and how its maps come back."""

import numpy as np
import pytest

from matbench.algorithms.model_input import Frame, Picture, median_of_views


def test_a_picture_is_scaled_and_then_normalised_channel_by_channel() -> None:
    image = np.random.default_rng(0).integers(0, 256, (4, 5, 3), np.uint8)
    found = Picture("bgr", 1.0, "0.1/0.2/0.3", "2 4 8").channels(image)
    for place, colour in enumerate((2, 1, 0)):
        mean, std = (0.1, 0.2, 0.3)[place], (2, 4, 8)[place]
        np.testing.assert_allclose(found[place], (image[..., colour] / 255 - mean) / std, rtol=1e-5, atol=1e-6)
    grey = Picture("grey").channels(image)
    np.testing.assert_allclose(grey[0], image @ np.array([0.299, 0.587, 0.114]), rtol=1e-5)
    np.testing.assert_array_equal(Picture().channels(image), np.moveaxis(image, 2, 0))


@pytest.mark.parametrize(
    "wrong", [{"colours": "hsv"}, {"scale": 0.0}, {"mean": "1/2"}, {"mean": "nan"}, {"std": "1/0/1"}, {"std": ""}]
)
def test_a_wrong_value_names_the_parameter(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Picture(**wrong)  # type: ignore[arg-type]


def test_a_median_does_not_count_what_is_unknown() -> None:
    nan = np.nan
    maps = np.array([[[1, nan, 3, nan]], [[2, 5, nan, nan]], [[9, 7, nan, nan]]], np.float32)
    np.testing.assert_array_equal(median_of_views(list(maps), [1, 1, 1]), [[2, 5, 3, nan]])
    np.testing.assert_array_equal(median_of_views(list(maps), [1, 1, 9]), [[9, 7, 3, nan]])


def test_a_picture_comes_back_from_its_frame() -> None:
    planes = np.random.default_rng(0).normal(size=(3, 5, 7)).astype(np.float32)
    padded = Frame.of((5, 7), (None, None), 4, "resize")
    assert (padded.frame, padded.resized) == ((8, 8), (5, 7))
    np.testing.assert_array_equal(padded.take(padded.put(planes)[0]), planes[0])
    resized = Frame.of((5, 7), (10, 14), 4, "resize")
    assert resized.put(planes).shape == (3, 10, 14)
    np.testing.assert_allclose(resized.take(np.full((10, 14), 6, np.float32)), 3)
    one = Frame.of((5, 7), (10, None), 4, "resize")
    assert (one.frame, one.resized) == ((10, 8), (10, 7))
    np.testing.assert_allclose(one.take(np.full((10, 8), 6, np.float32)), 6)
