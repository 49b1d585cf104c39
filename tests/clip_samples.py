"""A short mission with one fault, diagnosed, and its log on the clock of another recorder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import Writer

from diagnosis.pipeline import diagnose_mission
from diagnosis.results.result import MissionResult
from replay.export.mission import write_mission
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import haulotte
from replay.mission import Mission, load_mission
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission

STUCK = FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 8.0, 12.0, 1.0, 0.3)


def drive(folder: Path, format: str = "mcap", start_ns: int = SimulationOptions.start_ns) -> Path:  # noqa: A002
    """Log of 20 s at 100 Hz with the FR speed sensor stuck from 8 to 12 s."""
    options = SimulationOptions(
        scenario="healthy", duration_s=20.0, rate_hz=100.0, faults=(STUCK,), evidence="direct", start_ns=start_ns
    )
    path = folder / f"drive.{format}"
    write_mission(simulate_mission(options), path, format)
    return path


def judged(folder: Path, format: str = "mcap") -> tuple[Mission, MissionResult]:  # noqa: A002
    """The same, diagnosed."""
    mission = load_mission([drive(folder, format)], haulotte())
    return mission, diagnose_mission(mission, haulotte())


def with_log_stamps(source: Path, target: Path, moved: Callable[[int], int]) -> None:
    """Copy an MCAP log with other log stamps; its messages stay as they are."""
    with source.open("rb") as file, target.open("wb") as out:
        writer = Writer(out)
        writer.start()
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        for schema, channel, m in make_reader(file).iter_messages():
            assert schema is not None
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(channel.topic, "cdr", schemas[schema.id])
            writer.add_message(channels[channel.id], moved(m.log_time), m.data, moved(m.publish_time))
        writer.finish()
