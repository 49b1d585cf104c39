"""Every plot of the report: which curves it shows, with title, unit, band, threshold and limits.

`fault_rows` are the linked plots of a fault, `course_rows` its small pictures that need no JavaScript, `loop_groups` the plots of
the loop replay, `diagnosis.report.evidence_rows` those of one side's evidence. A plot is changed there and in ``tests/diagnosis/report/test_plot_rows.py`` alone: the page draws rows, whatever
they hold. Angles are shown in degrees.
"""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.report.compared_channels import Pair, by_effort, by_valve, motion_of
from diagnosis.report.evidence_rows import probability_row, residual_row, side_rows
from diagnosis.report.rows import Columns, Group, Row, Trace
from diagnosis.report.units import EFFORT_UNIT, on_page
from diagnosis.results.document import IntervalRow
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Kind
from replay.faults import Side
from replay.machine.quantities import OPENING


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
    rows += [row for s in side.sides for row in side_rows(fault, s, columns, residual_unit, limit, words)]
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
