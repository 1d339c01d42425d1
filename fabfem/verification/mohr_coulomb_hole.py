"""A round hole in Mohr–Coulomb ground that is relieved of its support, in plane strain.

Ground under p0 = 30 MPa in the plane, no pressure inside, c = 3.45 MPa, φ = 30°, G = 2800 MPa, ν = 0.2083. The closed
forms [Salencon 1969; Carranza-Torres 2003] take the stress along the hole for the middle one, as it is where it begins
with 20 MPa. Where it begins with 30 MPa it becomes the largest at the wall, which then moves more: `wall` has the
integral for both. The ground ends at 60 radii, where it is under p0: an error of 1/1000 in the displacement.

In the plastic zone dσ_r/dr = (σ_θ − σ_r)/r with σ_θ = k σ_r + σ_c, whatever the stress along the hole; elastic strains
follow from the stress change, and the flow of one face or of both at the edge gives ε_r^p = −m (ε_θ^p + ε_z^p), with
ε_z^p = −ε_z^e. Hence −u' = ε_r^e + m (u/r + ε_θ^e + ε_z^e), integrated inwards from R0.
"""

from collections.abc import Iterator

import numpy as np
from scipy.integrate import solve_ivp

from fabfem.verification.ring import ring, ring_mesh, yielded_radius
from fabfem.verification.row import Row
from fabfem.verification.scene import Answer, Tables, solve, stage

FAR, ACROSS, FIELD = 60.0, 160, 30.0
"""Outer radius [a], cells across, stress in the ground [MPa]."""

WALL = {30.0: 0.02816236, 0.0: 0.01218476}
"""Angle of dilation [degrees] -> movement of the wall u/a where the stress along the hole is the middle one."""
COHESION, SLOPE, SHEAR, RATIO = 3.45, 3.0, 2800.0, 0.2083
STRENGTH = 2.0 * COHESION * SLOPE**0.5
RADIUS = 1.734998
"""Plastic radius R0/a."""


def rows() -> Iterator[Row]:
    """Yield the plastic radius and the movement of the wall, for both angles of dilation and stresses along."""
    for along in (20.0, 30.0):
        for dilation in WALL:
            answer = relieved(dilation, along)
            got, stopped = answer.final("inner"), answer.stopped
            place = f"ψ = {dilation:g}°, σ_z = {along:g} MPa"
            yield Row(f"R0/a, {place}", RADIUS, answer.measured(yielded_radius), 0.01, answer.seconds, stopped)
            yield Row(f"wall u/a, {place}", wall(dilation, along), None if got is None else -got, 0.01)


def relieved(dilation: float, along: float) -> Answer:
    """Return the answer of a hole whose wall loses its pressure; `along` is the first stress along it [MPa]."""
    around = {"name": "ground", "kind": "geostatic", "k0": FIELD / along, "surcharge": along}
    around["pressure"] = [{"boundary": ["inner", "outer"], "value": FIELD}]
    relief = stage("relief", 0.05, 0.05, pressure=[{"boundary": "inner", "value": 0.0}])
    mesh = ring_mesh("quad", np.geomspace(1.0, FAR, ACROSS + 1))
    return solve(ring(_rock(dilation), [around, relief]), mesh)


def wall(dilation: float, along: float) -> float:
    """Return the inward movement of the wall u/a by integration of the equations above."""
    sine = np.sin(np.radians(dilation))
    flow = (1.0 + sine) / (1.0 - sine)
    at_front = (2.0 * FIELD - STRENGTH) / (SLOPE + 1.0)
    apex = STRENGTH / (SLOPE - 1.0)

    def slope(radius: float, moved: np.ndarray) -> np.ndarray:
        radial = (at_front + apex) * (radius / RADIUS) ** (SLOPE - 1.0) - apex
        elastic = _elastic_strain(radial, along)
        return -elastic[0] - flow * (moved / radius + elastic[1] + elastic[2])

    start = -(FIELD - at_front) / (2.0 * SHEAR) * RADIUS
    path = solve_ivp(slope, (RADIUS, 1.0), [start], rtol=1e-10, atol=1e-14)
    return -float(path.y[0, -1])


def _elastic_strain(radial: float, along: float) -> np.ndarray:
    """Return the (3,) elastic strains r, θ, z where the radial stress has fallen to `radial`, compression positive."""
    hoop = SLOPE * radial + STRENGTH
    axial = min(along + RATIO * (radial + hoop - 2.0 * FIELD), hoop)
    change = np.array([radial - FIELD, hoop - FIELD, axial - along])
    return (change - RATIO / (1.0 + RATIO) * change.sum()) / (2.0 * SHEAR)


def _rock(dilation: float) -> Tables:
    return {
        "model": "mohr_coulomb",
        "youngs_modulus": 2.0 * SHEAR * (1.0 + RATIO),
        "poisson_ratio": RATIO,
        "cohesion": COHESION,
        "friction_angle": 30.0,
        "dilation_angle": dilation,
    }
