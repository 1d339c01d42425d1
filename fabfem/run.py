"""From a case file to its results: the scene's kind decides who runs it, and nothing of another kind is imported."""

from importlib import import_module
from pathlib import Path
from typing import Any

from fabfem.case import Case, read_case
from fabfem.outcome import Description, Outcome, Pricing
from fabfem.restart import FRESH, Restart

SCENES = {
    "boundary_value": "fabfem.boundary_value.run",
    "element": "fabfem.laboratory.run",
    "fabric": "fabfem.fabric_tests.run",
}
"""Module that runs each kind of scene.

It has `describe(case, pricing)`, `run(case, folder, quiet, timer, restart)` and `remember(case, folder)`.
"""


def run_case(source: Case | Path, folder: Path, quiet: bool = False, restart: Restart = FRESH) -> Outcome:
    """Run a case and write its results into a folder.

    Parameters
    ----------
    source : Case or Path
        What to run, or the file that says it.
    folder : Path
        Folder of the results, made if it is not there; results of an earlier run in it are replaced.
    quiet : bool
        Show no progress.
    restart : Restart
        Whether to go on from a checkpoint.

    Raises
    ------
    CaseError
        If the case cannot be run or the folder cannot be written.
    """
    case = source if isinstance(source, Case) else read_case(source)
    return _scene(case).run(case, folder, quiet, restart=restart)


def describe_case(case: Case, pricing: Pricing = Pricing.NONE) -> Description:
    """Return what a case leaves out and what remains, without running it.

    Parameters
    ----------
    case : Case
        What would be run.
    pricing : Pricing
        Whether to say what time it will take, and whether to measure the beginning of a run for it. A pilot counts the
        start of the program, so nothing else goes before.

    Raises
    ------
    CaseError
        If the case cannot be run.
    """
    return _scene(case).describe(case, pricing)


def remember_cost(case: Case, folder: Path) -> None:
    """Keep what the completed run in a folder has cost, for the price of the next one of its kind."""
    _scene(case).remember(case, folder)


def replay_case(case: Case, start: Any) -> tuple[tuple[str, float, str] | None, list[str]]:
    """Return how a case fails after a start (stage, fraction, reason), None if it goes on, and what was tried."""
    return _scene(case).replay(case, start)


def _scene(case: Case) -> Any:
    return import_module(SCENES[case.scene.kind])
