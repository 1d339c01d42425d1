"""Statistics of contact normals: fabric tensors from data, their scatter, and normals drawn from a density.

In three dimensions G = ⟨nn⟩ and F = (15/2)(G − I/3) [ZK 4; Y 1.4, 1.5], the second-order part of the density
E(n) = (1 + F:nn)/4π. In the plane F_ij = ⟨n_i n_j⟩, which has trace 1, intensity Δ and major direction φ [G 3–6]:

    F_1,2 = (1 ± Δ)/2,   Δ = √((F11 − F22)² + 4 F12²) = |⟨e^{2iφ_k}⟩|,   tan 2φ = 2 F12/(F11 − F22).

[G 4] prints Δ = √((F11 − F22)²/4 + F12²) and [G 5] 1/(2N) |Σ e^{2iφ_k}|; with its own F_1,2 = (1 ± Δ)/2 and with
[G 12] only the factor above agrees (for 2N contact ends the sum has 2N terms). The density with one harmonic,
E(θ) = (1 + 2Δ cos 2(θ − φ))/2π, has this Δ, so Δ ≤ 1/2 for it. Contacts per particle turn ⟨nn⟩ into the tensor of
[P 4], F = Z ⟨nn⟩, with Z = F_1 + F_2 and A = F_1 − F_2 = Z Δ [P 5].

Every estimate is a mean over N contacts taken as independent, so its standard error falls as N^(−1/2).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .mandel import IDENTITY, Array, from_tensor, to_tensor


class Fabric3D(NamedTuple):
    """What N contact normals in space say."""

    tensor: Array
    """(6,) fabric anisotropy tensor (F) [-]."""
    error: Array
    """(6,) standard error of each component [-]."""


class Fabric2D(NamedTuple):
    """What N contact normals in the plane say."""

    tensor: Array
    """(2, 2) fabric (F_ij), trace 1 [-]."""
    intensity: float
    """Intensity of the anisotropy (Δ) [-]."""
    direction: float
    """Major direction (φ) from the x axis, 0 to 180 [deg]; NaN without anisotropy."""
    error: float
    """Standard error of Δ [-]."""


def fabric_3d(normals: ArrayLike) -> Fabric3D:
    """Return F of N contact normals (N, 3) [ZK 4]; n and −n are the same contact.

    Raises
    ------
    ValueError
        If there are fewer than two normals or one of them has no length.
    """
    dyads = 7.5 * (from_tensor(_dyads(normals, 3)) - IDENTITY / 3.0)
    return Fabric3D(dyads.mean(axis=0), dyads.std(axis=0, ddof=1) / np.sqrt(len(dyads)))


def fabric_2d(normals: ArrayLike) -> Fabric2D:
    """Return F_ij, Δ and φ of N contact normals (N, 2) [G 3, 4, 6]; ValueError as in `fabric_3d`."""
    dyads = _dyads(normals, 2)
    tensor = dyads.mean(axis=0)
    intensity, direction = intensity_and_direction(tensor)
    double = 0.0 if np.isnan(direction) else 2.0 * np.radians(direction)
    along = (dyads[:, 0, 0] - dyads[:, 1, 1]) * np.cos(double) + 2.0 * dyads[:, 0, 1] * np.sin(double)
    return Fabric2D(tensor, intensity, direction, float(along.std(ddof=1) / np.sqrt(len(along))))


def intensity_and_direction(tensor: ArrayLike) -> tuple[float, float]:
    """Return Δ = F_1 − F_2 and φ [deg] of a tensor (2, 2) [G 4, 6]; φ is NaN where Δ = 0."""
    f = np.asarray(tensor, float)
    across, twice = f[0, 0] - f[1, 1], 2.0 * f[0, 1]
    intensity = float(np.hypot(across, twice))
    return intensity, float(np.degrees(0.5 * np.arctan2(twice, across)) % 180.0) if intensity > 0.0 else float("nan")


def coordination_fabric(normals: ArrayLike, particles: int) -> tuple[Array, float, float]:
    """Return F (2, 2) = (2/N_p) Σ nn, Z = 2 N_c/N_p and A = F_1 − F_2 of normals (N_c, 2) [P 3–5]."""
    dyads = _dyads(normals, 2)
    tensor = 2.0 / particles * dyads.sum(axis=0)
    return tensor, float(np.trace(tensor)), intensity_and_direction(tensor)[0]


def anisotropic_state(stress: ArrayLike, fabric: ArrayLike) -> float:
    """Return A = √2 σ̂:F = Δ cos 2ϑ of tensors (2, 2), ϑ between their major axes [G 16, 17]; 0 without a deviator."""
    stress = np.asarray(stress, float)
    deviator = stress - 0.5 * np.trace(stress) * np.eye(2)
    size = float(np.linalg.norm(deviator))
    return float(2.0**0.5 * np.sum(deviator * np.asarray(fabric, float)) / size) if size > 0.0 else 0.0


def joint_invariants(stress: ArrayLike, fabric: ArrayLike) -> Array:
    """Return L1…L4 (4,) = σ:F, σ:F², σ²:F, σ²:F² of tensors of two or three dimensions [G 11]."""
    s, f = np.asarray(stress, float), np.asarray(fabric, float)
    return np.array([np.sum(a * b) for a in (s, s @ s) for b in (f, f @ f)])


def draw_3d(fabric: ArrayLike, count: int, seed: int) -> Array:
    """Return normals (count, 3) drawn from E(n) = (1 + F:nn)/4π, F a six-vector, by rejection.

    Raises
    ------
    ValueError
        If E(n) is negative somewhere.
    """
    tensor = to_tensor(fabric)
    lowest, highest = np.linalg.eigvalsh(tensor)[[0, -1]]
    if lowest < -1.0:
        raise ValueError(f"the density of contacts 1 + F:nn is negative ({1.0 + lowest:.3g}) in some direction")
    generator, kept, found = np.random.default_rng(seed), [], 0
    while found < count:
        trial = generator.normal(size=(count, 3))
        trial /= np.linalg.norm(trial, axis=1)[:, None]
        density = 1.0 + np.einsum("ai,ij,aj->a", trial, tensor, trial)
        kept.append(trial[generator.random(count) * (1.0 + highest) < density])
        found += len(kept[-1])
    return np.concatenate(kept)[:count]


def draw_2d(intensity: float, direction: float, count: int, seed: int) -> Array:
    """Return normals (count, 2) drawn from E(θ) = (1 + 2Δ cos 2(θ − φ))/2π, φ in degrees, by rejection.

    Raises
    ------
    ValueError
        If Δ is not between 0 and 1/2, where the density is nowhere negative.
    """
    if not 0.0 <= intensity <= 0.5:
        raise ValueError(f"the intensity of a density with one harmonic lies between 0 and 0.5, got {intensity:g}")
    generator, kept, found = np.random.default_rng(seed), [], 0
    while found < count:
        theta = generator.uniform(0.0, 2.0 * np.pi, count)
        density = 1.0 + 2.0 * intensity * np.cos(2.0 * (theta - np.radians(direction)))
        kept.append(theta[generator.random(count) * (1.0 + 2.0 * intensity) < density])
        found += len(kept[-1])
    theta = np.concatenate(kept)[:count]
    return np.stack([np.cos(theta), np.sin(theta)], axis=1)


def _dyads(normals: ArrayLike, dimension: int) -> Array:
    """Return n n (N, d, d) of normals made unit."""
    n = np.asarray(normals, float)
    if n.ndim != 2 or n.shape[1] != dimension or len(n) < 2:
        raise ValueError(f"contact normals are two or more rows of {dimension} numbers, got shape {n.shape}")
    size = np.linalg.norm(n, axis=1)
    if not (np.isfinite(size).all() and size.min() > 0.0):
        raise ValueError(f"contact normal {int(np.argmin(np.where(np.isfinite(size), size, -1.0))) + 1} has no length")
    n = n / size[:, None]
    return np.asarray(n[:, :, None] * n[:, None, :])
