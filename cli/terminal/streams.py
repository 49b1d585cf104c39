"""Text that is safe to print, and a console for a stream."""

from __future__ import annotations

import os
import re
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

# C0 and C1 controls, bidirectional overrides, zero-width marks, lone surrogates of undecodable file names.
_HIDDEN = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u2069\ufeff\ud800-\udfff]+")
_PIPE_WIDTH = 120


def clean(text: object) -> str:
    """One line of text that cannot steer the terminal: runs of control and direction marks become one space."""
    return _HIDDEN.sub(" ", str(text))


def console_of(stream: IO[str]) -> Console:
    """Console of rich on a stream, without markup, as wide as a page where it is no terminal."""
    from rich.console import Console

    width = None if stream.isatty() or "COLUMNS" in os.environ else _PIPE_WIDTH
    return Console(file=stream, width=width, highlight=False, markup=False, emoji=False)
