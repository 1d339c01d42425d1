"""Laws under strain probes of unit size, in all directions [P §3–5].

A probe is (ε_xx, ε_yy, √2 ε_xy) = (sinθ cosχ, sinθ sinχ, cosθ) [P 7, 11]: θ = 90° lies in the plane of I and a stress
deviator along x and y, others shear across it. Nothing else strains, and all of the strain is taken as plastic by the
laws that read the plastic strain. The rates are those at the state given: no history is needed.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from fabfem.case import FabricCase
from fabfem.case import fabric as said
from fabfem.fabric_tests.columns import AXES
from fabfem.fabric_tests.curves import Curve, curves, start
from fabfem.fabric_tests.drives import Block, Measured, Value
from umat.fabric.law import INPUTS
from umat.fabric_history import PLASTIC, PSI, RATIO, STRAIN, STRESS, increment
from umat.mandel import FACTOR, Array, deviator, dot, norm

HEADERS = (
    "law", "path", "chi [degree]", "theta [degree]", "strain_xx [-]", "strain_yy [-]", "strain_xy [-]",
    *(f"dF_{axes} [-]" for axes in AXES), "dZ [-]", "dA [-]",
)  # fmt: skip


def measure(drive: said.Probe, case: FabricCase) -> Measured:
    """Return the table of all laws under all probes."""
    laws = curves(case)
    stress = np.array(drive.stress) * FACTOR
    starts = [start(case, curve, stress[None])[0] for curve in laws]
    count = drive.directions * drive.inclinations
    remains = (("laws", str(len(laws))), ("probes", str(count)))
    return Measured(HEADERS, _blocks(drive, stress, laws, starts), len(laws), remains)


def probes(directions: int, inclinations: int) -> tuple[Array, Array, Array]:
    """Return χ and θ [deg] and the strains (n, 6) of all probes; χ = −180° to 180°, θ in equal steps to 90°."""
    chi = np.linspace(-180.0, 180.0, directions + 1)
    theta = 90.0 * np.arange(1, inclinations + 1) / inclinations
    theta, chi = (grid.ravel() for grid in np.meshgrid(theta, chi, indexing="ij"))
    strain = np.zeros((len(chi), 6))
    strain[:, 0] = np.sin(np.radians(theta)) * np.cos(np.radians(chi))
    strain[:, 1] = np.sin(np.radians(theta)) * np.sin(np.radians(chi))
    strain[:, 5] = np.cos(np.radians(theta))
    return chi, theta, strain


def rates(law: Any, fabric: Array, stress: Array, psi: float, strain: Array) -> Array:
    """Return ΔF (n, 6) of a law for strains (n, 6), all from one state (6,); the stress ratio does not change."""
    inputs = np.zeros((len(strain), INPUTS))
    inputs[:, :6], inputs[:, STRESS], inputs[:, PSI.start] = fabric, stress, psi
    inputs[:, RATIO], inputs[:, STRAIN], inputs[:, PLASTIC] = 0.0, strain, strain
    return increment(law, inputs)


def _blocks(drive: said.Probe, stress: Array, laws: tuple[Curve, ...], starts: list[Array]) -> Iterator[Block]:
    chi, theta, strain = probes(drive.directions, drive.inclinations)
    full: Array | None = None
    for curve, fabric in zip(laws, starts, strict=True):
        change = rates(curve.law, fabric, stress, drive.state_parameter, strain)
        back = rates(curve.law, fabric, stress, drive.state_parameter, -strain)
        full = change if full is None else full
        # A = F_1 − F_2 grows by the change along the major axis less that along the minor, √2 ΔF:τ̂
        dz, da = change[:, :3].sum(axis=1), 2.0**0.5 * dot(change, _major(fabric, stress))
        columns = [chi, theta, *(strain / FACTOR)[:, [0, 1, 5]].T, *(change / FACTOR).T, dz, da]
        found: list[tuple[Value, ...]] = [
            (curve.name, f"theta={row[1]:g}", *(float(value) for value in row)) for row in zip(*columns, strict=True)
        ]
        summary: dict[str, Any] = {"law": curve.name, "asymmetry_on_reversal": _relative(change + back, change)}
        yield Block(
            found, summary | {"distance_from_first": _relative(change - full, full)} | _plane(chi, theta, dz, da)
        )


def _major(fabric: Array, stress: Array) -> Array:
    """Return the unit deviator (6,) in the plane x, y of the fabric, or of the stress where the fabric has none."""
    for tensor in (fabric, stress):
        flat = np.where(np.isin(np.arange(6), (0, 1, 5)), tensor, 0.0)
        flat[:2] -= 0.5 * flat[:2].sum()
        if norm(flat) > 1e-9 * max(float(norm(deviator(tensor))), 1e-300):
            return np.asarray(flat / norm(flat))
    return np.zeros(6)


def _relative(part: Array, whole: Array) -> float:
    """Return the root mean square of one set of tensors over that of another."""
    size = float(np.sqrt(np.mean(dot(whole, whole))))
    return float(np.sqrt(np.mean(dot(part, part)))) / size if size > 0.0 else 0.0


def _plane(chi: Array, theta: Array, dz: Array, da: Array) -> dict[str, float]:
    """Return the harmonics of ΔZ and ΔA over χ in the plane, a cosχ + b sinχ [P 12], and how far they are from it."""
    flat = theta == 90.0
    angle = np.radians(chi[flat][:-1])
    waves = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    found: dict[str, float] = {}
    for name, values in (("Z", dz[flat][:-1]), ("A", da[flat][:-1])):
        (a, b), *_ = np.linalg.lstsq(waves, values, rcond=None)
        found |= {f"a_{name}": float(a), f"b_{name}": float(b)}
        found[f"not_sinusoidal_{name}"] = float(np.abs(waves @ [a, b] - values).max())
        found[f"chi_max_{name}"] = float(np.degrees(np.arctan2(b, a)))
    return found
