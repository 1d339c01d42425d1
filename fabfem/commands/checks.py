"""Commands that ask whether the program is right: verify and stress."""

import argparse

from fabfem.commands.status import DONE, RED


def add_commands(commands: argparse._SubParsersAction, common: argparse.ArgumentParser) -> None:
    """Add the commands to those of a parser."""
    checks = {
        "verify": (_verify, "run problems with known answers and compare", "NAME", "a problem"),
        "stress": (_stress, "push stiff and extreme cases until they break", "GROUP", "a group"),
    }
    for name, (command, what, word, one) in checks.items():
        check = commands.add_parser(name, parents=[common], help=what)
        check.add_argument("--only", action="append", default=[], metavar=word, help=f"{one}; may be given again")
        check.add_argument("--json", action="store_true", help="print the rows as JSON")
        check.set_defaults(command=command)


def _verify(options: argparse.Namespace) -> int:
    from fabfem.verification.problems import chosen
    from fabfem.verification.report import verify

    return DONE if verify(chosen(options.only), options.json, options.quiet) else RED


def _stress(options: argparse.Namespace) -> int:
    from fabfem.extremes.report import chosen, stress

    return DONE if stress(chosen(options.only), options.json, options.quiet) else RED
