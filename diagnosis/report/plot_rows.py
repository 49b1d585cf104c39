"""Every plot of the report: which curves it shows, with title, unit, band, threshold and limits.

`fault_rows` are the linked plots of a fault, `course_rows` its small pictures that need no JavaScript, `loop_groups` the plots of
the loop replay. A plot is changed here and in ``tests/diagnosis/report/test_plot_rows.py`` alone: the page draws rows, whatever
they hold. Angles are shown in degrees.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.report.compared_channels import Pair, by_effort, by_valve, motion_of
from diagnosis.report.rows import Columns, Group, Row, Trace
from diagnosis.report.units import EFFORT_UNIT, natural_unit, on_page
from diagnosis.results.document import IntervalRow
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Kind
from replay.faults import DECIDED, Side, State
from replay.machine.quantities import OPENING

_FINEST = 500  # stretches of a mission that are told apart
_LIKELY = 0.5  # more probable than not
_TINTED_S = 0.5  # at the edges of faults it is briefly so


def fault_rows(
    fault: IntervalRow, peers: Sequence[str], columns: Columns, words: MachineWords, limit: float | None = None
) -> tuple[Row, ...]:
    """Rows of the linked plots of one fault.

    Parameters
    ----------
    fault : IntervalRow
        One of the report's intervals.
    peers : Sequence[str]
        Components of the same kind, the faulty one included.
    columns : Columns
        Columns with those of `diagnosis.report.rows.derived`.
    words : MachineWords
        How to speak of the machine.
    limit : float or None
        Probability from which a fault is stated.
    """
    c, kind, side = fault["component"], fault["kind"], Side(fault["side"])
    motion = motion_of(c, kind, columns, words)
    valve_read = by_valve(fault, columns)
    expected = f"evidence.{c}.{side.sides[0]}.expected"
    speed_or_angle = Row(
        "v",
        motion.title,
        motion.unit,
        (
            Trace(motion.commanded, "commanded", "commanded", motion.scale),
            Trace(motion.second, "second measurement", "reference", motion.scale),
            *(() if valve_read else (Trace(expected, "expected", "expected", motion.scale),)),
            Trace(motion.measured, "measured", "measured", motion.scale),
        ),
    )
    unit, scale = on_page(OPENING, words)
    valve = Row(
        "u",
        f"{words.drive.capitalize()} command",
        unit,
        (
            Trace(f"{kind}.{c}.u", "recorded", "measured", scale),
            *((Trace(f"replay.{c}.u", "replayed", "replayed", scale),) if f"{kind}.{c}.u" in columns else ()),
            Trace(f"{kind}.{c}.u_applied", "applied", "applied", scale),
            *((Trace(expected, "expected", "expected", scale),) if valve_read else ()),
        ),
    )
    residual_unit = (unit, scale) if valve_read else (motion.unit, motion.scale)
    rows = [speed_or_angle]
    rows += _effort_row(c, peers, columns) if by_effort(fault, columns) else []
    rows += [valve] if side == Side.ACTUATOR else []
    rows += [row for s in side.sides for row in _side_rows(fault, s, columns, residual_unit, limit, words)]
    commanded = f"{kind}.{c}.u" in columns  # else the law's own command and Ψ̂ are compared with nothing
    rows += [psi_row(c, columns)] if kind == Kind.WHEEL and commanded and has_psi(c, columns) else []
    rows += [valve] if side != Side.ACTUATOR else []
    rows += _peer_row(c, kind, peers, columns, words)
    return tuple(r for row in rows for r in row.shown(columns))


def course_rows(fault: IntervalRow, pair: Pair, columns: Columns, limit: float | None) -> tuple[Row, ...]:
    """Rows of the small pictures of one fault: channel and reference, residual, probability that it deviates.

    Parameters
    ----------
    fault : IntervalRow
        One of the report's intervals.
    pair : Pair
        Its channel and reference.
    columns : Columns
        Columns by name.
    limit : float or None
        Probability from which a fault is stated.
    """
    reference = () if pair.reference is None else (Trace(pair.reference, pair.words, "reference", pair.scale),)
    rows = (
        Row("v", pair.title, pair.unit, (*reference, Trace(pair.measured, "measured", "measured", pair.scale))),
        residual_row(pair.evidence, pair.unit, pair.scale),
        probability_row(pair.evidence, limit, columns, limits=(-0.04, 1.04)),
    )
    return tuple(r for row in rows for r in row.shown(columns))


def residual_row(base: str, unit: str, scale: float, of: str = "") -> Row:
    """Residual within ± its threshold, of the evidence columns that begin with `base`.

    `scale` takes SI to the shown unit [1].
    """
    return Row(
        f"residual{of}",
        f"Residual{of}",
        unit,
        (Trace(base + "residual", "residual", "measured", scale),),
        threshold=base + "threshold",
        band_scale=scale,
    )


def probability_row(
    base: str, limit: float | None, columns: Columns, of: str = "", limits: tuple[float, float] = (-0.03, 1.03)
) -> Row:
    """Probability that a side deviates, also by less than counts as a fault, and the limit from which a fault is stated.

    Limits are probabilities [1].
    """
    return Row(
        f"probability{of}",
        f"Probability that it deviates{of}",
        "1",
        (Trace(base + "probability", "at all, also by less than counts as a fault", "measured"),),
        level=limit,
        limits=limits,
        unknown=unknown_stretches(base + "probability", columns),
        small=small_stretches(base, columns),
    )


def unknown_stretches(column: str, columns: Columns) -> tuple[tuple[float, float], ...]:
    """First and last time [s] of the stretches in which a column has no value; those that nearly touch are one."""
    return _stretches(columns["t"], ~np.isfinite(columns[column])) if {column, "t"} <= columns.keys() else ()


def small_stretches(base: str, columns: Columns) -> tuple[tuple[float, float], ...]:
    """Stretches [s] in which a part deviates more probably than not, by so little that it was called healthy."""
    names = (base + "probability", base + "epsilon")
    if not {*names, "t"} <= columns.keys():
        return ()
    found = _stretches(columns["t"], (columns[names[0]] > _LIKELY) & (columns[names[1]] == 0.0))
    return tuple((start, stop) for start, stop in found if stop - start >= _TINTED_S)


def _stretches(times: NDArray[np.floating], flags: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """First and last time [s] of the stretches in which flags of shape (n,) are set; those that nearly touch are one."""
    t = np.asarray(times, np.float64)
    cut = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    step = float(t[-1] - t[0]) / max(1, t.size - 1)
    apart, out = max(step, float(t[-1] - t[0]) / _FINEST), list[tuple[float, float]]()
    for a, b in zip(cut[::2], cut[1::2], strict=True):
        start, stop = float(t[a]), float(t[b - 1]) + step
        if out and start - out[-1][1] <= apart:
            out[-1] = out[-1][0], stop
        else:
            out.append((start, stop))
    return tuple((round(a, 4), round(b, 4)) for a, b in out)


def _side_rows(
    fault: IntervalRow,
    side: Side,
    columns: Columns,
    residual_unit: tuple[str, float],
    limit: float | None,
    words: MachineWords,
) -> list[Row]:
    """Residual, probability that the side deviates, ε̂, saturation term and mode probabilities of one side."""
    base = f"evidence.{fault['component']}.{side}."
    of = f" ({side})" if fault["side"] == Side.SENSOR_OR_ACTUATOR else ""
    sat_unit, sat_scale = on_page(natural_unit(Kind(fault["kind"]), side, words), words)
    return [
        residual_row(base, *residual_unit, of),
        probability_row(base, limit, columns, of),
        Row(
            f"epsilon{of}",
            f"Loss of effectiveness ε̂{of}",
            "1",
            (Trace(base + "epsilon", "of the fault as stated, 95 % band; 0 where healthy", "measured"),),
            band=(base + "epsilon_low", base + "epsilon_high"),
            clip=(_lowest(columns.get(base + "epsilon")), 2.0),
            unknown=unknown_stretches(base + "epsilon", columns),
            steps=True,
        ),
        Row(
            f"sat{of}",
            f"Saturation term sat{of}",
            sat_unit,
            (Trace(base + "sat", "mean of the fault as stated, 95 % band", "measured", sat_scale),),
            band=(base + "sat_low", base + "sat_high"),
            band_scale=sat_scale,
            steps=True,
        ),
        *_mode_row(fault, side, base, of, columns, words),
    ]


def _lowest(epsilon: NDArray[np.floating] | None) -> float:
    """Where the axis of ε̂ ends: low enough for every loss that is stated; a part that gives more than it should has a negative one [1]."""
    known = np.empty(0) if epsilon is None else epsilon[np.isfinite(epsilon)]
    return min(-1.0, 1.1 * float(known.min(initial=0.0)))


def _mode_row(fault: IntervalRow, side: Side, base: str, of: str, columns: Columns, words: MachineWords) -> list[Row]:
    """Mode probabilities of one side; only once, and of both, where the evidence does not tell the sides apart.

    That a side is healthy does not say that nothing is faulty where the other side may be: its curve says so.
    """
    both = any(h["side"] == Side.SENSOR_OR_ACTUATOR for h in fault["hypotheses"])
    if both and side is Side.ACTUATOR:
        return []
    other = Side.ACTUATOR if side is Side.SENSOR else Side.SENSOR
    elsewhere = any(h["side"] == other and h["mode"] != State.HEALTHY for h in fault["hypotheses"])
    healthy = state_label(State.HEALTHY, side).lower()
    if elsewhere:
        own, rest = (words.part_name(fault["kind"], s) for s in (side, other))
        healthy = f"{own} healthy: {rest} faulty, or neither"
    whole = ", of the fault as a whole" if _as_a_whole(base, columns) else ""
    return [
        Row(
            f"modes{of}",
            f"Mode probability{whole}{' (of either part)' if both else of}",
            "1",
            tuple(
                Trace(f"{base}p_{m}", healthy if m is State.HEALTHY else state_label(m, side).lower(), f"mode-{m}")
                for m in DECIDED
            ),
            limits=(-0.03, 1.03),
            steps=bool(whole),
        )
    ]


def _as_a_whole(base: str, columns: Columns) -> bool:
    """Whether the rows were weighed by whole faults: outside of them their probabilities are not known."""
    column = columns.get(base + "p_healthy")
    return column is not None and not bool(np.isfinite(column).all())


def has_psi(c: str, columns: Columns) -> bool:
    """Whether there is any Ψ̂ of a wheel: not with another controller than the paper's."""
    return any(n in columns for n in (f"replay.{c}.psi_printed", f"replay.{c}.psi_implied", f"wheel.{c}.psi"))


def psi_row(c: str, columns: Columns, component: str = "") -> Row:
    """Ψ̂ of the printed law, as the recorded command implies it and as recorded, with ρ on the right."""
    return Row(
        "psi",
        f"Ψ̂ {c}",
        "1",
        (
            Trace(f"replay.{c}.psi_printed", "printed law", "replayed"),
            Trace(f"replay.{c}.psi_implied", "implied by the recorded command", "measured"),
            Trace(f"wheel.{c}.psi", "recorded", "reference"),
            Trace(f"replay.{c}.rho", "ρ (right axis)", "right", right=True),
        ),
        right=("ρ", "1/s") if f"replay.{c}.rho" in columns else None,
        component=component,
    )


def _effort_row(c: str, peers: Sequence[str], columns: Columns) -> list[Row]:
    """Effort of the drive and of the others."""
    others = (Trace(f"wheel.{p}.effort", p, "peer") for p in peers if p != c)
    return [Row("effort", "Effort", EFFORT_UNIT, (*others, Trace(f"wheel.{c}.effort", c, "measured")))]


def _peer_row(c: str, kind: Kind, peers: Sequence[str], columns: Columns, words: MachineWords) -> list[Row]:
    """The same channel of the other components, where one of them has it."""
    motion = motion_of(c, kind, columns, words)
    channels = [(p, motion_of(p, kind, columns, words).measured) for p in peers if p != c]
    if not any(name in columns for _, name in channels):
        return []
    traces = [Trace(name, p, "peer", motion.scale) for p, name in channels]
    title = "Other axles" if kind == Kind.STEER else f"Other {words.parts}"
    own = Trace(motion.measured, c, "measured", motion.scale)
    return [Row("peers", title, motion.unit, (*traces, own))]


def loop_groups(
    wheels: Sequence[str], axles: Sequence[str], columns: Columns, words: MachineWords
) -> tuple[Group, ...]:
    """Rows of the loop replay over the whole mission, as in the paper's figures; groups without data are left out."""
    groups = {
        ("speed", f"{words.part.capitalize()} speeds"): [_loop_motion(w, Kind.WHEEL, columns, words) for w in wheels],
        ("drive", f"{words.part_name(Kind.WHEEL, Side.ACTUATOR).capitalize()}s u_a"): [
            _loop_valve(w, Kind.WHEEL, words) for w in wheels
        ],
        ("steering", "Steering φ and u_s"): [
            row
            for a in axles
            for row in (_loop_motion(a, Kind.STEER, columns, words), _loop_valve(a, Kind.STEER, words))
        ],
        ("psi", "Ψ̂ printed and implied"): [psi_row(w, columns, component=w) for w in wheels if has_psi(w, columns)],
    }
    found = [(key, tuple(r for row in rows for r in row.shown(columns))) for key, rows in groups.items()]
    return tuple(Group(*key, rows) for key, rows in found if rows)


def _loop_motion(c: str, kind: Kind, columns: Columns, words: MachineWords) -> Row:
    motion = motion_of(c, kind, columns, words)
    key, title, measured, commanded = ("phi", "φ", "φ", "φ_c") if kind == Kind.STEER else ("v", "Speed", "v", "v_ref")
    traces = (
        Trace(motion.measured, f"{measured} measured", "measured", motion.scale),
        Trace(motion.commanded, commanded, "commanded", motion.scale),
    )
    return Row(key, f"{title} {c}", motion.unit, traces, component=c)


def _loop_valve(c: str, kind: Kind, words: MachineWords) -> Row:
    unit, scale = on_page(OPENING, words)
    traces = (
        Trace(f"{kind}.{c}.u", "recorded", "measured", scale),
        Trace(f"replay.{c}.u", "replayed", "replayed", scale),
    )
    return Row("u", f"{'u_s' if kind == Kind.STEER else 'u_a'} {c}", unit, traces, component=c)
