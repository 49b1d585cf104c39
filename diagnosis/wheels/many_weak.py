"""Weak findings on most wheels at once are one machine that the wheel model does not fit, not several faults.

Parts fail one at a time, far more often than three of them within one mission. Where most wheels of a mission have findings that
leave it open whether their part is healthy, what they share is the better explanation: a plant of another kind than the models know. None
of them is named then, and none is called healthy. Two wheels that do the same at the same time share a cause likewise, where neither is certain.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from diagnosis.results.assessment import Finding
from diagnosis.wheels.findings import WheelFindings

_WHEELS = 3  # with weak findings, from which on the machine is the better explanation
_SHARE = 0.5  # of all wheels, that have them
_CERTAIN = 1  # wheel at most that has a certain finding, to which the others may respond
_SAME_TIME = 0.5  # of two findings that is common to both
_DOUBT = 0.05  # probability of a healthy part from which on a finding is weak


@dataclass(frozen=True)
class Doubted:
    """Findings without the weak ones of most wheels, and how many wheels had them; none where it was fewer."""

    found: dict[int, WheelFindings]
    wheels: int

    @property
    def sentence(self) -> str:
        """What speaks against the wheel model; empty where nothing does."""
        if not self.wheels:
            return ""
        return (
            f"{self.wheels} {{wheels}} deviate now and then from what the {{wheel}} model expects, each too little to name a fault; a "
            "model that does not fit this machine is more probable than several faults, so no {wheel} is blamed, and these times are not assessed."
        )


def without_many_weak(found: Mapping[int, WheelFindings]) -> Doubted:
    """Take out weak findings where most wheels have them; their time stays open, and unexplained.

    Parameters
    ----------
    found : Mapping[int, WheelFindings]
        What was found, by wheel.
    """
    weak = {i: [f for f in w.findings if _weak(f)] for i, w in found.items()}
    alike = {i: [f for f in fs if any(_alike(f, g) for j in weak if j != i for g in weak[j])] for i, fs in weak.items()}
    number = sum(bool(fs) for fs in weak.values())
    certain = sum(len(w.findings) > len(weak[i]) for i, w in found.items())
    if number < _WHEELS or number <= _SHARE * len(found) or certain > _CERTAIN:
        weak, number = alike, sum(bool(fs) for fs in alike.values())
        if not number or certain:
            return Doubted(dict(found), 0)
    out = {}
    for i, wheel in found.items():
        for f in weak[i]:
            for flags in (*wheel.opened.values(), *wheel.unexplained.values()):
                flags[f.start : f.stop] = True
        out[i] = replace(wheel, findings=[f for f in wheel.findings if not any(f is w for w in weak[i])])
    return Doubted(out, number)


def _alike(f: Finding, g: Finding) -> bool:
    """Whether two wheels have the same weak finding at the same time."""
    both = max(0, min(f.stop, g.stop) - max(f.start, g.start))
    return (f.side, f.mode) == (g.side, g.mode) and both >= _SAME_TIME * (max(f.stop, g.stop) - min(f.start, g.start))


def _weak(finding: Finding) -> bool:
    """Whether it is open that the part is healthy."""
    return sum(h.p for h in finding.hypotheses if h.mode == "healthy") >= _DOUBT
