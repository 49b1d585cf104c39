"""Usual kinds of machines."""

from __future__ import annotations

from enum import StrEnum


class Preset(StrEnum):
    """Usual kinds of machines."""

    DIFF_DRIVE = "diff-drive"
    SKID_4 = "skid-4"
    ACKERMANN = "ackermann"
    HAULOTTE = "haulotte"
