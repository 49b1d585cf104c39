"""Faults as typed on the command line: ``FR sensor stuck 30 37 eps=1 sat=0.2``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from replay.errors import ConfigError
from replay.faults import TABLE_ROWS, FaultSpec, Saturation, Side, TableRow

_PAPER_SPEED = 0.36
_SIDES = (Side.SENSOR, Side.ACTUATOR)
_KEYS: Mapping[str, Callable[[FaultSpec, float], FaultSpec]] = {
    "eps": lambda fault, x: replace(fault, epsilon=x),
    "sat": lambda fault, x: replace(fault, sat=x),
    "std": lambda fault, x: replace(fault, sat_std=x),
    "tau": lambda fault, x: replace(fault, sat_tau_s=x),
    "ramp": lambda fault, x: replace(fault, ramp_s=x),
}
_FORM = "PART SIDE MODE START STOP [eps=…] [sat=…] [std=…] [tau=…] [ramp=…], e.g. 'FR sensor stuck 30 37'"


def parse_fault(words: str, *, epsilon: float | None = None, speeds: Mapping[str, float] | None = None) -> FaultSpec:
    """Read one fault; what is not given takes a typical value of its row of the table.

    Parameters
    ----------
    words : str
        ``PART SIDE MODE START STOP`` and values.
    epsilon : float or None
        ε of inefficient and noisy faults that give none; None: the typical one.
    speeds : Mapping[str, float] or None
        Top speed [m/s] of parts on which typical values of a speed sensor's noise depend; None: the paper's.

    Raises
    ------
    ConfigError
        Where the words do not follow the form.
    """
    fixed = [w for w in words.split() if "=" not in w]
    if len(fixed) != 5:
        raise ConfigError(f"--fault {words!r}: expected {_FORM}")
    part, side_word, mode_word, start, stop = fixed
    side = next((s for s in _SIDES if s.value == side_word.lower()), None)
    if side is None:
        raise ConfigError(f"--fault {words!r}: side {side_word!r} is not known; expected sensor or actuator")
    rows = {row.mode.value: row for row in TABLE_ROWS if row.side is side}
    row = rows.get(mode_word.lower().replace("-", "_"))
    if row is None:
        raise ConfigError(f"--fault {words!r}: mode {mode_word!r} is not known; expected one of {', '.join(rows)}")
    fault = _typical(part, row, _number(words, "START", start), _number(words, "STOP", stop))
    if epsilon is not None and not row.total:
        fault = replace(fault, epsilon=epsilon)
    if speeds is not None and part in speeds and side is Side.SENSOR:
        scale = speeds[part] / _PAPER_SPEED
        fault = replace(fault, sat=fault.sat * scale, sat_std=fault.sat_std * scale)
    for word in (w for w in words.split() if "=" in w):
        key, _, value = word.partition("=")
        if key not in _KEYS:
            raise ConfigError(f"--fault {words!r}: {key!r} is not known; expected eps, sat, std, tau or ramp")
        fault = _KEYS[key](fault, _number(words, key, value))
    _check_row(words, fault, row)
    return fault


def _typical(part: str, row: TableRow, start: float, stop: float) -> FaultSpec:
    """Fault of a row with middling severity; a stuck part holds its value at onset."""
    return FaultSpec(part, row.side, row.mode, start, stop, row.epsilon, row.sat, row.sat_std, row.sat_tau_s)


def _number(words: str, key: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ConfigError(f"--fault {words!r}: {key} {value!r} is not a number")
    return number


def _check_row(words: str, fault: FaultSpec, row: TableRow) -> None:
    """Raise where ε and sat belong to another row of the table than the mode says."""
    if row.total and fault.epsilon != 1.0:
        raise ConfigError(f"--fault {words!r}: {fault.mode} means eps = 1, not {fault.epsilon:g}")
    if not row.total and not 0.0 < fault.epsilon < 1.0:
        raise ConfigError(f"--fault {words!r}: {fault.mode} needs eps between 0 and 1, not {fault.epsilon:g}")
    if row.saturation is Saturation.NONE and (fault.sat or fault.sat_std):
        raise ConfigError(f"--fault {words!r}: {fault.mode} means sat = 0; take stuck or noisy for another value")
    if row.saturation is Saturation.VALUE and (fault.sat == 0.0 or fault.sat_std):
        raise ConfigError(f"--fault {words!r}: {fault.mode} means one value other than 0; take no_signal or noisy")
    if row.saturation is Saturation.VARYING and not (fault.sat or fault.sat_std):
        raise ConfigError(f"--fault {words!r}: {fault.mode} needs sat or std other than 0; take inefficient")
