"""Numbers in sentences: some significant digits, no exponent, and the sign of minus that pages and terminal have."""

from __future__ import annotations

import re
from math import isfinite

_HYPHEN = re.compile(
    r"(?<![\w.,:;\[/\]})'\"-])-(?=\d+(?:[.,]\d+)*(?![\w/]|[.,-]\w))"
)  # before a number, and neither in or before a name or a date nor of a range


def plain(value: float, digits: int = 3) -> str:
    """A value in significant digits without an exponent: ``127``, ``0.0031``, ``−2``; below a millionth 0."""
    text = f"{value + 0.0:.{digits}g}"  # nothing has no sign
    if "e" not in text or not isfinite(value):
        return text.replace("-", "−")
    whole = f"{float(text):.6f}".rstrip("0").rstrip(".")
    return "0" if whole in ("-0", "") else whole.replace("-", "−")


def with_minus_signs(text: str) -> str:
    """A sentence whose hyphens before numbers are minus signs: ``read −0.6 m/s``."""
    return _HYPHEN.sub("−", text)
