"""Commands that help to write a case: a starter to change, the schema for an editor, completion for the shell."""

import argparse
from functools import partial
from pathlib import Path

from fabfem.output.atomic import write_atomic
from fabfem.starters import KINDS

SHELLS = ("bash", "zsh", "tcsh")


def add_commands(
    parser: argparse.ArgumentParser, commands: argparse._SubParsersAction, common: argparse.ArgumentParser
) -> None:
    """Add the commands to those of a parser."""
    new = commands.add_parser("new", parents=[common], help="write a commented case that runs, to be changed")
    new.add_argument("kind", choices=KINDS, metavar="KIND", help=", ".join(KINDS))
    new.add_argument("folder", type=Path, nargs="?", default=Path(), metavar="DIR", help="where (default: here)")
    new.set_defaults(command=_new)

    schema = commands.add_parser("schema", parents=[common], help="print the JSON Schema of a case, for editors")
    schema.add_argument("--out", type=Path, metavar="FILE", help="file to write instead")
    schema.set_defaults(command=_schema)

    completion = commands.add_parser("completion", parents=[common], help="print what completes commands in a shell")
    completion.add_argument("shell", choices=SHELLS, metavar="SHELL", help=", ".join(SHELLS))
    completion.set_defaults(command=partial(_completion, parser))


def _new(options: argparse.Namespace) -> int:
    from fabfem.starters import start

    files = start(options.kind, options.folder)
    if not options.quiet:
        print(*(f"  {file}" for file in files), f"run it: fabfem solve {files[0]}", sep="\n")
    return 0


def _schema(options: argparse.Namespace) -> int:
    from fabfem.case.json_schema import schema_text

    if options.out:
        write_atomic(options.out, schema_text())
    else:
        print(schema_text(), end="")
    return 0


def _completion(parser: argparse.ArgumentParser, options: argparse.Namespace) -> int:
    import shtab

    _complete_files(parser, {"DIR": shtab.DIRECTORY, "FOLDER": shtab.DIRECTORY}, shtab.FILE)
    print(shtab.complete(parser, shell=options.shell))
    return 0


def _complete_files(parser: argparse.ArgumentParser, folders: dict[str, object], file: object) -> None:
    """Let the arguments that are paths, also those of the commands, be completed by folders and files."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                _complete_files(command, folders, file)
        elif action.type is Path:
            action.complete = folders.get(str(action.metavar), file)  # type: ignore[attr-defined]
