"""Memory is handed out again, by the same name and to one user at a time."""

import numpy as np

from matbench.algorithms.room import Room


def test_the_same_memory_is_used_again():
    room = Room()
    one = room.empty("sums", (2, 3), np.uint16)
    assert (one.shape, one.dtype) == ((2, 3), np.uint16)
    assert np.shares_memory(room.empty("sums", (2, 3), np.uint16), one)
    assert not np.shares_memory(room.empty("costs", (2, 3), np.uint16), one)
    assert not np.shares_memory(Room().empty("sums", (2, 3), np.uint16), one)


def test_another_shape_or_type_lies_there_if_it_fits():
    room = Room()
    one = room.empty("sums", (2, 3), np.uint32)
    less = room.empty("sums", (5,), np.uint16)
    assert (less.shape, less.dtype) == ((5,), np.uint16)
    assert np.shares_memory(less, one)
    more = room.empty("sums", (7,), np.uint32)
    assert (more.shape, more.dtype) == ((7,), np.uint32)
    assert not np.shares_memory(more, one)


def test_threads_have_rooms_of_their_own_and_use_them_again():
    room = Room()
    with room.lent() as one:
        with room.lent() as two:
            assert len({id(room), id(one), id(two)}) == 3
        with room.lent() as again:
            assert again is two
    with room.lent() as again:
        assert again is one
