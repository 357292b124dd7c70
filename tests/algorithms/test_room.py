"""Arrays are handed out again only for what they fit."""

import numpy as np

from matbench.algorithms.room import Room


def test_what_fits_is_used_again():
    room = Room()
    one = room.empty("sums", (2, 3), np.uint16)
    assert (one.shape, one.dtype) == ((2, 3), np.uint16)
    assert room.empty("sums", (2, 3), np.uint16) is one
    assert room.empty("costs", (2, 3), np.uint16) is not one
    assert Room().empty("sums", (2, 3), np.uint16) is not one


def test_another_shape_or_type_is_another_array():
    room = Room()
    one = room.empty("sums", (2, 3), np.uint16)
    assert room.empty("sums", (3, 3), np.uint16).shape == (3, 3)
    assert room.empty("sums", (3, 3), np.uint32).dtype == np.uint32
    assert room.empty("sums", (2, 3), np.uint16) is not one
