"""Signals whose unit or scale the log does not tell: the one that they usually have then, asked in one question for each kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from replay.log.raw_log import Channel
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.quantities import DOUBTED_UNITS, UNITS
from replay.machine.signal_table import quantity_of
from replay.machine.units import known_unit
from replay.setup.draft_notes import Draft
from replay.setup.motion import correlation
from replay.signals.candidate import source_of
from replay.signals.name_parts import first_indices
from replay.signals.named_units import bare_name
from replay.signals.signal import Signal, Signals
from replay.signals.symbol_rules import is_measured, valve_current
from replay.signals.to_si import peak_of
from replay.signals.unit_doubts import per_minute

#: By quantity: the unit, from and up to which largest value it is taken, and what the values would be in SI.
USUAL_UNITS = {
    "fraction": ("%", 1.5, 150.0, "fractions of full opening"),
    "angle": ("deg", 3.2, 180.0, "radians"),
    "rotation": ("deg/s", 6.3, 400.0, "rad/s"),
}
_MOST_VOLTS = 10.5  # what an analogue signal of 10 V may reach
_LEAST_MA, _MOST_MA = 3.5, 21.0  # between which a current of 4 to 20 mA keeps
_MIDDLE_MA = 12.0
_OVER = 1.1  # of full opening, which no command exceeds
_TOO_FAST = 100.0  # m/s
_SPEEDS = ("v", "v_ref", "v_true")
_BODY = ("cmd.v", "odom.v", "gnss.speed")
_LEAST_ALIKE, _MOST_ALIKE = 0.4, 2.5  # by which speeds of one unit differ in size
_GOES_WITH = 0.5  # correlation of a command and what answers it


def valve_currents(
    draft: Draft, channels: Mapping[str, Channel], machine: Machine, found: Signals
) -> Mapping[str, SignalSource]:
    """Commands of valves that are logged as currents or voltages, as shares of the largest that the log shows.

    Parameters
    ----------
    draft : Draft
        Takes one question.
    channels : Mapping[str, Channel]
        All of the log.
    machine : Machine
        Its wheels and axles.
    found : Signals
        As found by their names: valves whose openings are logged keep these.
    """
    first = first_indices(channels)
    told = [(name, c) for c in channels.values() if (name := valve_current(c, machine, first)) is not None]
    asks = {name: c for name, c in told if not is_measured(c, machine)}
    measures = {name: c for name, c in told if is_measured(c, machine)}
    named = {**measures, **asks}
    positions = {f"{n}_applied": c for n, c in measures.items() if n in asks and _is_position(c)}
    out: dict[str, SignalSource] = {}
    shown: list[str] = []
    for kind in ("wheel", "steer"):
        alike = {n: c for n, c in named.items() if n.startswith(kind) and n not in found.items}
        peak = max((peak_of(c.values) for c in alike.values()), default=0.0)
        volts = 5.0 < peak <= _MOST_VOLTS and all(_unit(c) == "V" for c in alike.values())
        if peak > 0 and all(_unit(c) == "%" for c in alike.values()):
            out |= {n: source_of(c, "%") for n, c in alike.items()}
            draft.ask(
                "signals",
                f"does 100 % of {next(iter(alike.values())).name} and the like open a valve fully? It is a current; it is taken so.",
            )
        elif peak > 0 and all(_unit(c) == "mA" and _is_position(c) for c in alike.values()):
            out |= _by_transducer(draft, alike)
        elif volts:
            out |= {n: replace(source_of(c, "1"), gain=0.1) for n, c in alike.items()}
            draft.ask(
                "signals",
                f"do 10 V of {next(iter(alike.values())).name} and the like open a valve fully? Else gain = 1 / that voltage, negative where it closes.",
            )
        elif peak > 0:
            full = float(f"{peak:.4g}")
            out |= {n: replace(source_of(c, "1"), gain=float(f"{1 / peak:.4g}")) for n, c in alike.items()}
            unit = next((u for c in alike.values() if (u := _unit(c))), "")
            shown.append(f"{full:g} {unit}".rstrip() + f" of {next(iter(alike.values())).name}")
    if shown:
        draft.ask(
            "signals",
            f"which current opens a valve fully? Valves are logged by their currents, and the largest in this log stands in "
            f"({', '.join(shown)} and the like): gain = 1 / that current, negative where it closes.",
        )
    return out | _by_transducer(draft, {n: c for n, c in positions.items() if n not in found.items})


def _by_transducer(draft: Draft, measured: Mapping[str, Channel]) -> dict[str, SignalSource]:
    """Positions of valves, measured or asked for, by a loop of 4 to 20 mA or of ±10 V, with the question that they leave."""
    if not measured:
        return {}
    first = next(iter(measured.values()))
    loop = _unit(first) == "mA"
    spans = [np.nanquantile(np.asarray(c.values, np.float64), (0.01, 0.99)) for c in measured.values()]
    both = loop and any(low < _MIDDLE_MA - 1.0 and high > _MIDDLE_MA + 1.0 for low, high in spans)
    gain, offset = (0.125, -1.5) if both else (0.0625, -0.25) if loop else (0.1, 0.0)
    states = "12 mA close a valve and 20 mA open it" if both else "4 mA close a valve and 20 mA open it"
    draft.ask(
        "signals",
        f"do {states if loop else '10 V stand for a valve open'} fully ({first.name} and the like)? "
        f"It is taken so: gain = {gain:g}{f', offset = {offset:g}' if offset else ''}.",
    )
    return {n: replace(source_of(c, "1"), gain=gain, offset=offset) for n, c in measured.items()}


def _is_position(channel: Channel) -> bool:
    """Whether values are as a transducer of 4 to 20 mA or of 10 V gives them: the current of a coil is no position."""
    known = np.asarray(channel.values, np.float64)
    known = known[np.isfinite(known)]
    if not known.size:
        return False
    low, most = float(np.quantile(known, 0.01)), peak_of(channel.values)
    return (_unit(channel) == "mA" and low >= _LEAST_MA and most <= _MOST_MA) or (
        _unit(channel) == "V" and most <= _MOST_VOLTS
    )


def _unit(channel: Channel) -> str:
    return channel.unit or bare_name(channel.name)[1]


def usual_units(draft: Draft, found: Signals) -> Mapping[str, SignalSource]:
    """Sources of the signals that get a unit, by canonical name; the draft takes the questions.

    Parameters
    ----------
    draft : Draft
        Takes one question for each kind.
    found : Signals
        As found by their names, SI where no unit is stated.
    """
    out = dict(_millimetres(draft, found))
    for quantity, (unit, least, most, si) in USUAL_UNITS.items():
        bare = {
            n: s
            for n, s in found.items.items()
            if quantity_of(n) == quantity and not s.origin.unit and not n.endswith(".psi") and not n.startswith("odom")
        }
        peak = max((peak_of(s.values) for s in bare.values()), default=0.0)
        commanded = max((peak_of(s.values) for n, s in bare.items() if n.endswith(".u")), default=0.0)
        if not (least < peak or (quantity == "fraction" and commanded > _OVER)) or peak > most:
            continue
        if quantity != "fraction":
            in_si = _in_si_already(bare, unit, peak)
            bare = {n: s for n, s in bare.items() if n not in in_si}
        named = ", ".join(s.origin.label for s in bare.values())
        doubted, asked = _other_unit(bare, peak) if quantity == "fraction" else (None, "")
        out |= {n: replace(s.origin, unit=doubted or unit) for n, s in bare.items()}
        draft.ask(
            "signals",
            f"{'is' if len(bare) == 1 else 'are'} {named} in {unit}{asked or '?'} None is stated; in {si} {'it' if len(bare) == 1 else 'they'} would reach {peak:.3g}.",
        )
    return out


def _other_unit(bare: Mapping[str, Signal], peak: float) -> tuple[str | None, str]:
    """Unit of openings that may be % or another one, and how the question goes on; None and nothing where they are %."""
    answer = "; until then no valve is judged by them."
    if peak <= _MOST_VOLTS:
        scale = ', or in volts? Write unit = "%" in each line, or unit = "1", gain = 0.1 where 10 V open a valve fully'
        return DOUBTED_UNITS[0], f"{scale}{answer}"
    values = [s.values[np.isfinite(s.values)] for s in bare.values()]
    if peak <= _MOST_MA and all(np.quantile(x, 0.01) >= _LEAST_MA for x in values if x.size):
        scale = ', or in mA? Write unit = "%" in each line, or unit = "1", gain = 0.0625, offset = -0.25 where 4 mA close a valve and 20 mA open it fully'
        return DOUBTED_UNITS[1], f"{scale}{answer}"
    return None, ""


def _millimetres(draft: Draft, found: Signals) -> Mapping[str, SignalSource]:
    """Speeds without a unit, of body and wheels, that are as large as each other, and such as no machine has in m/s."""
    body = {n: s for n in _BODY if (s := found.items.get(n)) is not None and not s.origin.unit}
    most = next((p for s in body.values() if _TOO_FAST < (p := peak_of(s.values)) <= _TOO_FAST * 100), 0.0)
    wheels = {n: s for n, s in found.items.items() if n.startswith("wheel.") and n.rpartition(".")[2] in _SPEEDS}
    stated = bool(wheels) and all(known_unit(s.origin.unit) == "mm/s" for s in wheels.values())
    alike = {n: s for n, s in body.items() if _as_large(s, most)} | ({} if stated else wheels)
    if not most or not wheels or any(s.origin.unit or per_minute(s.origin.label) for s in alike.values()):
        return {}
    for leaf in _SPEEDS:  # a wheel that reads a share, or nothing, is recorded as the others are
        scale = 1.0 / UNITS["mm/s"][1] if stated else 1.0  # to what was recorded
        tops = sorted(peak_of(s.values) * scale for n, s in wheels.items() if n.endswith(f".{leaf}"))
        if tops and not _LEAST_ALIKE < tops[len(tops) // 2] / most < _MOST_ALIKE:
            return {}
    named = ", ".join(s.origin.label for s in alike.values())
    one = len(alike) == 1
    draft.ask(
        "signals",
        f"{'is' if one else 'are'} {named} in mm/s{', as the wheels are' if stated else ''}? None is stated; in m/s {'it' if one else 'they'} would reach {most:.3g}.",
    )
    return {n: replace(s.origin, unit="mm/s") for n, s in alike.items()}


def _as_large(signal: Signal, most: float) -> bool:
    return most > 0 and _LEAST_ALIKE < peak_of(signal.values) / most < _MOST_ALIKE


def _in_si_already(bare: Mapping[str, Signal], unit: str, most: float) -> list[str]:
    """Signals that go with the largest one, and read what it does in SI: the others alone are in another unit."""
    first = max(bare.values(), key=lambda s: peak_of(s.values))
    factor = UNITS[unit][1]
    return [n for n, s in bare.items() if _as_large(s, most * factor) and abs(correlation(first, s)) > _GOES_WITH]
