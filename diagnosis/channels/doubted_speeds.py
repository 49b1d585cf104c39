"""Speeds of all wheels that are one factor off their second measurements: judged as if the factor were put right."""

from __future__ import annotations

from dataclasses import replace

from replay.signals.speed_doubts import SpeedDoubt
from replay.signals.timeline import Timeline


def rescaled(timeline: Timeline, doubt: SpeedDoubt | None) -> Timeline:
    """A timeline in which the doubted speeds are what they would be with the right scale; the same one without a doubt."""
    if doubt is None:
        return timeline
    more = {n: timeline.store.keep(timeline.signals[n] * doubt.factor) for n in doubt.names}
    return replace(timeline, signals={**timeline.signals, **more})
