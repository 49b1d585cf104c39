"""One cause where many wheels are off: what explains all of them beats several faults at one time.

Wheels share a body. Where one of them drives astray, as a loop does around an encoder that is wrong, the others are braked, pushed or
dragged; and where all wheels but one stand still together the machine stands, whatever that one reads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.standstill import not_followed, stood_still, without_noise
from diagnosis.response.inputs import FollowerData
from diagnosis.response.machine import Judged
from diagnosis.response.models import LEAST_P
from diagnosis.response.nowhere import goes_nowhere
from diagnosis.response.rivals import jumped
from diagnosis.response.spells import Spell
from diagnosis.results.assessment import Finding
from diagnosis.results.clearing import after_s
from replay.faults import FaultMode

Flags = NDArray[np.bool_]

_LEAST_TOGETHER = 2  # wheels that stand still, beside one that seems not to
_OVERLAP = 0.5  # of what may be a consequence
_SOON_S = 0.5  # after a sensor reads again: what its loop has wound up shows at once
_AFTER_S, _LESS = (
    10.0,
    0.85,
)  # after another wheel's fault, and by how much what begins then is less sure to be one more


def standing(data: Mapping[str, FollowerData], driving_speed: float, dt: float) -> dict[str, Flags]:
    """Steps in which each wheel stands still as all others do, one of them perhaps excepted, although they are commanded; shape (n,) each.

    Parameters
    ----------
    data : Mapping[str, FollowerData]
        All drives.
    driving_speed : float
        Commanded speed from which a drive is driving [m/s].
    dt : float
        Step [s].
    """
    out = {w: np.zeros(d.y.size, np.bool_) for w, d in data.items()}
    seen = {w: without_noise(d.y, d.fresh, d.asked, driving_speed) for w, d in data.items()}
    groups = [list(data)] + [[o for o in data if o != w] for w in data if len(data) > _LEAST_TOGETHER]
    for group in groups:
        speeds, asked = [seen[w] for w in group], [data[w].asked for w in group]
        for start, stop in not_followed(speeds, asked, driving_speed, dt, [data[w].y for w in group]):
            for w in group:
                out[w][start:stop] = True
    if len(data) == _LEAST_TOGETHER:  # the other one has to show itself that it stands, whatever it reads
        for w, other in (tuple(data), tuple(data)[::-1]):
            for start, stop in stood_still([seen[w]], [data[w].asked], driving_speed, dt, [data[w].y]):
                if goes_nowhere(data[other], slice(start, stop), driving_speed, dt):
                    out[w][start:stop] = out[other][start:stop] = True
    return out


def consequence(spell: Spell, wheel: str, judged: Mapping[str, Judged]) -> bool:
    """Whether a deviation from command or peers may be what another wheel's evident fault does to the machine.

    Parameters
    ----------
    spell : Spell
        Of `wheel`.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    """
    if evident(spell, judged[wheel]):
        return False
    span = spell.start, spell.stop
    return any(
        o != wheel and evident(s, j) and overlaps((s.start, s.stop), span) for o, j in judged.items() for s in j.spells
    )


def unwinds(spell: Spell, wheel: str, judged: Mapping[str, Judged], block_s: float) -> bool:
    """Whether a speed is off its command just after its own sensor read nothing usable: the loop unwinds what it wound up against that.

    Parameters
    ----------
    spell : Spell
        Of `wheel`.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    block_s : float
        Length of a block [s].
    """
    if spell.own or not spell.unspecific:
        return False
    one, last = judged[wheel], spell.stop * block_s
    return any(
        s.mode.total
        and s.p >= LEAST_P
        and evident(s, one)
        and -1 <= spell.start - s.stop <= _SOON_S / block_s
        and last <= s.stop * block_s + after_s(s.start * block_s, s.stop * block_s)
        for s in one.spells
    )


def stands_with_all(spell: Spell, wheel: str, judged: Mapping[str, Judged], asked: Mapping[str, Flags]) -> bool:
    """Whether a speed is silent while all others stand still, too, although they are to move, or read one value all the time.

    Then the machine stands: a sensor that is held tells nothing of motion, nor does the only one that reads any while three and more are silent.

    Parameters
    ----------
    spell : Spell
        Of `wheel`.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    asked : Mapping[str, Flags], each of shape (b,)
        Blocks in which each is to move.
    """
    others = [w for w in judged if w != wheel]
    if spell.mode is not FaultMode.NO_SIGNAL or spell.own or not others:
        return False
    part = slice(spell.start, spell.stop)
    silent = [
        any(
            s.mode is FaultMode.NO_SIGNAL and overlaps((spell.start, spell.stop), (s.start, s.stop))
            for s in judged[w].spells
        )
        for w in others
    ]
    if sum(silent) >= max(_LEAST_TOGETHER, len(others) - 1):
        return True
    still = [
        ((j.wheel.blocks.zero == j.wheel.blocks.readings)[part] & asked[w][part]) | _stuck(j)[part]
        for w, j in judged.items()
    ]
    return bool(np.mean(np.logical_and.reduce(still)) > _OVERLAP)


def _stuck(one: Judged) -> Flags:
    """Blocks in which a wheel's reading is held, shape (b,)."""
    out = np.zeros(one.driving.size, np.bool_)
    for s in one.spells:
        if s.mode is FaultMode.STUCK:
            out[s.start : s.stop] = True
    return out


def less_sure(spell: Spell, wheel: str, judged: Mapping[str, Judged], block_s: float) -> Spell:
    """A spell that nothing in its own channel shows, less sure where it is beside another wheel's longer one, or begins soon after it.

    Wheels share a body: one that a loop drives astray holds the others back, or drags them along, also after it reads right again.

    Parameters
    ----------
    spell : Spell
        Of `wheel`.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    block_s : float
        Length of a block [s].
    """
    one = judged[wheel]
    if evident(spell, one) or jumped(one, spell):
        return spell
    soon = _AFTER_S / block_s
    length = spell.stop - spell.start
    before = any(
        (s.start < spell.start or s.stop - s.start > length) and s.start < spell.stop and spell.start < s.stop + soon
        for o, j in judged.items()
        if o != wheel
        for s in j.spells
        if s.p >= LEAST_P
    )
    return spell._replace(p=_LESS * spell.p) if before else spell


def without_consequences(
    drives: Sequence[Finding], wheel: str, judged: Mapping[str, Judged], width: int
) -> list[Finding]:
    """Faults of a drive while no other wheel is still, held or noisy, and no position contradicts its own speed.

    Readings and effort of such wheels confirm nothing, nor does what agrees with a reading that is wrong.

    Parameters
    ----------
    drives : Sequence[Finding]
        Of the drive of `wheel`.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    width : int
        Steps of a block.
    """
    others = [
        (s.start * width, s.stop * width)
        for o, j in judged.items()
        for s in j.spells
        if (s.own if o == wheel else evident(s, j) or s.mode is FaultMode.NO_SIGNAL)
    ]
    return [f for f in drives if not any(overlaps(span, (f.start, f.stop)) for span in others)]


def evident(spell: Spell, one: Judged) -> bool:
    """Whether the channel shows by itself that it is wrong, without any command or other wheel."""
    return (
        spell.own
        or spell.mode in (FaultMode.STUCK, FaultMode.NOISY)
        or (spell.mode is FaultMode.NO_SIGNAL and jumped(one, spell))
    )


def overlaps(cause: tuple[int, int], effect: tuple[int, int]) -> bool:
    """Whether a span covers so much of another one that this may be its consequence."""
    return min(cause[1], effect[1]) - max(cause[0], effect[0]) >= _OVERLAP * (effect[1] - effect[0])
