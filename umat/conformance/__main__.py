"""The process in which a routine is examined: `python -m umat.conformance FOLDER`."""

import pickle
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from umat.conformance import ASKED, TOLD
from umat.conformance.calls import dependent, finished, guarded, repeated
from umat.conformance.mechanics import differentiated, flattened, turned
from umat.conformance.trial import Finding, Trial

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


def examine(trial: Trial, tell: Callable[[Any], object]) -> None:
    """Tell the name of each check before it, and its findings after it."""
    for doing, check in CHECKS.items():
        tell(doing)
        for finding in check(trial):
            tell(finding)


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    with (folder / TOLD).open("wb", buffering=0) as stream:
        examine(pickle.loads((folder / ASKED).read_bytes()), lambda message: stream.write(pickle.dumps(message)))
