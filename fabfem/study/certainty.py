"""How well a least-squares fit knows its parameters: pure functions of the Jacobian.

Parameters are counted over the distance of their bounds, z in 0…1, so that a standard deviation of 1/√12 is what the
bounds alone would tell. With residuals r (m of them) and Jacobian J = ∂r/∂z, the covariance is s² (JᵀJ)⁻¹ with
s² = r·r/(m − n); the singular values of J say in which directions of the parameters the residuals change.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from umat.mandel import Array

BLIND = 12.0**-0.5
"""Standard deviation of a parameter of which nothing but its bounds is known."""
ALIKE = 0.95
"""Correlation above which two parameters can stand for each other."""
INVOLVED = 0.1
"""Share of a parameter in a direction above which it is named."""
LOST = 1e-8
"""Singular value below which the residuals do not change at all, over the largest."""


class Certainty(NamedTuple):
    """What is known of the parameters."""

    covariance: Array
    """(n, n), of z; infinite on the diagonal where the residuals do not depend on the parameter."""
    correlation: Array
    """(n, n)"""
    singular_values: Array
    """(n,), falling."""
    directions: Array
    """(n, n) direction of z of each singular value, a row each."""

    @property
    def deviations(self) -> Array:
        """(n,) standard deviations of z."""
        return np.sqrt(np.diag(self.covariance))


def certainty(residual: Array, jacobian: Array) -> Certainty:
    """Return how well the parameters are known from residuals (m,) and their Jacobian (m, n)."""
    count, n = jacobian.shape
    _, sizes, rows = np.linalg.svd(jacobian, full_matrices=False)
    variance = float(residual @ residual) / max(count - n, 1)
    seen = sizes > LOST * max(sizes[0], np.finfo(float).tiny)
    covariance = variance * (rows[seen].T / sizes[seen] ** 2) @ rows[seen]
    lost = (rows[~seen] ** 2).sum(axis=0) > 1e-6
    covariance[lost, lost] = np.inf
    deviation = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / np.outer(deviation, deviation)
    correlation[~np.isfinite(correlation)] = 0.0
    np.fill_diagonal(correlation, 1.0)
    return Certainty(covariance, correlation, sizes, rows)


def blind_spots(names: Sequence[str], known: Certainty) -> Iterator[str]:
    """Yield a sentence for each thing that the data cannot see."""
    for direction in known.directions[known.singular_values <= LOST * known.singular_values[0]]:
        some = [name for name, share in zip(names, direction, strict=True) if abs(share) > INVOLVED]
        yield f"The data {'tell only a combination of' if len(some) > 1 else 'do not depend on'} {', '.join(some)}."
    for name, deviation in zip(names, known.deviations, strict=True):
        if BLIND < deviation < np.inf:
            yield f"The data do not tell {name}: its standard deviation is {deviation:.2g} of its bounds."
    for i, j in combinations(range(len(names)), 2):
        if abs(known.correlation[i, j]) > ALIKE:
            yield f"{names[i]} and {names[j]} can stand for each other (correlation {known.correlation[i, j]:.3f})."
