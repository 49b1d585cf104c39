"""Numbers in sentences: some significant digits, and no exponent."""

from __future__ import annotations

from math import isfinite


def plain(value: float, digits: int = 3) -> str:
    """A value in significant digits without an exponent: ``127``, ``0.0031``; below a millionth 0."""
    text = f"{value:.{digits}g}"
    if "e" not in text or not isfinite(value):
        return text
    whole = f"{float(text):.6f}".rstrip("0").rstrip(".")
    return "0" if whole in ("-0", "") else whole
