"""Ranges of recorded values, as text."""

_ROUNDING = 1e-9  # share of the larger end that is rounding of the arithmetic, not of a sensor


def range_text(low: float, high: float, digits: int) -> str:
    """Smallest and largest value in their unit, with so many digits; what is rounding beside the other end is 0.

    Parameters
    ----------
    low, high : float
        Both ends, in one unit.
    digits : int
        Significant digits.
    """
    least = _ROUNDING * max(abs(low), abs(high))
    return " … ".join(f"{0.0 if abs(end) < least else end:.{digits}g}" for end in (low, high))
