"""Commands for compiled stress-point routines: check-umat and export-umat."""

import argparse
from pathlib import Path

from fabfem.commands.status import DONE, RED, fail


def add_commands(commands: argparse._SubParsersAction, common: argparse.ArgumentParser) -> None:
    """Add the commands to those of a parser."""
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
    processor = "processor: host, generic, x86-64-v2 … v4 (default: host)"
    export.add_argument("--cpu", default="host", metavar="NAME", help=processor)
    export.set_defaults(command=_export_umat)


def _check_umat(options: argparse.Namespace) -> int:
    from fabfem.routines import check_routine

    findings = check_routine(
        options.library, options.properties, options.state_variables, options.initial_state, options.components,
        options.stress, options.size,
    )  # fmt: skip
    if not options.quiet:
        print("\n".join(f"{finding.verdict:5} {finding.sentence}" for finding in findings))
    bad = sum(finding.verdict == "bad" for finding in findings)
    return fail(f"{options.library}: {bad} of {len(findings)} findings are bad", RED) if bad else DONE


def _export_umat(options: argparse.Namespace) -> int:
    from fabfem.routines import export

    lines = export(options.material, options.out, options.case, options.directions, options.units, options.cpu)
    if not options.quiet:
        print("\n".join(lines))
    return DONE
