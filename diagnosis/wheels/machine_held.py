"""Wheels that stand while the other wheels fall far behind their commands as well: what holds the machine may hold them.

A machine that pushes into a heap, or whose engine stalls, stops its wheels one after the other, and some of them spin before they do. By command and
speed alone that is a dead valve of every wheel that stood first. One that is dead leaves the other wheels driving, as far as they can.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.results.assessment import Finding
from diagnosis.results.limited import not_worth_a_check
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.inputs import WheelsData

_BEHIND = 0.5  # of its command: a wheel that makes less is held, or starts
_PART, _WITH_NEAR = (
    0.25,
    0.5,
)  # of a finding's time, in which most of the other wheels are, and as much in it and beside it
_NEAR, _NEAR_S = (
    0.5,
    5.0,
)  # of its length, and at most [s], before and after: wheels that one supply drives stand and spin in turn
_DRIVES = 0.1  # of the span: a command to drive
_RESTS = 0.1  # of the span: the finding's own wheel hardly moves, half of the time
_OTHERS = 2  # wheels beside this one
_HELD = (
    "The other {wheel}s fell far behind their commands at the same time: what holds the machine, such as a heap before it or an engine that stalls, "
    "may hold this {wheel} as well. The {position}, or a second speed, would tell."
)


def or_machine_held(data: WheelsData, found: Mapping[int, WheelFindings]) -> dict[int, WheelFindings]:
    """Findings of wheels that stand, less sure where most other wheels make little of their commands for a good part of their time.

    Only of wheels whose valve's position is not measured.

    Parameters
    ----------
    data : WheelsData
        Channels.
    found : Mapping[int, WheelFindings]
        By wheel.
    """
    return {
        i: wheel
        if data.measured[i] or data.y.shape[1] <= _OTHERS
        else replace(wheel, findings=[_less_sure(data, i, f, _sound(found, i, f)) for f in wheel.findings])
        for i, wheel in found.items()
    }


def _sound(found: Mapping[int, WheelFindings], i: int, f: Finding) -> list[int]:
    """Other wheels of which nothing like it is found meanwhile: one that has failed itself makes little of its command as well."""
    return [
        j
        for j, other in found.items()
        if j != i and not any(g.mode.total and g.start < f.stop and g.stop > f.start for g in other.findings)
    ]


def _less_sure(data: WheelsData, i: int, f: Finding, sound: Sequence[int]) -> Finding:
    if not f.mode.total or not _held(data, i, f, sound):
        return f
    return not_worth_a_check(f, _HELD)


def _held(data: WheelsData, i: int, f: Finding, sound: Sequence[int]) -> bool:
    """Whether wheel `i` stands through most of a finding while most `sound` wheels make little of what they are told for part of it, or just before or after."""
    if len(sound) < _OTHERS:
        return False
    own = np.abs(data.y[f.start : f.stop, i])
    own = own[np.isfinite(own)]
    if not own.size or float(np.median(own)) > _RESTS * data.span:
        return False
    near = min(round(_NEAR_S / data.dt), round(_NEAR * (f.stop - f.start)))
    part = slice(max(0, f.start - near), f.stop + near)
    speed, asked = np.abs(data.y[part]), np.abs(data.reference[part])
    others = np.isin(np.arange(speed.shape[1]), sound)
    with np.errstate(invalid="ignore"):
        told = (asked > _DRIVES * data.span) & np.isfinite(speed)
        behind = told & (speed < _BEHIND * asked)
    count = told[:, others].sum(axis=1)
    known = count >= _OTHERS
    most = known & (behind[:, others].sum(axis=1) > 0.5 * count)
    inside = slice(f.start - part.start, f.stop - part.start)
    meanwhile, driven = int(most[inside].sum()), int(known[inside].sum())
    return meanwhile >= _PART * max(1, driven) or int(most.sum()) >= _WITH_NEAR * (f.stop - f.start)
