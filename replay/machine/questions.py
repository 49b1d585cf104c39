"""Questions that `mfhca config init` wrote into a machine file, and that still stand in it."""

from __future__ import annotations

import re
from pathlib import Path

#: How the comment of a question begins.
QUESTION = "QUESTION: "

_ASKED = re.compile(rf"^# {QUESTION}((?:[^?\n]|\n# )+\?)", re.MULTILINE)


def questions_of(text: str) -> tuple[str, ...]:
    """What the text of a machine file asks, without what follows each question mark."""
    return tuple(" ".join(found.replace("\n# ", " ").split()) for found in _ASKED.findall(text))


def open_questions(file: Path) -> int:
    """How many questions of a machine file nobody has answered yet, by removing them; 0 where it cannot be read.

    Parameters
    ----------
    file : Path
        Machine file.
    """
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return 0
    return sum(line.startswith(f"# {QUESTION}") for line in lines)
