"""Checks of what a routine does with its arguments: inputs, bounds, hidden states, refusals, time."""

from collections.abc import Iterator

import numpy as np

from umat.abaqus import strain_out, stress_in, stress_out
from umat.conformance.trial import COUNT, EXACT, Finding, Trial, apart, judged
from umat.external import computed
from umat.routine import Call, load, run, shared_arguments

GUARD = 1.2345678901234567e89
"""Number put behind every array, which a routine must leave alone."""
FREE = ("RPL", "DDSDDT", "DRPLDE", "DRPLDT")
"""Arguments that are the same for all points and that a routine may change: nobody reads them."""


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
    changed = [name for name in changed if name not in FREE]
    yield judged(not changed, "Inputs stay what they were", f"The routine changes its inputs: {', '.join(changed)}")
    over = [name for name in ("STRESS", "STATEV", "DDSDDE") if np.any(blocks[name][behind[name] :] != GUARD)]
    yield judged(
        not over, "Nothing is written beyond an array", f"The routine writes beyond the end of {', '.join(over)}"
    )


def repeated(trial: Trial) -> Iterator[Finding]:
    """Yield whether the answer depends on nothing but the arguments."""
    first = computed(trial.material, trial.strains(), trial.state())
    again = computed(trial.material, trial.strains()[::-1], trial.state())
    same = all(np.array_equal(a, b[::-1], equal_nan=True) for a, b in zip(first[:3], again[:3], strict=True))
    yield judged(
        same,
        "The same call gives the same answer, in any order of points",
        "The same call gives another answer the second time: the routine keeps a state of its own (SAVE, COMMON), "
        "which an implicit solver cannot undo",
    )


def finished(trial: Trial) -> Iterator[Finding]:
    """Yield whether answers are numbers, whether small increments are refused, and what a zero increment does."""
    call = computed(trial.material, trial.strains(), trial.state())
    finite = all(np.isfinite(array).all() for array in call[:3])
    yield judged(finite, "Every answer is a finite number", "STRESS, STATEV or DDSDDE are not finite numbers")
    refused = int((call.step < 1.0).sum())
    yield judged(
        not refused,
        f"No increment of size {trial.size:g} is refused",
        f"{refused} of {COUNT} increments of size {trial.size:g} are refused (PNEWDT < 1)",
        "note",
    )
    still = computed(trial.material, 0.0 * trial.strains(), trial.state())
    drift = apart(stress_in(still.stress, trial.material.components), trial.state().stress)
    yield judged(
        drift < EXACT,
        "A zero increment leaves the stress as it is",
        f"A zero increment changes the stress by {drift:.1e} of it: the initial stress is not one of the law, "
        "or the law is viscous",
        "note",
    )


def dependent(trial: Trial) -> Iterator[Finding]:
    """Yield whether the answer depends on the old total strain, or on time."""
    state, strains = trial.state(), trial.strains()
    plain = computed(trial.material, strains, state).stress
    strained = computed(trial.material, strains, state._replace(strain=state.strain + strains)).stress
    if apart(plain, strained) > EXACT:
        yield Finding("note", "The answer depends on the old total strain STRAN, which starts at zero in every run.")
    later = computed(trial.material, strains, state._replace(time=state.time + 3.0)).stress
    longer = computed(trial.material._replace(time_step=2.0 * trial.material.time_step), strains, state).stress
    timeless = max(apart(plain, later), apart(plain, longer)) < EXACT
    yield judged(
        timeless,
        "The answer does not depend on time",
        "The answer depends on TIME or DTIME, which only count updates here: viscous laws are not supported",
        "bad",
    )
