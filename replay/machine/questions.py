"""Questions that `mfhca config init` wrote into a machine file, and that still stand in it."""

from __future__ import annotations

import re

_QUESTION = re.compile(r"^# QUESTION: ((?:[^?\n]|\n# )+\?)", re.MULTILINE)


def questions_of(text: str) -> tuple[str, ...]:
    """What the text of a machine file asks, without what follows each question mark."""
    return tuple(" ".join(found.replace("\n# ", " ").split()) for found in _QUESTION.findall(text))
