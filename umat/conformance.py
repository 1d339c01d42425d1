"""What a compiled UMAT keeps of the contract of its argument list, found by calling it.

Each check is one function from a `Trial` to findings: a verdict and a sentence. A wrong routine may write where it
must not, or end the process; `examined` therefore runs the checks in a process of their own and reports that too.
Strains are probed in random directions, from a fixed seed, so that a report can be repeated.
"""

import multiprocessing
from collections.abc import Callable, Iterator
from typing import Any, Literal, NamedTuple

import numpy as np

from umat.abaqus import PRESENT, strain_out, stress_in, stress_out, tangent_in
from umat.external import External, ExternalState, computed
from umat.interface import initial_state
from umat.mandel import Array, rotation
from umat.routine import Call, load, run, shared_arguments

Verdict = Literal["good", "note", "bad"]
GUARD = 1.2345678901234567e89
"""Number put behind every array, which a routine must leave alone."""
COUNT = 8
EXACT, CLOSE = 1e-9, 1e-4
"""Relative differences that are rounding, and that a difference quotient of a smooth law may have."""


class Finding(NamedTuple):
    """What one check says."""

    verdict: Verdict
    """``good``, ``note`` for what a user must know, ``bad`` for what makes runs wrong."""
    sentence: str
    """One sentence."""


class Trial(NamedTuple):
    """A routine and where it is looked at."""

    material: External
    """The routine with its properties."""
    stress: Array
    """(6,) Mandel stress, compression positive."""
    size: float
    """Norm of the strain increments [-]."""

    def strains(self) -> Array:
        """Return (COUNT, 6) strain increments; a routine of four components gets none out of its plane."""
        random = np.random.default_rng(7)
        directions = random.normal(size=(COUNT, 6))
        if self.material.components == 4:
            directions[:, 3:5] = 0.0
        return self.size * directions / np.linalg.norm(directions, axis=1)[:, None]

    def state(self) -> ExternalState:
        """Return the state that all strains start from."""
        return initial_state(self.material, None, np.tile(self.stress, (COUNT, 1)))


def examined(material: External, stress: Array, size: float = 1e-4) -> tuple[Finding, ...]:
    """Return the findings on a routine, looked at from one stress with increments of one size.

    Parameters
    ----------
    material : External
        The routine with its properties.
    stress : (6,) array
        Mandel stress, compression positive.
    size : float
        Norm of the strain increments [-].

    Raises
    ------
    ValueError
        If the library cannot be loaded or the record is impossible.
    """
    trial = Trial(material, np.asarray(stress, float), float(size))
    initial_state(material, None, trial.stress[None])
    found: list[Finding] = []
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_examine, args=(trial, sender))
    process.start()
    sender.close()
    name = "loading"
    while True:
        try:
            message = receiver.recv()
        except EOFError:
            break
        if isinstance(message, str):
            name = message
        else:
            found.append(message)
    process.join()
    if process.exitcode:
        found.append(Finding("bad", f"The routine ended the process (exit code {process.exitcode}) while {name}."))
    return tuple(found)


def _examine(trial: Trial, sender: Any) -> None:
    """Send the name of each check before it, and its findings after it."""
    for doing, check in CHECKS.items():
        sender.send(doing)
        for finding in check(trial):
            sender.send(finding)


def guarded(trial: Trial) -> Iterator[Finding]:
    """Yield whether inputs stay what they were and nothing is written behind an array."""
    material, n = trial.material, trial.material.components
    shared = shared_arguments(n, material.state_variables, material.properties, material.time_step)
    behind = {"STRESS": n, "STATEV": max(material.state_variables, 1), "DDSDDE": n * n, "STRAN": n, "DSTRAN": n}
    blocks = {name: np.full(size + 8, GUARD) for name, size in behind.items()}
    state = trial.state()
    blocks["STRESS"][:n] = stress_out(trial.stress, n)
    blocks["STATEV"][: material.state_variables] = state.variables[0]
    blocks["DDSDDE"][: n * n], blocks["STRAN"][:n] = 0.0, 0.0
    blocks["DSTRAN"][:n] = strain_out(trial.strains()[0], n)
    before = {name: block.copy() for name, block in (blocks | shared).items()}
    stress, variables, tangent, strain, increment = (blocks[name][None] for name in behind)
    call = Call(stress, variables, tangent, strain, increment, np.zeros((1, 2)), np.ones(1), shared)
    run(load(material.library), call, 0, 1)
    changed = [
        name for name in ("STRAN", "DSTRAN", *shared) if not np.array_equal(before[name], (blocks | shared)[name])
    ]
    changed += [] if not call.time.any() else ["TIME"]
    changed = [name for name in changed if name not in ("RPL", "DDSDDT", "DRPLDE", "DRPLDT")]
    yield _judged(not changed, "Inputs stay what they were", f"The routine changes its inputs: {', '.join(changed)}")
    over = [name for name in ("STRESS", "STATEV", "DDSDDE") if np.any(blocks[name][behind[name] :] != GUARD)]
    yield _judged(
        not over, "Nothing is written beyond an array", f"The routine writes beyond the end of {', '.join(over)}"
    )


def repeated(trial: Trial) -> Iterator[Finding]:
    """Yield whether the answer depends on nothing but the arguments."""
    first = computed(trial.material, trial.strains(), trial.state())
    again = computed(trial.material, trial.strains()[::-1], trial.state())
    same = all(np.array_equal(a, b[::-1], equal_nan=True) for a, b in zip(first[:3], again[:3], strict=True))
    yield _judged(
        same,
        "The same call gives the same answer, in any order of points",
        "The same call gives another answer the second time: the routine keeps a state of its own (SAVE, COMMON), "
        "which an implicit solver cannot undo",
    )


def finished(trial: Trial) -> Iterator[Finding]:
    """Yield whether answers are numbers, whether small increments are refused, and what a zero increment does."""
    call = computed(trial.material, trial.strains(), trial.state())
    finite = all(np.isfinite(array).all() for array in call[:3])
    yield _judged(finite, "Every answer is a finite number", "STRESS, STATEV or DDSDDE are not finite numbers")
    refused = int((call.step < 1.0).sum())
    yield _judged(
        not refused,
        f"No increment of size {trial.size:g} is refused",
        f"{refused} of {COUNT} increments of size {trial.size:g} are refused (PNEWDT < 1)",
        "note",
    )
    still = computed(trial.material, 0.0 * trial.strains(), trial.state())
    drift = _apart(stress_in(still.stress, trial.material.components), trial.state().stress)
    yield _judged(
        drift < EXACT,
        "A zero increment leaves the stress as it is",
        f"A zero increment changes the stress by {drift:.1e} of it: the initial stress is not one of the law, "
        "or the law is viscous",
        "note",
    )


def differentiated(trial: Trial) -> Iterator[Finding]:
    """Yield whether DDSDDE is the derivative of STRESS, and whether all of it is written."""
    material, strains, state = trial.material, trial.strains(), trial.state()
    call, components = computed(material, strains, state), _known(material.components)
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
    apart = np.array([_apart(*pair) for pair in zip(tangent_in(call.tangent, material.components)[place],
                                                    difference[place], strict=True)])  # fmt: skip
    wrong = int((apart > CLOSE).sum())
    yield _judged(
        wrong == 0,
        f"DDSDDE is the derivative of STRESS, to {apart.max():.1e}",
        f"DDSDDE is not the derivative of STRESS at {wrong} of {COUNT} increments (apart by {apart.max():.1e} of it): "
        "Newton's method will be slow or fail",
        "bad" if wrong > COUNT // 2 else "note",
    )
    diagonal = np.diagonal(call.tangent, axis1=1, axis2=2)
    yield _judged(
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
    apart = _apart(straight @ by.T - mean, crooked - mean)
    yield _judged(
        apart < 1e-6,
        "From an isotropic stress the answer turns with the strain: order and engineering shears are those of a UMAT",
        f"From an isotropic stress the answer does not turn with the strain (apart by {apart:.1e}): the material is "
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
    agree = bool((flat.step >= 1.0).all()) and _apart(solid.stress[:, PRESENT[4]], flat.stress) < EXACT
    yield _judged(
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
    agree = _apart(call.stress[:, PRESENT[3]], flat.stress) < 1e-6
    yield _judged(
        agree,
        "NTENS = 3 gives the plane stress of the solid; runs here never ask for it",
        "NTENS = 3 is answered, but not with the plane stress of the solid; runs here never ask for it",
        "note",
    )


def dependent(trial: Trial) -> Iterator[Finding]:
    """Yield whether the answer depends on the old total strain, or on time."""
    state, strains = trial.state(), trial.strains()
    plain = computed(trial.material, strains, state).stress
    strained = computed(trial.material, strains, state._replace(strain=state.strain + strains)).stress
    if _apart(plain, strained) > EXACT:
        yield Finding("note", "The answer depends on the old total strain STRAN, which starts at zero in every run.")
    later = computed(trial.material, strains, state._replace(time=state.time + 3.0)).stress
    longer = computed(trial.material._replace(time_step=2.0 * trial.material.time_step), strains, state).stress
    timeless = max(_apart(plain, later), _apart(plain, longer)) < EXACT
    yield _judged(
        timeless,
        "The answer does not depend on time",
        "The answer depends on TIME or DTIME, which only count updates here: viscous laws are not supported",
        "bad",
    )


CHECKS: dict[str, Callable[[Trial], Iterator[Finding]]] = {
    "looking for changed inputs": guarded,
    "calling it twice": repeated,
    "looking at its answers": finished,
    "comparing DDSDDE with differences": differentiated,
    "turning the strain": turned,
    "looking for dependence on time": dependent,
    "trying NTENS = 4 and 3": flattened,
}
"""What is being done, and the check that does it; the one most likely to end the process comes last."""


def _known(components: int) -> np.ndarray:
    """Return the Mandel components that a routine knows."""
    return np.arange(6) if components == 6 else np.array([0, 1, 2, 5])


def _judged(good: bool, yes: str, no: str, otherwise: Verdict = "bad") -> Finding:
    return Finding("good", f"{yes}.") if good else Finding(otherwise, f"{no}.")


def _apart(left: Array, right: Array) -> float:
    """Return the largest difference over the largest number of either; infinite where a number is not finite."""
    if not (np.isfinite(left).all() and np.isfinite(right).all()):
        return np.inf
    size = max(np.abs(left).max(), np.abs(right).max())
    return float(np.abs(left - right).max() / size) if size else 0.0
