"""What a reader should know of a log beside its verdict: what was named and not found, what is text, what was cut off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.decision.gyro_at_rest import offset_at_rest
from replay.machine.config import Machine
from replay.mission import Mission
from replay.readers.tables.table_log import TEXT_LEFT_OUT
from replay.signals.like_wheels import kind_of
from replay.signals.timeline import Timeline

_EMPTY_S = 1.0  # without any wheel speed


def more_caveats(mission: Mission, first_ns: int, machine: Machine) -> list[str]:
    """What the reader should know beside the verdict: parts of a mission, signals that were named and not found."""
    out = []
    if mission.open_loop:
        out.append(
            "Faults were injected into this recording. Its controller did not react to them, so evidence from the closed "
            "loop and from controller consistency is not used."
        )
    empty = without_speed(mission.timeline, machine)
    if empty > _EMPTY_S:
        out.append(f"No speed of any {machine.part} was recorded for {empty:.1f} s. That time is not assessed.")
    absent = [name for name in machine.signals if name not in mission.signals.items]
    if absent:
        reason = mission.signals.missing.get(absent[0], "")
        commands = any(name.startswith("cmd.") or name.endswith((".v_ref", ".phi_ref", ".u")) for name in absent)
        out.append(
            f"Named in the machine file but not found in the log: {', '.join(_alike(absent))}"
            + (f" ({reason})" if reason else "")
            + "."
            + (
                " Without its command nothing tells whether a part does what it is asked to. If it was recorded under another name "
                "(`mfhca channels LOG --all`), correct [signals]; else record it."
                if commands
                else ""
            )
        )
    if texts := _texts(mission):
        out.append(
            f"{TEXT_LEFT_OUT.capitalize()} that are called like signals: {', '.join(texts)}. Export them as numbers."
        )
    if offset := offset_at_rest(mission.timeline, machine):
        out.append(offset)
    stand = {n: s for n, s in mission.timeline.stands.items() if mission.signals.items[n].origin.on_change}
    if stand:
        most = max(stand, key=stand.__getitem__)
        out.append(
            f"Commands that are published on change, as the machine file says, count until the next one, here for up to {stand[most]:.1f} s "
            f"({most}). One whose sender fell silent looks the same, unless those of the other wheels go on."
        )
    if machine.questions:
        out.append(
            f"The machine file still asks: {' '.join(q[:1].upper() + q[1:] for q in machine.questions)} Answer there, and delete the lines marked QUESTION."
        )
    cut = (mission.timeline.start_ns - first_ns) * 1e-9
    if cut > mission.timeline.dt:
        out.append(f"Only a part of the mission was judged; times count from its start, {cut:.3f} s into the log.")
    return out


def _texts(mission: Mission) -> list[str]:
    """Columns of text that were left out, and are called like what a signal is taken from."""
    kinds = {kind for s in mission.signals.items.values() if (kind := kind_of(s.origin.label))}
    notes = [note for f in mission.files for note in f.summary.notes if f"{TEXT_LEFT_OUT}: " in note]
    return [n for note in notes for n in note.partition(f"{TEXT_LEFT_OUT}: ")[2].split(", ") if kind_of(n) in kinds]


def _alike(names: Sequence[str]) -> list[str]:
    """Names of signals, those of several parts in one: ``wheel.{FR,FL}.v_true``."""
    groups: dict[tuple[str, str], list[str]] = {}
    for name in names:
        group, _, rest = name.partition(".")
        part, _, leaf = rest.rpartition(".")
        groups.setdefault((group, leaf), []).append(part)
    return [
        ".".join(x for x in (group, parts[0] if len(parts) == 1 else f"{{{','.join(parts)}}}", leaf) if x)
        for (group, leaf), parts in groups.items()
    ]


def without_speed(timeline: Timeline, machine: Machine) -> float:
    """Time in which no wheel speed is valid [s]; `timeline` and `machine` as of the mission."""
    names = [f"wheel.{w}.{x}" for w in machine.wheels for x in ("v", "v_true")]
    speeds = [timeline.signals[n] for n in names if n in timeline.signals]
    if not speeds:
        return 0.0
    return sum(_without_any([v[part] for v in speeds]) for part in timeline.blocks()) * timeline.dt


def _without_any(values: Sequence[NDArray[np.float64]]) -> int:
    """How many samples none of several columns has."""
    missing = ~np.isfinite(values[0])
    for more in values[1:]:
        if not missing.any():
            return 0
        missing &= ~np.isfinite(more)
    return int(np.count_nonzero(missing))
