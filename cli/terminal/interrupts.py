"""Being asked to end, by Ctrl-C or SIGTERM, is not forgotten where compiled code swallows the exception of it."""

from __future__ import annotations

import signal
import sys
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

_asked = False


def listen() -> None:
    """Raise KeyboardInterrupt on Ctrl-C, unless the caller ignores it (as a shell's background job), and on SIGTERM."""
    forget()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)
    signal.signal(signal.SIGTERM, _interrupt)
    sys.unraisablehook = _unraisable


def check() -> None:
    """Raise KeyboardInterrupt where this was asked for before and did not get here.

    Raises
    ------
    KeyboardInterrupt
        At every call from then on.
    """
    if _asked:
        raise KeyboardInterrupt


def asked() -> bool:
    """Whether this run was asked to end."""
    return _asked


def forget() -> None:
    """Begin anew."""
    global _asked
    _asked = False


def _interrupt(number: int, frame: FrameType | None) -> None:
    global _asked
    _asked = True
    raise KeyboardInterrupt


def _unraisable(problem: UnraisableHookArgs) -> None:
    """An interrupt in a callback of compiled code has nowhere to go: `check` raises it again."""
    if not isinstance(problem.exc_value, KeyboardInterrupt):
        sys.__unraisablehook__(problem)
