"""Which arrays of text name the elements of the arrays beside them."""

from __future__ import annotations

import re

_KEYS = re.compile(r"(^|_)(names?|joints?|labels?|symbols?|keys?)$|Names?$|Symbols?$", re.ASCII)


def is_key_list(label: str) -> bool:
    """Whether a field of this name, an array of text, names elements: ``name``, ``joint_names``, ``varNames``."""
    return _KEYS.search(label) is not None
