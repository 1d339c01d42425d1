"""Exit statuses, and how a command that cannot do its work says so."""

import sys

from fabfem.parallel.world import first

DONE, NO_PICTURE, RED, BAD_INPUT, STOPPED, INTERRUPTED = 0, 1, 1, 2, 3, 130


def fail(message: str, status: int) -> int:
    """Print a sentence to the standard error, from the first process alone, and return the status."""
    if first():
        print(f"fabfem: {message}", file=sys.stderr)
    return status
