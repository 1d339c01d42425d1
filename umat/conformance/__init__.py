"""What a compiled UMAT keeps of the contract of its argument list, found by calling it.

Each check is one function from a `Trial` to findings: a verdict and a sentence. `calls` has those of the arguments,
`mechanics` those of the answers. A wrong routine may write where it must not, or end the process; `examined` therefore
runs the checks in a process of their own, `__main__`, and reports that too. Strains are probed in random directions,
from a fixed seed, so that a report can be repeated.
"""

import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

import umat
from umat.conformance.trial import Finding, Trial
from umat.external import External
from umat.interface import initial_state

__all__ = ["Finding", "examined"]

ASKED, TOLD = "trial.pickle", "findings.pickle"
"""Files by which the two processes talk; the routine may print what it likes."""


def examined(material: External, stress: ArrayLike, size: float = 1e-4) -> tuple[Finding, ...]:
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
    paths = [str(Path(umat.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / ASKED).write_bytes(pickle.dumps(trial))
        command = [sys.executable, "-m", "umat.conformance", folder]
        done = subprocess.run(command, capture_output=True, check=False, env=environment)
        doing, found = _read(Path(folder) / TOLD)
    if b"Traceback" in done.stderr:
        raise RuntimeError(done.stderr.decode(errors="replace"))
    if done.returncode:
        found.append(Finding("bad", f"The routine ended the process (exit code {done.returncode}) while {doing}."))
    return tuple(found)


def _read(file: Path) -> tuple[str, list[Finding]]:
    """Return what was being done last, and the findings."""
    doing, found = "the process began", []
    with file.open("rb") as stream:
        while stream.peek(1):
            message = pickle.load(stream)
            if isinstance(message, str):
                doing = message
            else:
                found.append(message)
    return doing, found
