"""Checks of the mechanics of a routine: the tangent, turned strains, plane states."""

from collections.abc import Iterator

import numpy as np

from umat.abaqus import ORDER, PRESENT, stress_in, tangent_in
from umat.conformance.trial import COUNT, EXACT, Finding, Trial, apart, judged
from umat.external import computed
from umat.interface import initial_state
from umat.mandel import Array, rotation

CLOSE = 1e-4
"""Relative difference that a difference quotient of a smooth law may have."""


def differentiated(trial: Trial) -> Iterator[Finding]:
    """Yield whether DDSDDE is the derivative of STRESS, and whether all of it is written."""
    material, strains, state = trial.material, trial.strains(), trial.state()
    call, components = computed(material, strains, state), np.sort(ORDER[PRESENT[material.components]])
    if not call.tangent.any():
        yield Finding(
            "note", "The routine leaves DDSDDE at zero: differences of its stress are taken, seven calls for one."
        )
        return
    difference = np.zeros((COUNT, 6, 6))
    step = 1e-3 * trial.size
    for k in components:
        moved = [computed(material, strains + sign * step * np.eye(6)[k], state) for sign in (1.0, -1.0)]
        up, down = (stress_in(each.stress, material.components) for each in moved)
        difference[:, :, k] = (up - down) / (2.0 * step)
    place = np.ix_(np.arange(COUNT), components, components)
    worst = np.array([apart(*pair) for pair in zip(tangent_in(call.tangent, material.components)[place],
                                                    difference[place], strict=True)])  # fmt: skip
    wrong = int((worst > CLOSE).sum())
    yield judged(
        wrong == 0,
        f"DDSDDE is the derivative of STRESS, to {worst.max():.1e}",
        f"DDSDDE is not the derivative of STRESS at {wrong} of {COUNT} increments (apart by {worst.max():.1e} of it): "
        "Newton's method will be slow or fail",
        "bad" if wrong > COUNT // 2 else "note",
    )
    diagonal = np.diagonal(call.tangent, axis1=1, axis2=2)
    yield judged(
        bool((diagonal > 0.0).all()),
        "Every component resists its own strain",
        "Some component does not resist its own strain: sign or order of components are not those of a UMAT, "
        "or the material softens",
        "note",
    )


def turned(trial: Trial) -> Iterator[Finding]:
    """Yield whether turning the strain turns the answer: shears and their order as a UMAT has them, or anisotropy."""
    if trial.material.components == 4:
        angle = 0.7
        matrix = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    else:
        matrix = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
        matrix *= np.sign(np.linalg.det(matrix))
    by, mean = rotation(matrix), np.array([1.0, 1, 1, 0, 0, 0]) * trial.stress[:3].mean()
    state = initial_state(trial.material, None, np.tile(mean, (COUNT, 1)))
    straight, crooked = (
        stress_in(computed(trial.material, strain, state).stress, trial.material.components)
        for strain in (trial.strains(), trial.strains() @ by.T)
    )
    turning = apart(straight @ by.T - mean, crooked - mean)
    yield judged(
        turning < 1e-6,
        "From an isotropic stress the answer turns with the strain: order and engineering shears are those of a UMAT",
        f"From an isotropic stress the answer does not turn with the strain (apart by {turning:.1e}): the material is "
        "anisotropic, or shear strains are not taken as engineering ones in the order 12, 13, 23",
        "note",
    )


def flattened(trial: Trial) -> Iterator[Finding]:
    """Yield whether plane strain and plane stress agree with the solid."""
    if trial.material.components != 6:
        return
    plane = trial.strains()
    plane[:, 3:5] = 0.0
    start = trial.stress * [1, 1, 1, 0, 0, 1]
    state = initial_state(trial.material, None, np.tile(start, (COUNT, 1)))
    solid = computed(trial.material, plane, state)
    flat = computed(trial.material._replace(components=4), plane, state)
    agree = bool((flat.step >= 1.0).all()) and apart(solid.stress[:, PRESENT[4]], flat.stress) < EXACT
    yield judged(
        agree,
        "NTENS = 4 gives the same as NTENS = 6 with the same strain: plane strain and axisymmetry may use either",
        "NTENS = 4 does not give the same as NTENS = 6 with the same strain: leave components at 6, "
        "plane strain and axisymmetry are embedded",
        "note",
    )
    yield from _plane_stress(trial, plane)


def _plane_stress(trial: Trial, plane: Array) -> Iterator[Finding]:
    """Compare NTENS = 3 with the solid whose strain zz leaves no stress zz; runs never use it."""
    material = trial.material
    start = initial_state(material, None, np.tile(trial.stress * [1, 1, 0, 0, 0, 1], (COUNT, 1)))
    flat = computed(material._replace(components=3), plane, start)
    if not ((flat.step >= 1.0).all() and np.isfinite(flat.stress).all()):
        yield Finding("note", "NTENS = 3 (plane stress) is refused by the routine; runs here never ask for it.")
        return
    solid = plane.copy()
    for _ in range(20):
        call = computed(material, solid, start)
        solid[:, 2] -= stress_in(call.stress)[:, 2] / np.maximum(tangent_in(call.tangent)[:, 2, 2], 1e-30)
    agree = apart(call.stress[:, PRESENT[3]], flat.stress) < 1e-6
    yield judged(
        agree,
        "NTENS = 3 gives the plane stress of the solid; runs here never ask for it",
        "NTENS = 3 is answered, but not with the plane stress of the solid; runs here never ask for it",
        "note",
    )
