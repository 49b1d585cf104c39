"""Numbers as sentences have them: with the sign of minus, which no hyphen of a name or a date is."""

from __future__ import annotations


def told(value: float, form: str) -> str:
    """A number in a format such as ``+.3f``: ``−0.125``.

    Parameters
    ----------
    value : float
        The number, in the unit that the sentence gives.
    form : str
        As behind the colon of a format string.
    """
    return format(value, form).replace("-", "−")
