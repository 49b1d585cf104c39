"""Sentences about a fleet, for page, document and terminal."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.audit.fleet_machines import VERDICTS, FleetFault, Machine
from diagnosis.audit.fleet_trends import Axis, PartTrend
from diagnosis.audit.trend import Forecast
from diagnosis.wording import MODE_WORDS, join_words, part_words

_SHOWN = 3
_UNITS = {"hours": "h of driving", "days": "days"}
_TAGS = {
    "stop": "stop and repair",
    "watch": "ready, with faults to watch",
    "not_assessed": "not assessed",
    "ready": "ready",
}


def count(n: int, word: str) -> str:
    """Number and word, the word in the plural where it is not one."""
    return f"{n} {word}{'' if n == 1 else 's'}"


def round_to(value: float, digits: int = 2) -> str:
    """Few significant digits without an exponent."""
    text = f"{float(f'{value:.{digits}g}'):f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def fault_words(f: FleetFault) -> str:
    """Part and row: ``RL drive valve inefficient``."""
    words = MODE_WORDS["actuator" if f.side == "actuator" else "sensor"].get(f.mode, f.mode)
    return f"{part_words(f.kind, f.component, f.side)} {words}"


def forecast_words(f: Forecast, limit: float, axis: Axis = "hours") -> str:
    """When a limit is reached, in one phrase."""
    unit = _UNITS[axis]
    if f.state == "not_known":
        return f"not known: {f.why}"
    if f.state == "above":
        return f"already at {round_to(limit)}"
    if f.state == "not_within" or f.soonest is None:
        return f"does not reach {round_to(limit)} within {round_to(f.horizon)} {unit}"
    if f.latest is None:
        begin = f"in {round_to(f.soonest)} {unit} at the soonest" if f.soonest > 0 else "at any time"
        likely = f", likely in {round_to(f.likely)}" if f.likely is not None else ""
        return f"may reach {round_to(limit)} {begin}{likely}; latest not known"
    return f"reaches {round_to(limit)} in {round_to(f.soonest)} to {round_to(f.latest)} {unit} (90 %)"


def headline(machines: Sequence[Machine]) -> tuple[str, str, str]:
    """Status of the fleet, a few words above its sentence, and the sentence."""
    verdicts = [m.verdict for m in machines]
    status = min(verdicts, key=VERDICTS.index, default="not_assessed")
    n, work = len(machines), sum(v in ("stop", "watch") for v in verdicts)
    open_ = verdicts.count("not_assessed")
    if not n:
        return "not_assessed", "nothing judged", "No mission could be judged"
    tag = f"{count(verdicts.count(status), 'machine')}: {_TAGS[status]}"
    if work and n == 1:
        title = "The machine needs work"
    elif work:
        title = f"{work} of {count(n, 'machine')} {'needs' if work == 1 else 'need'} work"
    elif open_ == n:
        title = "The machine could not be assessed" if n == 1 else f"None of {n} machines could be assessed"
    elif open_:
        title = f"{n - open_} of {count(n, 'machine')} {'is' if n - open_ == 1 else 'are'} ready"
    else:
        title = "The machine is ready" if n == 1 else f"All {n} machines are ready"
    if open_ and open_ < n:
        title += f", {open_} {'is' if open_ == 1 else 'are'} not assessed"
    return status, tag, title


def sentences(
    machines: Sequence[Machine], trends: Sequence[Sequence[PartTrend]], unread: int, axis: Axis = "hours"
) -> list[str]:
    """What stands behind the headline: the worst machines, limits that come near, logs that were not read."""
    out = []
    bad = [m for m in machines if m.verdict in ("stop", "watch")]
    for m in bad[:_SHOWN]:
        told = [_found(m, f) for f in m.faults if f.standing][:2]
        note = f" ({m.note})" if m.note else ""
        out.append(f"{m.label} – {_TAGS[m.verdict]}: {join_words(told) or 'see its last mission'}{note}.")
    if len(bad) > _SHOWN:
        out.append(
            f"{count(len(bad) - _SHOWN, 'further machine')} {'has' if len(bad) == _SHOWN + 1 else 'have'} faults."
        )
    near = [(m, t) for m, own in zip(machines, trends, strict=True) for t in own if t.approaching]
    near.sort(key=lambda p: p[1].trend.forecast.likely or 0.0)
    for m, t in near[:2]:
        words = forecast_words(t.trend.forecast, t.limit, axis)
        out.append(f"{m.label}: the loss of the {part_words(t.kind, t.component, t.side)} {words}.")
    if unread:
        out.append(f"{count(unread, 'log')} could not be read or judged.")
    return out


def _found(m: Machine, f: FleetFault) -> str:
    many = f" in {f.missions} of {len(m.runs)} missions" if len(m.runs) > 1 else ""
    return f"{fault_words(f)}{many}"
