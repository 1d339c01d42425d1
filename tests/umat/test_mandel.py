"""The 6-vector algebra against plain tensor algebra."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from scipy.spatial.transform import Rotation

from umat import mandel

numbers = st.floats(-1e3, 1e3, allow_subnormal=False)
batches = array_shapes(min_dims=0, max_dims=3, max_side=3)
vectors = batches.flatmap(lambda batch: arrays(float, (*batch, 6), elements=numbers))
pairs = batches.flatmap(lambda batch: arrays(float, (2, *batch, 6), elements=numbers))
rotations = st.integers(0, 2**31).map(lambda seed: Rotation.random(rng=np.random.default_rng(seed)).as_matrix())


@given(vectors)
def test_vector_to_tensor_and_back(vector):
    tensor = mandel.to_tensor(vector)
    assert tensor.shape == (*vector.shape[:-1], 3, 3)
    np.testing.assert_array_equal(tensor, np.swapaxes(tensor, -1, -2))
    np.testing.assert_allclose(mandel.from_tensor(tensor), vector, rtol=1e-15)


@given(pairs)
def test_dot_product_is_double_contraction(pair):
    a, b = pair
    expected = (mandel.to_tensor(a) * mandel.to_tensor(b)).sum(axis=(-1, -2))
    np.testing.assert_allclose(mandel.dot(a, b), expected, atol=1e-8)
    np.testing.assert_allclose(mandel.norm(a) ** 2, mandel.dot(a, a), atol=1e-8)


@given(vectors)
def test_deviator_has_no_trace_and_projectors_agree(vector):
    deviator = mandel.deviator(vector)
    np.testing.assert_allclose(mandel.trace(deviator), 0.0, atol=1e-11)
    np.testing.assert_allclose(deviator, vector @ mandel.DEVIATORIC, atol=1e-11)
    np.testing.assert_allclose(deviator + vector @ mandel.SPHERICAL, vector, atol=1e-11)


@given(vectors, rotations)
def test_rotation_turns_the_tensor(vector, turn):
    turned = vector @ mandel.rotation(turn).T
    expected = turn @ mandel.to_tensor(vector) @ turn.T
    np.testing.assert_allclose(mandel.to_tensor(turned), expected, atol=1e-10)


@given(rotations, rotations)
def test_rotations_are_orthogonal_and_compose(first, second):
    both = mandel.rotation(np.stack([first, second]))
    np.testing.assert_allclose(both @ np.swapaxes(both, 1, 2), [np.eye(6)] * 2, atol=1e-14)
    np.testing.assert_allclose(both[1] @ both[0], mandel.rotation(second @ first), atol=1e-14)


@given(vectors, rotations)
def test_invariants_do_not_see_rotation(vector, turn):
    turned = vector @ mandel.rotation(turn).T
    for invariant in (mandel.p, mandel.q, mandel.principal):
        np.testing.assert_allclose(invariant(turned), invariant(vector), atol=1e-9)


@pytest.mark.parametrize(
    ("stress", "p", "q", "lode"),
    [
        ([300, 100, 100, 0, 0, 0], 500 / 3, 200, 0),
        ([300, 300, 100, 0, 0, 0], 700 / 3, 200, 60),
        ([300, 200, 100, 0, 0, 0], 200, np.sqrt(3) * 100, 30),
        ([100, 100, 100, 0, 0, np.sqrt(2) * 50], 100, np.sqrt(3) * 50, 30),
        ([100, 100, 100, 0, 0, 0], 100, 0, 0),
    ],
    ids=["compression", "extension", "b = ½", "simple shear", "isotropic"],
)
def test_invariants_of_known_states(stress, p, q, lode):
    assert mandel.p(stress) == pytest.approx(p)
    assert mandel.q(stress) == pytest.approx(q, abs=1e-12)
    assert mandel.eta(stress) == pytest.approx(q / p, abs=1e-12)
    assert mandel.lode(stress) == pytest.approx(lode, abs=1e-5)


@given(vectors)
def test_principal_values_agree_with_p_q_and_lode(vector):
    theta = np.radians(mandel.lode(vector))
    angles = theta[..., None] - np.radians([0.0, 120.0, -120.0])
    p, q = mandel.p(vector)[..., None], mandel.q(vector)[..., None]
    expected = np.sort(p + 2 / 3 * q * np.cos(angles))[..., ::-1]
    np.testing.assert_allclose(mandel.principal(vector), expected, atol=1e-4)


@given(vectors)
def test_lode_angle_is_always_between_0_and_60_degrees(vector):
    assert np.all((mandel.lode(vector) >= 0) & (mandel.lode(vector) <= 60))
    assert np.all(abs(mandel.cos3theta(vector)) <= 1)


def test_ratio_without_pressure_is_not_an_error():
    assert mandel.eta([1.0, -1.0, 0, 0, 0, 0]) == np.inf
    assert np.isnan(mandel.eta(np.zeros(6)))
