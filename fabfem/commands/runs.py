"""Commands for one case and its result: solve, check, show and replay."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from fabfem.commands.status import DONE, INTERRUPTED, NO_PICTURE, RED, STOPPED, fail
from fabfem.parallel.world import first, launched

if TYPE_CHECKING:
    from fabfem.case import Case


UNKNOWN = "not known before a run of this kind; --price measures the beginning of one"


def add_commands(commands: argparse._SubParsersAction, common: argparse.ArgumentParser) -> None:
    """Add the commands to those of a parser."""
    solve = commands.add_parser("solve", parents=[common], help="run a case and write its results")
    solve.add_argument("case", type=Path, metavar="CASE.toml")
    solve.add_argument("--out", type=Path, metavar="DIR", help="folder of the results (default: results/CASE)")
    origin = solve.add_mutually_exclusive_group()
    origin.add_argument("--resume", action="store_true", help="go on from the last checkpoint in the results, if any")
    origin.add_argument("--branch", type=Path, metavar="DIR", help="begin a new result from the last state in DIR")
    solve.set_defaults(command=_solve, shared=True)

    check = commands.add_parser("check", parents=[common], help="validate a case and say what its scene leaves out")
    check.add_argument("case", type=Path, metavar="CASE.toml")
    check.add_argument("--price", action="store_true", help="measure the time of a kind of run not seen before")
    check.set_defaults(command=_check, shared=True)

    show = commands.add_parser("show", parents=[common], help="draw pictures of a result")
    show.add_argument("folder", type=Path, metavar="DIR")
    show.set_defaults(command=_show)

    again = commands.add_parser("replay", parents=[common], help="run again alone what failed in a run")
    again.add_argument("folder", type=Path, metavar="DIR", help="a result, or one of the folders in its replay/")
    again.set_defaults(command=_replay)


def _solve(options: argparse.Namespace) -> int:
    from fabfem.case import read_case
    from fabfem.rates import Stopwatch
    from fabfem.restart import Restart
    from fabfem.run import remember_cost, run_case

    case, watch = read_case(options.case), Stopwatch()
    if case.scene.kind != "boundary_value" and not first():
        return DONE  # what has no mesh is done by one process
    folder, restart = options.out or Path("results") / options.case.stem, Restart(options.resume, options.branch)
    outcome = run_case(case, folder, quiet=options.quiet, restart=restart)
    if first() and not options.quiet:
        print(outcome.summary(_error_class(case)))
        _print_remarks(case)
        if options.branch and outcome.status == "completed" and not outcome.increments:
            print(f"nothing was left to run: {options.branch} had come to the end of the last stage; add a stage")
    if outcome.status == "completed":
        if not launched() and not watch.compiled:  # what only the first run of all costs is no price
            remember_cost(case, outcome.folder)
        return DONE
    return fail(outcome.reason, INTERRUPTED if outcome.status == "interrupted" else STOPPED)


def _print_remarks(case: "Case", prefix: str = "") -> None:
    """Print what is odd about a case."""
    from fabfem.remarks import remarks

    for remark in remarks(case):
        print(f"{prefix}remark: {remark}")


def _error_class(case: "Case") -> str:
    """Return the error class of the case's settings in a sentence, if a study of it is kept beside it."""
    if not case.path.with_suffix(".study.json").is_file():
        return ""
    from fabfem.study.accuracy import accuracy_sentence

    return accuracy_sentence(case)


def _check(options: argparse.Namespace) -> int:
    from fabfem.case import read_case, resolved
    from fabfem.outcome import Pricing
    from fabfem.output.progress import summary
    from fabfem.run import describe_case

    case = read_case(options.case)
    told = first() and not options.quiet
    priced = told and not launched()  # a price is that of the whole scene in one process
    measured = Pricing.PILOT if options.price else Pricing.KNOWN
    description = describe_case(case, measured if priced else Pricing.NONE)
    if told:
        time = [("time", description.time or UNKNOWN)] if priced else []
        print(resolved(case))
        print("# What the scene leaves out:", *description.omitted, sep="\n#   ")
        print("# What remains:\n" + summary((*description.remains, *time), prefix="#   "))
        _print_remarks(case, prefix="# ")
    return DONE


def _show(options: argparse.Namespace) -> int:
    from fabfem.pictures.show import show

    shown = show(options.folder)
    if not options.quiet:
        print("\n".join(str(picture) for picture in shown.pictures))
    return fail(shown.trouble, NO_PICTURE) if shown.trouble else DONE


def _replay(options: argparse.Namespace) -> int:
    from fabfem.replay import replay

    same = True
    for found in replay(options.folder):
        same &= found.same
        if not options.quiet:
            how = "the same as then" if found.same else "NOT the same as then"
            print(str(found.folder), *found.lines, how, "", sep="\n")
    return DONE if same else RED
