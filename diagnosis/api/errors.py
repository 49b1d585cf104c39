"""Every error of the Python interface is one of the project's own, with the sentence that the terminal would show."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from replay.errors import LogError, OutputError

P = ParamSpec("P")
R = TypeVar("R")


def stated(function: Callable[P, R]) -> Callable[P, R]:
    """Let a function raise what the system says of a file as a stated error.

    Raises
    ------
    LogError
        Where the system names a file that cannot be read or written.
    OutputError
        Where it names none, as on a full disk.
    """

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return function(*args, **kwargs)
        except OSError as error:
            reason = "no such file" if isinstance(error, FileNotFoundError) else (error.strerror or str(error))
            if error.filename is None:
                raise OutputError(f"cannot write or read: {reason}") from error
            raise LogError(f"{error.filename}: {reason}") from error

    return call
