"""How far off zero a sensor that shows nothing may read: a constant reading beyond is a value that it is stuck at.

The tables of the paper, of sensors and of actuators alike, tell *stuck* from *no signal* by whether the saturation term is zero.
"""

from __future__ import annotations

#: Of the span: as far apart may two healthy instruments have their zero.
APART = 0.01


def zero_level(span: float, least: float) -> float:
    """Largest constant that is still zero of one sensor, half of what two of them may differ by.

    Parameters
    ----------
    span : float
        Largest plausible magnitude [unit of the reading].
    least : float
        Smallest saturation term that counts, which bounds it where readings far beyond made the span large [unit of the reading].

    Returns
    -------
    float
        In the unit of the reading.
    """
    return min(least, 0.5 * APART * span)
