"""What lies behind a drive that was measured twice: an all-clear says how little of a motor, a gear or a brake it has seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.decision.wording import join_words
from diagnosis.results.assessment import Assessment
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Tier
from diagnosis.results.wheel_model import WheelModelFit
from replay.faults import Side

_MOST = 0.9  # a larger loss is no figure to rely on


def behind_drives(
    assessments: Mapping[tuple[str, str], Assessment],
    axles: Sequence[str],
    checks: Sequence[Checked],
    model: WheelModelFit | None,
    words: MachineWords,
) -> tuple[str, ...]:
    """Sentence on what would show of a loss behind drives that do as they are told, by their own measurement; none where there are no such.

    The speed that such a drive gives is compared with the other wheels' alone, and the ground gives a wheel a share of it, which
    only a model of the wheels tells.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        Of all parts.
    axles : Sequence[str]
        Steering axles.
    checks : Sequence[Checked]
        Of the all-clear.
    model : WheelModelFit or None
        Of the wheels on the ground.
    words : MachineWords
        How to speak of the machine.
    """
    wheels = list(dict.fromkeys(c for c, _ in assessments if c not in axles))
    plants = () if model is None or not model.reliable else model.plants
    grip = {w: p.grip or 0.0 for w, p in zip(wheels, plants, strict=False) if p is not None}
    limits = {c.component: c.limit for c in checks if c.check is Check.LASTING_RESPONSE and c.worst is not None}
    measured = [w for w in wheels if (w, Side.ACTUATOR.value) in assessments]
    measured = [w for w in measured if assessments[w, Side.ACTUATOR.value].tier is Tier.DIRECT]
    if not measured:
        return ()
    shows = {w: -float(np.expm1(-limits[w])) * (1.0 + grip[w]) for w in measured if w in limits and w in grip}
    seen = {w: x for w, x in shows.items() if x < _MOST}
    behind = "gear, brake" if words.drive == "motor" else "motor, gear, brake"
    part = f"Behind {words.drive}s that do as they are told ({behind})"
    if not seen and len(wheels) == 1:
        return (f"Behind a {words.drive} that does as it is told ({behind}) a loss may not show in the speed.",)
    if not seen:
        return (words.fill(f"{part} a loss may not show in the speeds, least of all one that all {{wheels}} share."),)
    least = f"{part} a loss of one {{wheel}} over the whole mission shows from {100 * max(seen.values()):.0f} % on"
    hidden = [w for w in measured if w not in seen]
    told = f"{least}, at {join_words(hidden)} none" if hidden else least
    return (words.fill(f"{told}; one that all {{wheels}} share, only where they fall behind their commands."),)
