"""Contact directions: moments to the stated degree, mirror symmetry, what is refused."""

from math import prod

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from umat.directions import (
    Directions,
    directions,
    even_components,
    gauss,
    mirrored,
    rotated,
    rotation,
)
from umat.mandel import from_tensor

RULES = {
    "bazant_oh_21": (21, 9),
    "bazant_oh_33": (33, 11),
    "bazant_oh_37": (37, 11),
    "icosahedral_61": (61, 15),
    "lebedev_3": (3, 3),
    "lebedev_23": (97, 23),
    "lebedev_29": (151, 29),
    "lebedev_41": (295, 41),
    "gauss_4x8": (16, 7),
    "gauss_5x10": (25, 9),
    "gauss_24x32": (384, 31),
}

every_rule = pytest.mark.parametrize("name", RULES)


def exact_moment(*powers):
    """Return the mean of n1^a n2^b n3^c over the sphere."""
    if any(power % 2 for power in powers):
        return 0.0
    odd = [prod(range(power - 1, 0, -2)) for power in powers]
    return prod(odd) / prod(range(sum(powers) + 1, 0, -2))


def moment_error(rule, degree):
    """Return the largest error of the moments of one degree."""
    powers = rule.normals[:, :, None] ** np.arange(degree + 1)
    return max(
        abs(
            rule.weights @ (powers[:, 0, a] * powers[:, 1, b] * powers[:, 2, degree - a - b])
            - exact_moment(a, b, degree - a - b)
        )
        for a in range(degree + 1)
        for b in range(degree + 1 - a)
    )


def harmonic_error(rule, degree):
    """Return the norm of the means of all spherical harmonics of one degree; exactly 0."""
    polynomial = np.polynomial.Legendre.basis(degree)
    square = rule.weights @ polynomial(rule.normals @ rule.normals.T) @ rule.weights
    return np.sqrt(abs(square))


@every_rule
def test_number_of_directions_and_weights(name):
    rule = directions(name)
    assert (len(rule), rule.degree) == RULES[name]
    assert (rule.weights > 0).all()
    assert rule.weights.sum() == pytest.approx(1, abs=1e-14)
    np.testing.assert_allclose(np.linalg.norm(rule.normals, axis=1), 1, atol=1e-14)


@every_rule
def test_even_moments_are_exact_to_the_stated_degree_and_no_further(name):
    rule = directions(name)
    for degree in range(0, rule.degree + 1, 2):
        assert moment_error(rule, degree) < 1e-13
    assert harmonic_error(rule, rule.degree - 1) < 1e-7
    assert harmonic_error(rule, rule.degree + 1) > 1e-5


@every_rule
def test_no_direction_is_there_twice(name):
    normals = directions(name).normals
    cosines = abs(normals @ normals.T) - 2 * np.eye(len(normals))
    assert cosines.max() < 1 - 1e-6


@pytest.mark.parametrize("axis", "xyz")
def test_a_rotation_is_right_handed(axis):
    np.testing.assert_allclose(rotation(axis, 33.0), Rotation.from_euler(axis, 33.0, degrees=True).as_matrix())


@every_rule
def test_turning_keeps_the_moments(name):
    turn = Rotation.from_euler("zyx", [0.3, -0.7, 1.1]).as_matrix()
    rule = rotated(directions(name), turn)
    assert rule.normals.flags.c_contiguous
    for degree in range(0, rule.degree + 1, 4):
        assert moment_error(rule, degree) < 1e-12


@every_rule
@pytest.mark.parametrize("axis", "xyz")
def test_quarter_gives_the_average_of_the_half(name, axis):
    half = directions(name)
    quarter = mirrored(half, axis)
    on_plane = half.normals[:, "xyz".index(axis)] == 0
    alone = on_plane | (abs(half.normals[:, "xyz".index(axis)]) == 1)
    assert 2 * len(quarter) == len(half) + np.count_nonzero(alone)
    kept = even_components(quarter)
    assert len(kept) == 4
    mine, theirs = average_dyad(quarter, axis), average_dyad(half, axis)
    np.testing.assert_allclose(mine[kept], theirs[kept], atol=1e-12)
    np.testing.assert_allclose(np.delete(theirs, kept), 0, atol=1e-12)


def average_dyad(rule, axis):
    """Return ⟨nn exp(n·S·n)⟩ of a tensor S with the mirror symmetry of `axis`."""
    tensor = np.array([[0.4, 0.3, 0.2], [0.3, -0.1, 0.5], [0.2, 0.5, 0.6]])
    sign = np.where(np.array(list("xyz")) == axis, -1, 1)
    tensor = tensor * (1 + np.outer(sign, sign)) / 2
    density = np.exp(np.einsum("ai,ij,aj->a", rule.normals, tensor, rule.normals))
    dyads = from_tensor(rule.normals[:, :, None] * rule.normals[:, None, :])
    return (rule.weights * density) @ dyads


def test_half_keeps_every_component():
    assert list(even_components(directions("bazant_oh_37"))) == list(range(6))


@pytest.mark.parametrize(("degree", "points"), [(13, 74), (25, 230), (27, 266)])
def test_rule_with_negative_weight_is_refused_by_name(degree, points):
    with pytest.raises(ValueError, match=rf"lebedev_{degree} \({points} points\).*weight"):
        directions(f"lebedev_{degree}")


def test_zero_weight_is_refused():
    with pytest.raises(ValueError, match="mine has a weight of 0"):
        Directions(np.eye(3), np.array([0.5, 0.5, 0.0]), "mine", 1)


def test_crooked_rules_are_refused():
    with pytest.raises(ValueError, match="sum to 1"):
        Directions(np.eye(3), np.full(3, 0.3), "mine", 3)
    with pytest.raises(ValueError, match="unit vectors"):
        Directions(2 * np.eye(3), np.full(3, 1 / 3), "mine", 3)


def test_rule_without_mirror_symmetry_is_refused():
    turn = Rotation.from_euler("x", 0.2).as_matrix()
    with pytest.raises(ValueError, match="bazant_oh_37 rotated is not symmetric"):
        mirrored(rotated(directions("bazant_oh_37"), turn))


def test_quarter_is_not_turned_or_mirrored_again():
    quarter = mirrored(directions("bazant_oh_21"))
    with pytest.raises(ValueError, match="mirrored already"):
        mirrored(quarter, "x")
    with pytest.raises(ValueError, match="then mirror it"):
        rotated(quarter, np.eye(3))


@pytest.mark.parametrize("name", ["bazant_oh_38", "lebedev", "lebedev_x", "gauss_4"])
def test_unknown_name_lists_the_known(name):
    with pytest.raises(ValueError, match=r"bazant_oh_37.*lebedev_<degree>"):
        directions(name)


def test_impossible_sizes_are_refused():
    with pytest.raises(ValueError, match="no Lebedev rule of degree 4"):
        directions("lebedev_4")
    with pytest.raises(ValueError, match="gauss_4x7"):
        gauss(4, 7)
    with pytest.raises(ValueError, match="axis must be one of x, y, z"):
        mirrored(directions("bazant_oh_21"), "w")
