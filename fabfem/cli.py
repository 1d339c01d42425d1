"""The ``fabfem`` command.

Exit status: 0 done, 1 the pictures could not be drawn, an answer of the verification or of an extreme is wrong, a
replay ends otherwise or a UMAT breaks its contract, 2 bad input or a folder that takes no results, 3 a run that could
not go on or not write its results (all that converged is kept), 130 interrupted. Nothing heavy is imported before a
command needs it.
"""

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fabfem import __version__
from fabfem.authoring import add_commands
from fabfem.parallel.world import ended_together, first, launched

if TYPE_CHECKING:
    from fabfem.case import Case

DONE, NO_PICTURE, RED, BAD_INPUT, STOPPED, INTERRUPTED = 0, 1, 1, 2, 3, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after the command; those of the process by default.
    """
    options = _parser().parse_args(arguments)
    try:
        with warnings.catch_warnings(), ended_together(options.debug):
            if not options.debug:  # numbers out of all proportion overflow; what is not finite is refused with a reason
                warnings.filterwarnings("ignore", category=RuntimeWarning, module="numpy|scipy")
            if launched() and options.command not in (_solve, _check):
                return _fail("several processes share 'solve' and 'check', no other command", BAD_INPUT)
            return options.command(options)
    except KeyboardInterrupt:
        return _fail("interrupted before the first increment", INTERRUPTED)
    except BrokenPipeError:  # whoever read the output, such as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except Exception as error:
        if options.debug:
            raise
        return _explained(error)


def _explained(error: Exception) -> int:
    """Print an error as one sentence and return its exit status."""
    from fabfem.case import CaseError

    if isinstance(error, CaseError):
        return _fail(str(error), BAD_INPUT)
    if isinstance(error, OSError):
        return _fail(f"{error.filename or 'a file'}: {error.strerror or error}", BAD_INPUT)
    return _fail(f"this is a fault of the program ({type(error).__name__}: {error}); --debug shows where", STOPPED)


def _fail(message: str, status: int) -> int:
    if first():
        print(f"fabfem: {message}", file=sys.stderr)
    return status


def _solve(options: argparse.Namespace) -> int:
    from fabfem.case import read_case
    from fabfem.restart import Restart
    from fabfem.run import remember_cost, run_case

    case = read_case(options.case)
    if case.scene.kind != "boundary_value" and not first():
        return DONE  # what has no mesh is done by one process
    folder, restart = options.out or Path("results") / options.case.stem, Restart(options.resume, options.branch)
    outcome = run_case(case, folder, quiet=options.quiet, restart=restart)
    if first() and not options.quiet:
        print(outcome.summary(_error_class(case)))
    if outcome.status == "completed":
        if not launched():
            remember_cost(case, outcome.folder)
        return DONE
    return _fail(outcome.reason, INTERRUPTED if outcome.status == "interrupted" else STOPPED)


def _error_class(case: "Case") -> str:
    """Return the error class of the case's settings in a sentence, if a study of it is kept beside it."""
    if not case.path.with_suffix(".study.json").is_file():
        return ""
    from fabfem.study.accuracy import accuracy_sentence

    return accuracy_sentence(case)


def _check(options: argparse.Namespace) -> int:
    from fabfem.case import read_case, resolved
    from fabfem.output.progress import summary
    from fabfem.run import describe_case, price_case

    case = read_case(options.case)
    description = describe_case(case)
    if first() and not options.quiet:
        print(resolved(case))
        print("# What the scene leaves out:", *description.omitted, sep="\n#   ")
        cost = price_case(case) if options.price else ""
        remains = (*description.remains, *([("time", cost)] if cost else []))
        print("# What remains:\n" + summary(remains, prefix="#   "))
    return DONE


def _sweep(options: argparse.Namespace) -> int:
    from fabfem.study.sweep import sweep

    swept = sweep(options.case, _folder(options, "sweep"), options.quiet)
    pictures: tuple[Path, ...] = ()
    if swept.pictures:
        from fabfem.pictures.sweep import draw

        pictures = draw(swept.folder)
    if not options.quiet:
        print(
            f"{swept.completed} of {swept.runs} runs completed", *(f"  {p}" for p in (swept.table, *pictures)), sep="\n"
        )
    return DONE if swept.completed == swept.runs else STOPPED


def _study(options: argparse.Namespace) -> int:
    from fabfem.pictures.work_precision import draw
    from fabfem.study.work_precision import study

    try:
        found = study(options.case, _folder(options, "study"), options.quiet)
    except KeyboardInterrupt:
        return _fail("interrupted; runs that ended are kept, and the same command goes on from there", INTERRUPTED)
    files = [found.folder / "study.csv", draw(found.folder)]
    if options.keep:
        from fabfem.case import read_case
        from fabfem.study.accuracy import keep

        files.append(keep(read_case(options.case), found.folder))
    if not options.quiet:
        print(*found.sentences, *(f"  {file}" for file in files), sep="\n")
    return DONE


def _calibrate(options: argparse.Namespace) -> int:
    from fabfem.pictures.calibration import draw
    from fabfem.study.calibrate import calibrate

    try:
        found = calibrate(options.case, _folder(options, "calibrate"), options.quiet)
    except KeyboardInterrupt:
        return _fail("interrupted; runs that ended are kept, and the same command goes on from there", INTERRUPTED)
    picture = draw(found.folder)
    if not options.quiet:
        print(*found.sentences, f"  {found.folder / 'calibration.json'}", f"  {picture}", sep="\n")
    return DONE


def _folder(options: argparse.Namespace, what: str) -> Path:
    """Return where the results of many runs of a case go."""
    return options.out or Path("results") / f"{options.case.stem}_{what}"


def _show(options: argparse.Namespace) -> int:
    from fabfem.pictures.show import show

    shown = show(options.folder)
    if not options.quiet:
        print("\n".join(str(picture) for picture in shown.pictures))
    return _fail(shown.trouble, NO_PICTURE) if shown.trouble else DONE


def _gallery(options: argparse.Namespace) -> int:
    from fabfem.gallery import RIGHT, case_files, gallery

    files = case_files(options.cases)
    folder = options.out or Path("results") / "gallery" / files[0].parent.name
    shown = gallery(files, folder, options.quiet, options.pictures)
    return DONE if all(one.status == RIGHT for one in shown) else STOPPED


def _replay(options: argparse.Namespace) -> int:
    from fabfem.replay import replay

    same = True
    for found in replay(options.folder):
        same &= found.same
        if not options.quiet:
            how = "the same as then" if found.same else "NOT the same as then"
            print(str(found.folder), *found.lines, how, "", sep="\n")
    return DONE if same else RED


def _verify(options: argparse.Namespace) -> int:
    from fabfem.verification.problems import chosen
    from fabfem.verification.report import verify

    return DONE if verify(chosen(options.only), options.json, options.quiet) else RED


def _check_umat(options: argparse.Namespace) -> int:
    from fabfem.routines import check_routine

    findings = check_routine(
        options.library, options.properties, options.state_variables, options.initial_state, options.components,
        options.stress, options.size,
    )  # fmt: skip
    if not options.quiet:
        print("\n".join(f"{finding.verdict:5} {finding.sentence}" for finding in findings))
    bad = sum(finding.verdict == "bad" for finding in findings)
    return _fail(f"{options.library}: {bad} of {len(findings)} findings are bad", RED) if bad else DONE


def _export_umat(options: argparse.Namespace) -> int:
    from fabfem.routines import export

    lines = export(options.material, options.out, options.case, options.directions, options.units, options.cpu)
    if not options.quiet:
        print("\n".join(lines))
    return DONE


def _umat_commands(commands: argparse._SubParsersAction, common: argparse.ArgumentParser) -> None:
    """Add the commands for compiled routines."""
    check = commands.add_parser("check-umat", parents=[common], help="call a compiled UMAT and say what it keeps of it")
    check.add_argument("library", type=Path, metavar="LIBRARY")
    numbers = {"--properties": "PROPS", "--initial-state": "STATEV at the start", "--stress": "xx yy zz [yz xz xy]"}
    for name, what in numbers.items():
        check.add_argument(name, type=float, nargs="+", default=[], metavar="X", help=what)
    check.add_argument("--state-variables", type=int, default=0, metavar="N", help="NSTATV")
    check.add_argument("--components", type=int, choices=(4, 6), default=6, help="NTENS (default: 6)")
    check.add_argument("--size", type=float, default=1e-4, metavar="X", help="norm of the strains (default: 1e-4)")
    check.set_defaults(command=_check_umat)

    export = commands.add_parser("export-umat", parents=[common], help="write a material as a library with a UMAT")
    export.add_argument("--material", required=True, metavar="NAME", help="a sand, or with --case a material of it")
    export.add_argument("--out", type=Path, required=True, metavar="LIBRARY")
    export.add_argument("--case", type=Path, metavar="CASE.toml", help="case that has the material")
    export.add_argument("--directions", default="bazant_oh_37", metavar="NAME", help="contact directions of a sand")
    export.add_argument("--units", default="kN,m", metavar="FORCE,LENGTH", help="units of a sand (default: kN,m)")
    export.add_argument(
        "--cpu", default="host", metavar="NAME", help="processor: host, generic, x86-64-v2 … v4 (default: host)"
    )
    export.set_defaults(command=_export_umat)


def _stress(options: argparse.Namespace) -> int:
    from fabfem.extremes.report import chosen, stress

    return DONE if stress(chosen(options.only), options.json, options.quiet) else RED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="fabfem", description="Boundary-value problems in granular soil with an evolving fabric."
    )
    parser.add_argument("--version", action="version", version=f"fabfem {__version__}")
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--quiet", action="store_true", help="print nothing but errors")
    common.add_argument("--debug", action="store_true", help="show the traceback of an error")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    add_commands(parser, commands, common)

    solve = commands.add_parser("solve", parents=[common], help="run a case and write its results")
    solve.add_argument("case", type=Path, metavar="CASE.toml")
    solve.add_argument("--out", type=Path, metavar="DIR", help="folder of the results (default: results/CASE)")
    origin = solve.add_mutually_exclusive_group()
    origin.add_argument("--resume", action="store_true", help="go on from the last checkpoint in the results, if any")
    origin.add_argument("--branch", type=Path, metavar="DIR", help="begin a new result from the last state in DIR")
    solve.set_defaults(command=_solve)

    check = commands.add_parser("check", parents=[common], help="validate a case and say what its scene leaves out")
    check.add_argument("case", type=Path, metavar="CASE.toml")
    check.add_argument("--price", action="store_true", help="predict the time; the first of its kind runs for 10 s")
    check.set_defaults(command=_check)

    many = {
        "sweep": (_sweep, "run a case with the product of some parameters"),
        "study": (_study, "error against run time for the settings of a case"),
        "calibrate": (_calibrate, "fit parameters of a case to measured curves"),
    }
    for name, (command, what) in many.items():
        runs = commands.add_parser(name, parents=[common], help=what)
        runs.add_argument("case", type=Path, metavar="CASE.toml")
        runs.add_argument(
            "--out", type=Path, metavar="DIR", help=f"folder of the results (default: results/CASE_{name})"
        )
        runs.set_defaults(command=command)

    commands.choices["study"].add_argument(
        "--keep", action="store_true", help="keep the error of the case's own settings beside it, for solve to say"
    )

    show = commands.add_parser("show", parents=[common], help="draw pictures of a result")
    show.add_argument("folder", type=Path, metavar="DIR")
    show.set_defaults(command=_show)

    gallery = commands.add_parser("gallery", parents=[common], help="run and draw all cases of a folder")
    gallery.add_argument(
        "cases", type=Path, metavar="FOLDER", help="folder of cases, or its name in cases: element, ..."
    )
    gallery.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of the results (default: results/gallery/FOLDER)"
    )
    gallery.add_argument("--pictures", type=Path, metavar="DIR", help="folder that gets a copy of every picture")
    gallery.set_defaults(command=_gallery)

    again = commands.add_parser("replay", parents=[common], help="run again alone what failed in a run")
    again.add_argument("folder", type=Path, metavar="DIR", help="a result, or one of the folders in its replay/")
    again.set_defaults(command=_replay)

    verify = commands.add_parser("verify", parents=[common], help="run problems with known answers and compare")
    verify.add_argument("--only", action="append", default=[], metavar="NAME", help="a problem; may be given again")
    verify.add_argument("--json", action="store_true", help="print the rows as JSON")
    verify.set_defaults(command=_verify)
    _umat_commands(commands, common)

    extreme = commands.add_parser("stress", parents=[common], help="push stiff and extreme cases until they break")
    extreme.add_argument("--only", action="append", default=[], metavar="GROUP", help="a group; may be given again")
    extreme.add_argument("--json", action="store_true", help="print the rows as JSON")
    extreme.set_defaults(command=_stress)
    return parser
