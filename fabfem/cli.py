"""The ``fabfem`` command.

Exit status: 0 done, 1 the pictures could not be drawn, an answer of the verification or of an extreme is wrong, a
replay ends otherwise or a UMAT breaks its contract, 2 bad input or a folder that takes no results, 3 a run that could
not go on or not write its results (all that converged is kept), 130 interrupted. Nothing heavy is imported before a
command needs it.
"""

import argparse
import atexit
import gc
import os
import sys
import warnings
from collections.abc import Sequence

from fabfem import __version__
from fabfem.commands import authoring, checks, keys, routines, runs, studies
from fabfem.commands.status import BAD_INPUT, DONE, INTERRUPTED, STOPPED, fail
from fabfem.parallel.world import ended_together, launched


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after the command; those of the process by default.
    """
    words = sys.argv[1:] if arguments is None else list(arguments)
    if not words:
        parser().print_help()
        return BAD_INPUT
    options = parser().parse_args(words)
    gc.set_threshold(50_000, 20, 50)  # most objects of a command stay: looking through them is a tenth of a short run
    atexit.register(gc.freeze)  # and the interpreter need not look through them once more before it leaves
    try:
        with warnings.catch_warnings(), ended_together(options.debug):
            if not options.debug:  # numbers out of all proportion overflow; what is not finite is refused with a reason
                warnings.filterwarnings("ignore", category=RuntimeWarning, module="numpy|scipy")
            if launched() and not options.shared:
                return fail("several processes share 'solve' and 'check', no other command", BAD_INPUT)
            return options.command(options)
        return DONE  # a process that others left nothing to do
    except KeyboardInterrupt:
        return fail("interrupted before the first increment", INTERRUPTED)
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
        return fail(str(error), BAD_INPUT)
    if isinstance(error, OSError):
        return fail(f"{error.filename or 'a file'}: {error.strerror or error}", BAD_INPUT)
    return fail(f"this is a fault of the program ({type(error).__name__}: {error}); --debug shows where", STOPPED)


def parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    whole = argparse.ArgumentParser(
        prog="fabfem", description="Boundary-value problems in granular soil with an evolving fabric."
    )
    whole.add_argument("--version", action="version", version=f"fabfem {__version__}")
    whole.set_defaults(shared=False)
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--quiet", action="store_true", help="print nothing but errors")
    common.add_argument("--debug", action="store_true", help="show the traceback of an error")
    commands = whole.add_subparsers(title="commands", required=True, metavar="COMMAND")
    authoring.add_commands(whole, commands, common)
    for group in (keys, runs, studies, checks, routines):
        group.add_commands(commands, common)
    return whole
