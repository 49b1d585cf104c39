"""Sizes of faults as rows of the documents: ε̂ and saturation term with their bounds."""

from __future__ import annotations

from typing import TypedDict


class EpsilonRow(TypedDict):
    """Loss of effectiveness ε̂ with its 95 % bounds."""

    value: float
    low: float
    high: float


class SatRow(TypedDict):
    """Saturation term: mean with its 95 % bounds and root mean square, in `unit`."""

    mean: float
    rms: float
    low: float
    high: float
    unit: str
