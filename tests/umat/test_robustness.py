"""Random points and increments: the stress point succeeds, or says why not and leaves no trace.

The table of 200,000 cases is printed by `tests/benchmarks/robustness.py`, whose cases these are.
"""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import umat
from umat import mandel, status
from umat.directions import directions
from umat.lanes import COMPILED
from umat.sands import toyoura

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "robustness.py"
#: cases of each material in each unit
CASES = 5000 if COMPILED else 12
#: largest strain, and the share of cases that must succeed below it
WANTED = [(1e-4, 0.9999), (1e-3, 0.999), (1e-2, 0.99)] if COMPILED else [(1e-4, 0.9999)]
#: bound on the work; without the compiler an evaluation takes 30 ms
WORK = 2000 if COMPILED else 100


def script():
    """Return the benchmark as a module."""
    spec = importlib.util.spec_from_file_location("robustness", SCRIPT)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def at(material, units: str):
    """Return the material in other units."""
    other = toyoura(*script().UNITS[units])
    return other._replace(law=material.law, localisation=material.localisation, max_evaluations=WORK)


@pytest.mark.parametrize("units", ["kPa", "Pa"])
def test_random_increments_succeed(material, rule, units):
    material = at(material, units)
    cases = script().random_cases(material, rule, CASES, seed=1, steps=10 if COMPILED else 2)
    before = [np.array(array) for array in cases.state]
    response = umat.update(material, rule, cases.increment, cases.state)
    for array in (response.stress, response.tangent, response.error, *response.state):
        assert np.isfinite(array).all()
    assert all((a == b).all() for a, b in zip(cases.state, before, strict=True))
    failed, size = response.status != status.OK, mandel.norm(cases.increment)
    assert set(np.unique(response.status)) <= set(status.CODES)
    for new, old in zip(response.state, before, strict=True):
        assert (new[failed] == old[failed]).all()
    for largest, share in WANTED:
        asked = size <= largest
        lost = int((failed & asked).sum())
        codes = np.unique(response.status[failed & asked])
        assert lost <= (1.0 - share) * asked.sum(), f"{lost} of {asked.sum()} refused up to {largest:g}: codes {codes}"
    assert (mandel.p(response.stress) > 0.0).all()
    assert (response.state.gap >= 0.0).all()


def test_units_do_not_decide_what_succeeds(material, rule):
    """The cases are the same but for the rounding of stresses, which decides at the jumps of some points."""
    ends = []
    for units in ("kPa", "Pa"):
        cases = script().random_cases(at(material, units), rule, CASES // 4, seed=2, steps=1)
        ends.append(umat.update(at(material, units), rule, cases.increment, cases.state))
    assert (ends[0].status != ends[1].status).mean() <= 0.01
    both = (ends[0].status == 0) & (ends[1].status == 0)
    error = mandel.norm(ends[1].stress / 1e3 - ends[0].stress)[both] / mandel.norm(ends[0].stress)[both]
    assert np.quantile(error, 0.9) < 1e-8


strains = arrays(np.float64, (3, 6), elements=st.floats(-1.0, 1.0, allow_subnormal=False))


@given(
    shapes=strains,
    sizes=st.lists(st.integers(-12, -2), min_size=3, max_size=3),
    p=st.floats(0.1, 1e4),
    e=st.floats(0.58, 1.1),
)
@settings(
    max_examples=150 if COMPILED else 3, deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
def test_any_shape_of_strain_is_answered(shapes, sizes, p, e):
    """Three increments one after another, of any shape (single components, zeros) and size: numbers and codes."""
    rule, sand = directions("bazant_oh_21"), toyoura()
    state = umat.initial_state(
        sand, rule, p * mandel.IDENTITY[None], void_ratio=e, fabric=[-0.08, 0.16, -0.08, 0, 0, 0]
    )
    for shape, size in zip(shapes, sizes, strict=True):
        response = umat.update(sand, rule, 10.0**size * shape[None], state)
        for array in (response.stress, response.tangent, *response.state):
            assert np.isfinite(array).all()
        assert response.status[0] in status.CODES
        if response.status[0]:
            assert all((a == b).all() for a, b in zip(response.state, state, strict=True))
        if size <= -5:
            assert response.status[0] == status.OK
        state = response.state
        assert mandel.p(state.stress)[0] > 0.0
