"""Slices: each point once, in any number of threads, with the same result."""

import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from umat import threads


@pytest.fixture(autouse=True)
def _restore_threads():
    before = threads.get_threads()
    yield
    threads.set_threads(before)


@given(st.integers(0, 300), st.integers(1, 40), st.integers(1, 4))
@settings(max_examples=50, deadline=None)
def test_every_point_is_visited_once(n_points, slice_size, n_threads):
    visits = np.zeros(n_points, dtype=int)

    def count(start, stop):
        assert 0 < stop - start <= slice_size
        visits[start:stop] += 1

    threads.set_threads(n_threads)
    threads.map_slices(count, n_points, slice_size)
    assert (visits == 1).all()


def test_slices_do_not_depend_on_the_number_of_threads():
    seen = []
    for n_threads in (1, 3):
        threads.set_threads(n_threads)
        slices = []
        threads.map_slices(lambda *ends, slices=slices: slices.append(ends), 1000, 64)
        seen.append(sorted(slices))
    assert seen[0] == seen[1]


def test_several_threads_work_at_once():
    threads.set_threads(2)
    meeting = threading.Barrier(2, timeout=20)
    threads.map_slices(lambda start, stop: meeting.wait(), 2, 1)


@pytest.mark.parametrize("n_threads", [1, 2])
@pytest.mark.parametrize("error", [ArithmeticError, IndexError])
def test_error_in_a_kernel_reaches_the_caller(n_threads, error):
    def fail(start, stop):
        raise error("from the kernel")

    threads.set_threads(n_threads)
    with pytest.raises(error, match="from the kernel"):
        threads.map_slices(fail, 10, 1)


def test_call_from_within_a_kernel_does_not_block():
    threads.set_threads(2)
    visits = np.zeros((6, 6), dtype=int)

    def outer(row, _):
        def inner(column, _):
            visits[row, column] += 1

        threads.map_slices(inner, 6, 1)

    threads.map_slices(outer, 6, 1)
    assert (visits == 1).all()


def test_at_least_one_thread():
    assert threads.get_threads() >= 1
    with pytest.raises(ValueError, match="at least 1"):
        threads.set_threads(0)
