"""What was left out of a mission is not damaged: it was read whole, and its signals are not used."""

from __future__ import annotations

import re
from collections.abc import Iterable

# As `replay.mission` and the audit word it; of a damaged log only chunks are "left out:" with a reason.
_FILE = re.compile(r"(?P<file>[^:]+?) was left out(?:: |, because nothing could be judged together with it)")
_CHUNK = re.compile(r"\bchunk at byte \d+$")


def is_left_out(text: str) -> bool:
    """Whether a sentence on a log's damage says no more than that a whole file was left out, and why."""
    found = _FILE.match(text)
    return found is not None and not _CHUNK.search(found["file"])


def only_left_out(texts: Iterable[str]) -> bool:
    """Whether all of them do; not where there are none."""
    found = list(texts)
    return bool(found) and all(map(is_left_out, found))
