"""Copies of a machine's log in the folder of another one: a recording is of one machine, and counts once.

It is of the machine in whose folder an audit saw it first. Where the audits saw all of them at about the same time nothing says
whose it is: it counts for the machine that has other logs too, else the first by name; and where it shows a fault also for the others,
for a fault that is left out would clear its machine.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from itertools import pairwise

from diagnosis.audit.fleet.owners import Owner, Owners
from diagnosis.audit.fleet.read import Mission

_APART_NS = 120 * 10**9  # without any result between two audits; less may be one of them at work

#: A mission, its machine, and when an audit first saw it [ns since 1970].
Seen = tuple[Mission, Owner, int | None]


def copies_elsewhere(
    missions: Sequence[Mission], first_seen: Callable[[str], int | None], folder: str
) -> dict[str, str]:
    """Names of missions that are copies of another machine's, with the name of that one's.

    Parameters
    ----------
    missions : Sequence[Mission]
        From `diagnosis.audit.fleet.read.read_missions`.
    first_seen : callable
        From `diagnosis.audit.fleet.first_seen.first_seen_times`.
    folder : str
        Folder of the store.
    """
    by_content: dict[str, list[Mission]] = defaultdict(list)
    for m in missions:
        if m.result is not None and m.result.judged:
            by_content[m.result.log_hash].append(m)
    shared = [
        group
        for group in by_content.values()
        if len({(m.result.machine_id, m.result.machine_name) for m in group if m.result}) > 1
    ]
    if not shared:
        return {}
    owners = Owners(missions, folder)
    made = sorted(t for m in missions if m.result is not None and (t := first_seen(m.name)) is not None)
    idle = [b for a, b in pairwise(made) if b - a > _APART_NS]  # where another audit begins
    alone = {owners.of(group[0])[0] for group in by_content.values() if len(group) == 1}
    out: dict[str, str] = {}
    for group in shared:
        seen = [(m, owner, first_seen(m.name)) for m in group if (owner := owners.of(m)[0]) is not None]
        out |= _copies(sorted(seen, key=lambda s: (s[1] not in alone, s[1], s[0].name)), idle)
    return out


def _copies(seen: Sequence[Seen], audits: Sequence[int]) -> dict[str, str]:
    """The copies of one content, of which that is the first whose machine has other logs."""
    if not seen:
        return {}
    times: dict[Owner, int] = {}
    for _, owner, when in seen:
        if when is not None:
            times[owner] = min(when, times.get(owner, when))
    ranked = sorted(times, key=lambda owner: times[owner])
    sure = (
        len(ranked) > 1 and len(times) == len({s[1] for s in seen}) and times[ranked[1]] - times[ranked[0]] > _APART_NS
    )
    own = ranked[0] if sure else seen[0][1]
    original = next(m for m, owner, _ in seen if owner == own)
    return {
        m.name: original.name
        for m, owner, _ in seen
        if owner != own and (sure or (m.result is not None and not m.result.faults))
    }
