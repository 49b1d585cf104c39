"""Channels of drives that are judged by their response."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.echo import repeats_its_command
from diagnosis.channels.liveness import alive
from diagnosis.evidence import SENSOR, MissionView
from diagnosis.response.direction import directed, without_direction
from diagnosis.response.steered import stretch_of, stretched

Array = NDArray[np.float64]

CELL_S = 0.05
_SIDEWAYS_S = 1.0
_SIDEWAYS = 0.2  # of the driving speed: even so little sets the wheels of a side apart
_NOT_SIDEWAYS = 2  # wheels
_LOST_S, _LOST_PERIODS = 1.0, 10.0  # of silence from which a channel is lost rather than late
_LIVES = 0.5  # of the samples to be expected meanwhile that others must bring


@dataclass(frozen=True)
class FollowerData:
    """One wheel.

    Attributes
    ----------
    y : Array, shape (n,)
        Measured speed [m/s]; NaN where not valid.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new sample.
    commands : Array, shape (cells, k)
        What its target is put together from: its own command, or those of the body; three of them where that also moves sideways.
    asked : Array, shape (n,)
        Its commanded speed [m/s].
    name : str
        Of its channel.
    rolled : Array or None, shape (n,)
        Speed by the position of its joint [m/s]; None where that is not logged.
    effort : Array or None, shape (n,)
        Torque, current or duty of its drive, in any unit; None where that is not logged.
    lost : tuple[tuple[int, int], ...]
        Steps [start, stop) in which nothing came of it, while what is recorded with it went on.
    stretch : Array or None, shape (n,)
        How much faster than the body it rolls [1], where it is the only drive and steers.
    undirected : bool
        Whether its channel tells no direction, so that `y` has that of its command.
    echo : bool
        Whether its channel repeats the command and measures nothing.
    unpowered : bool
        Whether the machine file says that it has no drive.
    share : Array or None, shape (n,)
        What its readings are of usual ones [1], where that is 1 only for a time; None where nothing shows such a change.
    joint_share : Array or None, shape (n,)
        What they are of its joint's position [1], likewise: where its loop believes the channel, the position is what changes.
    """

    y: Array
    fresh: NDArray[np.bool_]
    commands: Array
    asked: Array
    name: str
    rolled: Array | None = None
    effort: Array | None = None
    lost: tuple[tuple[int, int], ...] = ()
    stretch: Array | None = None
    undirected: bool = False
    echo: bool = False
    unpowered: bool = False
    share: Array | None = None
    joint_share: Array | None = None


def cell_of(dt: float) -> int:
    """Steps of a cell. `dt` is a step [s]."""
    return max(1, round(CELL_S / dt))


def cells(x: Array, width: int) -> Array:
    """Mean over cells of what is known, shape (cells,); NaN where nothing is."""
    number = -(-x.size // width)
    cut = np.full(number * width, np.nan)
    cut[: x.size] = x
    table = cut.reshape(number, width)
    known = np.isfinite(table)
    count = known.sum(axis=1)
    return np.asarray(np.where(count > 0, np.where(known, table, 0.0).sum(axis=1) / np.maximum(count, 1), np.nan))


def _moved_sideways(mission: MissionView) -> bool:
    """Whether a machine with rollers on its wheels was commanded to move sideways, be it slowly: two wheels cannot."""
    if len(mission.machine.wheels) <= _NOT_SIDEWAYS:
        return False
    asked = np.abs(np.nan_to_num(mission.values("cmd.lateral")))
    least = _SIDEWAYS * mission.machine.limits.driving_speed
    return bool(np.count_nonzero(asked > least) * mission.timeline.dt > _SIDEWAYS_S)


def followers(mission: MissionView) -> dict[str, FollowerData]:
    """Wheels whose sensor nothing has judged, by name."""
    timeline, machine = mission.timeline, mission.machine
    width = cell_of(timeline.dt)
    body: Array | None = None
    if mission.logged("cmd.v") and mission.logged("cmd.omega") and not machine.axles:
        sideways = ("cmd.lateral",) if _moved_sideways(mission) else ()
        body = np.column_stack([cells(mission.values(n), width) for n in ("cmd.v", "cmd.omega", *sideways)])
    out: dict[str, FollowerData] = {}
    rollers = _moved_sideways(mission)  # what is asked of a wheel says nothing of its direction then
    for w in machine.wheels:
        name, asked = f"wheel.{w}.v", mission.command(w)
        taken = mission.judged((w, SENSOR)) or mission.logged(f"wheel.{w}.v_true")
        if taken or not mission.logged(name):
            continue
        stretch, y = stretch_of(mission, w), mission.values(name)
        echo = repeats_its_command(y, timeline.fresh[name], asked, machine.limits, timeline.dt)
        asked = stretched(y, asked, stretch, machine.limits.driving_speed, timeline.dt)
        undirected = not rollers and without_direction(y, asked, machine.limits.driving_speed, timeline.dt)
        y = directed(y, asked, timeline.dt) if undirected else y
        own = mission.logged(f"wheel.{w}.v_ref") or body is None
        commands = cells(asked, width)[:, None] if own or body is None else body
        position = f"wheel.{w}.v_position"
        rolled = mission.values(position) if mission.logged(position) else None
        effort = mission.values(f"wheel.{w}.effort") if mission.logged(f"wheel.{w}.effort") else None
        out[w] = FollowerData(
            y,
            timeline.fresh[name],
            commands,
            asked,
            name,
            rolled,
            effort,
            _lost(mission, name),
            stretch,
            undirected,
            echo,
            w in machine.unpowered,
        )
    return out


def _lost(mission: MissionView, name: str) -> tuple[tuple[int, int], ...]:
    """Steps [start, stop) after its first sample in which a channel is silent for long beside others that are not."""
    timeline = mission.timeline
    seen = np.flatnonzero(timeline.fresh[name])
    if not seen.size:
        return ()
    edge = np.r_[seen, timeline.size]
    period = max(timeline.periods_ns[name], timeline.step_ns) * 1e-9
    lives = np.r_[0, np.cumsum(alive(timeline, mission.alive, name))]
    least = max(_LOST_S, _LOST_PERIODS * period)
    long = np.flatnonzero(np.diff(edge) * timeline.dt > least)
    came = lives[edge[long + 1]] - lives[edge[long] + 1]
    enough = came * period > _LIVES * np.diff(edge)[long] * timeline.dt
    return tuple((int(edge[k]) + 1, int(edge[k + 1])) for k in long[enough])
