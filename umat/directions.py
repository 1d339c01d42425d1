"""Contact directions: unit normals n_a and weights w_a, Σ w_a = 1.

The mean over the unit sphere of a function that is the same at n and −n is Σ w_a x(n_a),
so half a sphere of normals is enough.  In a scene with a plane of mirror symmetry n and
its mirror image give mirrored contributions too, and a quarter is enough; of a Mandel
vector averaged over a quarter only the components that the mirror leaves alone count,
see `even_components`.  Weights must be positive: a negative one makes the macroscopic
compliance indefinite.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from umat.mandel import COLUMN, ROW, Array

AXES = ("x", "y", "z")
TOLERANCE = 1e-10
Axis = Literal["x", "y", "z"]

_TABLES = {
    "bazant_oh_21": ("sphere_BO21.csv", 9),
    "bazant_oh_33": ("sphere_BO33.csv", 11),
    "bazant_oh_37": ("sphere_BO37.csv", 11),
    "icosahedral_61": ("sphere_ICO61.csv", 15),
}
NAMES = (*_TABLES, "lebedev_<degree>", "gauss_<n_theta>x<n_phi>")
"""Names of rules and families of rules."""


@dataclass(frozen=True, eq=False)
class Directions:
    """A quadrature rule on half, or by mirror symmetry a quarter, of the unit sphere."""

    normals: Array
    """(N, 3) unit normals (n)."""
    weights: Array
    """(N,) positive weights (w), sum 1."""
    name: str
    """Name of the rule."""
    degree: int
    """Highest degree of the polynomials in n whose mean is exact."""
    symmetry: Literal["half", "quarter"] = "half"
    """What of the sphere the normals stand for."""
    mirror_axis: Axis | None = None
    """Normal of the mirror plane of a quarter."""

    def __post_init__(self) -> None:
        """Refuse weights that are not positive or do not sum to 1, and crooked normals."""
        if not np.all(self.weights > 0.0):
            worst = f"{np.min(self.weights):.3g}"
            raise ValueError(f"{self.name} has a weight of {worst}: weights must be positive")
        if abs(self.weights.sum() - 1.0) > TOLERANCE:
            raise ValueError(f"the weights of {self.name} do not sum to 1")
        if np.any(abs(np.linalg.norm(self.normals, axis=1) - 1.0) > TOLERANCE):
            raise ValueError(f"the normals of {self.name} are not unit vectors")

    def __len__(self) -> int:
        """Return the number of directions (N)."""
        return len(self.weights)


def directions(name: str) -> Directions:
    """Return the rule called `name`; ValueError lists the names there are.

    `bazant_oh_21`, `bazant_oh_33`, `bazant_oh_37`, `icosahedral_61`,
    `lebedev_<degree>` and `gauss_<n_theta>x<n_phi>`.
    """
    if name in _TABLES:
        return _from_table(name)
    family, _, size = name.partition("_")
    if family == "lebedev" and size.isdecimal():
        return lebedev(int(size))
    n_theta, cross, n_phi = size.partition("x")
    if family == "gauss" and cross and n_theta.isdecimal() and n_phi.isdecimal():
        return gauss(int(n_theta), int(n_phi))
    raise ValueError(f"no directions are called {name!r}; there are {', '.join(NAMES)}")


def lebedev(degree: int) -> Directions:
    """Return half of the Lebedev rule of a degree: 3, 5, … 31, 35, 41, … 131.

    ValueError for a degree that does not exist, or whose rule has a weight that is not
    positive: 13, 25 and 27, of 74, 230 and 266 points on the whole sphere.
    """
    from scipy.integrate import lebedev_rule

    try:
        points, weights = lebedev_rule(degree)
    except NotImplementedError as unknown:
        raise ValueError(f"there is no Lebedev rule of degree {degree}") from unknown
    name = f"lebedev_{degree}"
    if np.min(weights) <= 0.0:
        name += f" ({len(weights)} points)"
    return _half(points.T, weights, name, degree)


def gauss(n_theta: int, n_phi: int) -> Directions:
    """Return half of the Gauss product rule: n_theta·n_phi/2 directions.

    On the whole sphere it is Gauss–Legendre in cosθ (polar axis z) times `n_phi`, an
    even number, of equal steps in φ; exact to degree min(2 n_theta, n_phi) − 1.
    """
    name = f"gauss_{n_theta}x{n_phi}"
    if n_theta < 1 or n_phi < 2 or n_phi % 2:
        raise ValueError(f"{name}: n_theta must be positive and n_phi positive and even")
    cosine, weight = np.polynomial.legendre.leggauss(n_theta)
    z, phi = np.meshgrid(cosine, 2.0 * np.pi / n_phi * (np.arange(n_phi) + 0.5), indexing="ij")
    ring = np.sqrt(1.0 - z**2)
    normals = np.stack([ring * np.cos(phi), ring * np.sin(phi), z], axis=-1)
    weights = np.repeat(weight, n_phi)
    return _half(normals.reshape(-1, 3), weights, name, min(2 * n_theta, n_phi) - 1)


def rotated(rule: Directions, matrix: ArrayLike) -> Directions:
    """Return the rule with each normal turned by the (3, 3) rotation `matrix`.

    ValueError for a quarter, which stands on its mirror plane.
    """
    if rule.symmetry == "quarter":
        raise ValueError(f"{rule.name} is mirrored; turn the half sphere, then mirror it")
    normals = np.ascontiguousarray(rule.normals @ np.asarray(matrix, dtype=float).T)
    return Directions(normals, rule.weights, f"{rule.name} rotated", rule.degree)


def rotation(axis: Axis, degrees: float) -> np.ndarray:
    """Return the (3, 3) right-handed rotation about an axis."""
    first, second = (np.roll(range(3), -AXES.index(axis))[1:]).tolist()
    matrix = np.eye(3)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix[np.ix_([first, second], [first, second])] = [[c, -s], [s, c]]
    return matrix


def mirrored(rule: Directions, axis: Axis = "z") -> Directions:
    """Return the quarter left when directions equal by mirror symmetry are one.

    The mirror plane is normal to `axis`; the default z is out of plane in plane strain.
    ValueError if the rule is not symmetric about that plane: its answers would change.
    """
    if rule.symmetry == "quarter":
        raise ValueError(f"{rule.name} is mirrored already")
    partner = _partners(rule.normals, rule.normals * _reflection(axis))
    gap = abs(rule.weights - rule.weights[partner]).max()
    if np.any(partner < 0) or gap > TOLERANCE:
        raise ValueError(f"{rule.name} is not symmetric about the plane normal to {axis}")
    index = np.arange(len(rule))
    kept = index[index <= partner]
    weights = np.where(partner[kept] == kept, 1.0, 2.0) * rule.weights[kept]
    return Directions(rule.normals[kept], weights, rule.name, rule.degree, "quarter", axis)


def even_components(rule: Directions) -> np.ndarray:
    """Return the Mandel components whose average over `rule` is meant: 6, or 4."""
    if rule.mirror_axis is None:
        return np.arange(6)
    axis = AXES.index(rule.mirror_axis)
    return np.flatnonzero((axis == ROW) == (axis == COLUMN))


def _from_table(name: str) -> Directions:
    filename, degree = _TABLES[name]
    text = (files("umat") / "data" / filename).read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    table = np.loadtxt(lines[1:], delimiter=",")
    normals, weights = table[:, :3], table[:, 3]
    if name == "icosahedral_61":
        normals = normals @ _to_mirror_planes().T
    normals = np.where(abs(normals) < TOLERANCE, 0.0, normals)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return Directions(normals, weights / weights.sum(), name, degree)


def _to_mirror_planes() -> Array:
    """Return the rotation that lays mirror planes of the 61 set on the coordinate planes.

    The table has a three-fold axis along x; a two-fold axis of the icosahedron is
    arctan(1/golden ratio²) away from it, in the x–z plane.
    """
    angle = np.arctan(((np.sqrt(5.0) - 1.0) / 2.0) ** 2)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _half(normals: Array, weights: Array, name: str, degree: int) -> Directions:
    """Return the rule of one normal of each antipodal pair, the one that looks up."""
    snapped = np.where(abs(normals) < TOLERANCE, 0.0, normals)
    x, y, z = snapped.T
    kept = (z > 0) | ((z == 0) & ((y > 0) | ((y == 0) & (x > 0))))
    share = weights[kept] / weights[kept].sum()
    return Directions(np.ascontiguousarray(snapped[kept]), share, name, degree)


def _reflection(axis: Axis) -> Array:
    """Return the (3,) signs of the reflection in the plane normal to `axis`."""
    if axis not in AXES:
        raise ValueError(f"axis must be one of {', '.join(AXES)}, got {axis!r}")
    return np.where(np.array(AXES) == axis, -1.0, 1.0)


def _partners(normals: Array, images: Array) -> np.ndarray:
    """Return for each image the index of the normal it equals up to sign, else −1."""
    return np.fromiter(_nearest(normals, images), dtype=np.intp, count=len(images))


def _nearest(normals: Array, images: Array) -> Iterator[int]:
    for image in images:
        apart, together = abs(normals - image), abs(normals + image)
        gap = np.minimum(apart.max(axis=1), together.max(axis=1))
        nearest = int(gap.argmin())
        yield nearest if gap[nearest] < TOLERANCE else -1
