"""Ctrl-C that does not tear a result apart: it waits for the end of the increment, and of what is being written."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

WAITING = "interrupted: this increment is finished first; once more ends the run at once"


@contextmanager
def patient(say: Callable[[str], None]) -> Iterator[Callable[[], bool]]:
    """Let an interrupt (SIGINT) wait until it is asked for; a second one raises KeyboardInterrupt at once.

    Parameters
    ----------
    say : callable
        Shows a line of text when the first one arrives.

    Yields
    ------
    asked : callable
        Whether one has arrived.
    """
    arrived: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return

    def remember(number: int, frame: FrameType | None) -> None:
        if arrived:
            raise KeyboardInterrupt
        arrived.append(number)
        say(WAITING)

    before = signal.signal(signal.SIGINT, remember)
    try:
        yield lambda: bool(arrived)
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def held_back() -> Iterator[None]:
    """Hold back interrupts (SIGINT) that arrive inside, and hand them on at the end."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    arrived: list[int] = []

    def remember(number: int, frame: FrameType | None) -> None:
        arrived.append(number)

    before = signal.signal(signal.SIGINT, remember)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    for number in arrived:
        if callable(before):
            before(number, None)
