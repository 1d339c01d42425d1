"""Orders, extrapolation, Pareto front and quantities: what must hold for any run times and errors."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fabfem.case.study import Quantity, Reading
from fabfem.study.convergence import cheapest, fitted_order, observed_orders, pareto, richardson
from fabfem.study.quantity import QuantityError, distance, quantity_of, reading

SIZES = np.array([0.8, 0.4, 0.25, 0.1])
positive = st.floats(1e-3, 1e3)
runs = st.lists(st.tuples(positive, positive), min_size=1, max_size=12)


@given(st.floats(0.5, 6.0), st.floats(1e-2, 1e2))
def test_a_pure_power_shows_its_order(order: float, factor: float) -> None:
    errors = factor * SIZES**order
    np.testing.assert_allclose(observed_orders(SIZES, errors), order, rtol=1e-9)
    assert fitted_order(SIZES, errors) == pytest.approx(order, rel=1e-9)


@settings(deadline=None)  # the first call imports scipy
@given(st.floats(0.5, 6.0), st.floats(-5.0, 5.0), st.floats(0.1, 10.0), st.booleans())
def test_extrapolation_is_exact_for_a_pure_power(order: float, limit: float, factor: float, above: bool) -> None:
    values = limit + (factor if above else -factor) * SIZES**order
    found = richardson(SIZES, values)
    assert found.sure
    assert found.order == pytest.approx(order, rel=1e-4)
    assert found.value == pytest.approx(limit, abs=1e-5 * factor)
    assert found.doubt == pytest.approx(abs(values[-1] - limit), abs=1e-5 * factor)


@pytest.mark.parametrize("values", [[1.0, 2.0, 1.5, 1.7], [1.0, 1.0, 1.0, 1.0], [0.0, 1.0, 1.9, 4.0]])
def test_values_that_do_not_settle_are_not_sure(values: list[float]) -> None:
    found = richardson(SIZES, values, expected=2.0)
    assert not found.sure
    assert found.order == 2.0


def test_an_error_of_rounding_shows_no_order() -> None:
    assert np.isnan(observed_orders(SIZES, [1e-2, 1e-15, 1e-15, 1e-14])).all()
    assert np.isnan(fitted_order(SIZES, [1e-15] * 4))


@given(runs)
def test_the_front_is_not_beaten_and_beats_the_rest(points: list[tuple[float, float]]) -> None:
    times, errors = map(np.array, zip(*points, strict=True))
    front = pareto(times, errors)
    assert front.any()
    for i in range(len(times)):
        no_worse = (times <= times[i]) & (errors <= errors[i])
        beaten = no_worse & ((times < times[i]) | (errors < errors[i]))
        assert front[i] == (not beaten.any())


@given(runs, positive)
def test_the_cheapest_is_good_enough_and_none_is_cheaper(points: list[tuple[float, float]], largest: float) -> None:
    times, errors = map(np.array, zip(*points, strict=True))
    best = cheapest(times, errors, largest)
    if best is None:
        assert (errors > largest).all()
    else:
        assert errors[best] <= largest
        assert times[best] == times[errors <= largest].min()


def test_runs_without_a_result_are_on_no_front() -> None:
    assert list(pareto([1.0, np.nan, 2.0], [np.nan, 1.0, 3.0])) == [False, False, True]
    assert cheapest([1.0, 2.0], [np.nan, 0.1], 0.5) == 1


HISTORY = {
    "stage": ["rest", "push", "push", "push"],
    "s": ["0", "0.1", "0.2", "0.4"],
    "q": ["9", "1", "3", "2"],
}
TAKEN = {
    "last": (Quantity(column="q"), 2.0),
    "largest of a stage": (Quantity(column="q", take="largest", stage="push"), 3.0),
    "smallest": (Quantity(column="q", take="smallest"), 1.0),
    "between rows": (Quantity(column="q", take="at", at=Reading(column="s", value=0.3)), 2.5),
    "at the end": (Quantity(column="q", take="at", at=Reading(column="s", value=0.4)), 2.0),
}


@pytest.mark.parametrize("name", TAKEN)
def test_a_quantity_is_taken_from_the_history(name: str) -> None:
    said, expected = TAKEN[name]
    assert quantity_of(HISTORY, said) == pytest.approx([expected])


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        (Quantity(column="p"), "no column 'p'"),
        (Quantity(column="q", stage="pull"), "no row of stage pull"),
        (Quantity(column="stage"), "does not hold numbers"),
        (Quantity(column="q", take="at", at=Reading(column="s", value=0.5)), "no row reaches 0.5"),
    ],
)
def test_a_history_without_the_quantity_says_so(said: Quantity, sentence: str) -> None:
    with pytest.raises(QuantityError, match=sentence):
        quantity_of(HISTORY, said)


def test_curves_are_compared_where_both_are() -> None:
    along = np.linspace(0.0, 1.0, 201)
    truth = np.array([along, along])
    longer = np.array([2.0 * along, 2.0 * along + 0.1])
    assert distance(longer, truth) == pytest.approx(0.1)
    assert distance(truth, truth) == 0.0
    assert distance(np.array([1.01]), np.array([1.0])) == pytest.approx(0.01)
    assert distance(np.array([0.01]), np.array([0.0])) == 0.01


def test_a_reading_takes_the_first_crossing() -> None:
    assert reading(np.array([0.0, 2.0, 1.0, 3.0]), np.array([0.0, 4.0, 7.0, 9.0]), 1.0) == 2.0
