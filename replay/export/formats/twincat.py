"""Write a TwinCAT Scope text export: command-line tool's dialect (TAB, decimal comma), groups by sample time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.csv
from numpy.typing import NDArray

from replay.atomic_write import atomic_path
from replay.simulation.options import SIMULATED_AXLES, SimulatedMission, channel_group

_FILETIME_1970 = 116_444_736_000_000_000  # 100 ns from 1601 to 1970
_WHEEL = {
    "v_ref": ("fVelocityRef", "m/s"),
    "v": ("fVelocity", "rpm"),
    "v_true": ("fVelocityRedundant", "m/s"),
    "u": ("fValveCmd", "%"),
    "u_applied": ("fValveActual", "%"),
}
_STEER = {
    "phi_ref": ("fAngleRef", "rad"),
    "phi": ("fAngle", "rad"),
    "phi_true": ("fAngleRedundant", "rad"),
    "u": ("fValveCmd", "%"),
    "u_applied": ("fValveActual", "%"),
}
_OTHER = {
    "cmd.v": ("MAIN.fbJoystick.fVelocity", "m/s"),
    "cmd.omega": ("MAIN.fbJoystick.fYawRate", "rad/s"),
    "imu.yaw_rate": ("MAIN.fbImu.fYawRate", "rad/s"),
    "gnss.lat": ("MAIN.fbGnss.fLatitude", "deg"),
    "gnss.lon": ("MAIN.fbGnss.fLongitude", "deg"),
}


def plc_symbol(name: str, wheels: tuple[str, ...]) -> tuple[str, str]:
    """PLC symbol and unit of a canonical signal: ``wheel.FR.v`` is ``MAIN.fbWheel[1].fVelocity`` in motor rpm."""
    if name in _OTHER:
        return _OTHER[name]
    kind, part, leaf = name.split(".")
    if kind == "wheel":
        return f"MAIN.fbWheel[{wheels.index(part) + 1}].{_WHEEL[leaf][0]}", _WHEEL[leaf][1]
    return f"MAIN.fbSteer[{SIMULATED_AXLES.index(part) + 1}].{_STEER[leaf][0]}", _STEER[leaf][1]


@dataclass(frozen=True)
class ScopeGroup:
    """Channels that share their stamps: period, symbols, units, stamps (n,) [ns] and values (n,) in the recorded units."""

    period_ms: float
    symbols: list[str]
    units: list[str]
    stamps: NDArray[np.int64]
    values: list[NDArray[np.float64]]


def write_twincat(path: Path, mission: SimulatedMission) -> None:
    """Write a mission as a TwinCAT Scope export; a sensor that logs nothing leaves its cells blank.

    Raises
    ------
    OutputError
        Where the file cannot be written.
    """
    machine = mission.options.machine
    assert machine.geometry is not None  # checked by SimulationOptions
    motor_rpm = 60.0 * machine.gear_ratio / (np.pi * machine.geometry.wheel_diameter)
    sources = [*_fast_groups(mission), *((g.stamps, g.columns) for g in reversed(mission.slow))]
    groups = []
    for stamps, columns in sorted(sources, key=lambda s: -s[0].size):
        pairs = [plc_symbol(name, machine.wheels) for name in columns]
        factor = [{"rpm": motor_rpm, "%": 100.0}.get(unit, 1.0) for _, unit in pairs]
        # Ten decimals hold every recorded step exactly and take away the rounding of the conversion.
        values = [np.round(v * f, 10) + 0.0 for v, f in zip(columns.values(), factor, strict=True)]
        period = float(np.median(np.diff(stamps))) / 1e6 if stamps.size > 1 else 1000.0 / mission.options.rate_hz
        groups.append(ScopeGroup(period, [s for s, _ in pairs], [u for _, u in pairs], stamps, values))
    write_scope(path, groups)


def write_scope(path: Path, groups: list[ScopeGroup]) -> None:
    """Write channels as a TwinCAT Scope export.

    Parameters
    ----------
    path : Path
        File; an existing one is replaced.
    groups : list[ScopeGroup]
        Channels by sample time, the most samples first.

    Raises
    ------
    OutputError
        Where the file cannot be written.
    """
    start = min(int(g.stamps[0]) for g in groups) // 100 * 100  # the head's clock counts 100 ns
    stop = max(int(g.stamps[-1]) for g in groups)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(_head(start, stop, groups).replace("\n", "\r\n").encode())
        _write_rows(file, start, groups)
        file.write(b"EOF\r\n")


def _fast_groups(mission: SimulatedMission) -> list[tuple[NDArray[np.int64], Mapping[str, NDArray[np.float64]]]]:
    """Stamps and columns of the recorded rate; one group for all, or one per group of channels that lost rows."""
    if not mission.kept:
        return [(mission.stamps, mission.columns)]
    return [
        (mission.stamps[rows], {n: x[rows] for n, x in mission.columns.items() if channel_group(n) == group})
        for group, rows in mission.kept.items()
    ]


def _head(start: int, stop: int, groups: list[ScopeGroup]) -> str:
    """Everything above the data."""

    def moment(key: str, stamp: int) -> str:
        when = datetime.fromtimestamp(stamp // 1_000_000_000, UTC)
        filetime = stamp // 100 + _FILETIME_1970
        return f"{key}\t{filetime}\t{when:%d.%m.%Y}\t{when:%H:%M:%S}"

    channels = [(i, g.symbols[i], g.units[i], g) for g in groups for i in range(len(g.symbols))]
    cells = {
        "Name": [s.removeprefix("MAIN.") for _, s, _, _ in channels],
        "SymbolComment": ["" for _ in channels],
        "Data-Type": ["REAL64" for _ in channels],
        "SampleTime[ms]": [f"{g.period_ms:.10g}".replace(".", ",") for *_, g in channels],
        "VariableSize": ["8" for _ in channels],
        "SymbolBased": ["True" for _ in channels],
        "IndexGroup": ["16448" for _ in channels],
        "IndexOffset": [str(385_000 + 8 * j) for j in range(len(channels))],
        "SymbolName": [s for _, s, _, _ in channels],
        "NetID": ["5.24.36.48.1.1" for _ in channels],
        "Port": ["851" for _ in channels],
        "Offset": ["0" for _ in channels],
        "ScaleFactor": ["1" for _ in channels],
        "BitMask": ["0xFFFFFFFFFFFFFFFF" for _ in channels],
        "Unit": [unit for _, _, unit, _ in channels],
        "Unit ScaleFactor": ["1" for _ in channels],
        "Unit Offset": ["0" for _ in channels],
    }
    lines = ["Name\tMission", "File\tMission.tcscopex", moment("Starttime of export", start)]
    lines += [moment("Endtime of export", stop), "", ""]
    for key, row in cells.items():
        texts = [f"{key}\t{cell}" if channel[0] == 0 else cell for channel, cell in zip(channels, row, strict=True)]
        lines.append("\t".join(texts))
    return "\n".join([*lines, "", ""])


def _write_rows(file: BinaryIO, start: int, groups: list[ScopeGroup]) -> None:
    """Data rows: the k-th row holds each group's k-th sample; rows get shorter where a right-hand group ends."""
    done = 0
    for last in range(len(groups), 0, -1):
        count = groups[last - 1].stamps.size
        columns = []
        for group in groups[:last]:
            columns.append(pa.array((group.stamps[done:count] - start) / 1e6))
            columns += [pa.array(v[done:count], from_pandas=True) for v in group.values]
        if count > done:
            _write_table(file, columns)
        done = max(done, count)


def _write_table(file: BinaryIO, columns: list[pa.Array]) -> None:
    table = pa.table(columns, names=[str(i) for i in range(len(columns))])
    options = pa.csv.WriteOptions(include_header=False, delimiter="\t", quoting_style="none")
    sink = pa.BufferOutputStream()
    pa.csv.write_csv(table, sink, options)
    # Only numbers stand here, so every point is a decimal sign.
    file.write(sink.getvalue().to_pybytes().replace(b".", b",").replace(b"\n", b"\r\n"))
