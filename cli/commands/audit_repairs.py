"""`mfhca audit --repaired`: repairs that are recorded in an audit's store."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from cli.terminal.console import Terminal
from cli.terminal.dates import has_zone, moment_of, nanoseconds, shown_moment
from replay.errors import ConfigError
from replay.progress import Stage

if TYPE_CHECKING:
    from diagnosis.audit.events import EventFacts

_FIRST_YEAR = 2000


@dataclass(frozen=True)
class RepairRequest:
    """What the command line asks for; names and defaults as there."""

    output: Path
    repaired: list[str]
    not_repaired: list[str]
    on: str | None
    json: bool
    max_size_mb: float = 8.0

    def is_asked(self, paths: Sequence[str]) -> bool:
        """Whether repairs are to be recorded, and not logs to be audited.

        Raises
        ------
        ConfigError
            Where neither is asked for, both are, or the date is missing.
        """
        if not (self.repaired or self.not_repaired):
            if self.on is not None:
                raise ConfigError('--on: says when a part was repaired; give it with --repaired "MACHINE PART [side]"')
            if not paths:
                raise ConfigError("no PATH is given; name the folder of the logs")
            return False
        option = "--repaired" if self.repaired else "--not-repaired"
        if self.repaired and self.not_repaired:
            raise ConfigError("--repaired and --not-repaired: give them one after the other")
        if paths:
            raise ConfigError(f"{option}: audits nothing; leave out {paths[0]}, and audit it afterwards")
        if self.on is None:
            raise ConfigError(f"{option}: give the date of the repair with --on, such as --on 2026-10-05")
        return True


def one_date(dates: Sequence[str] | None) -> str | None:
    """The date that is given with --on; None where there is none.

    Raises
    ------
    ConfigError
        Where there are several: which part each is for is not known.
    """
    if dates is not None and len(dates) > 1:
        raise ConfigError(
            f"--on: is given {len(dates)} times, and one date holds for all parts of a command; run it once for each date"
        )
    return dates[0] if dates else None


def run_repairs(terminal: Terminal, request: RepairRequest) -> None:
    """Record repairs, or take them back, and show the machines as the fleet page has them afterwards."""
    assert request.on is not None
    with terminal.progress(Stage.WRITING):
        from diagnosis.audit.repairs import record_repairs

        withdrawn = bool(request.not_repaired)
        words = request.not_repaired or request.repaired
        recorded = record_repairs(
            request.output, words, _date(request.on), _unheard, withdrawn=withdrawn, max_size_mb=request.max_size_mb
        )
    if request.json:
        told = [{**asdict(t), "withdrawn": withdrawn} for t in recorded.told]
        terminal.show_json({"repairs": told, "machines": [asdict(m) for m in recorded.machines]})
        return
    from cli.tables.audit import machine_parts
    from cli.tables.layout import text

    if not has_zone(request.on):
        terminal.note(
            f"--on {request.on}: taken as UTC; write an offset or a zone for another: '{request.on} local', or +02:00 behind it"
        )
    for t in recorded.told:
        what = "taken back" if withdrawn else "recorded"
        terminal.show(text(f"Repair {what}: {t.machine} {t.part} on {shown_moment(t.repaired_ns)}"))
        if not withdrawn:
            closes = "; ".join(t.closes) or "no fault that stands"
            terminal.show(text(f"  closes: {closes}", "dim"))
            for left in t.stays:
                terminal.show(text(f"  stays open: {left}", "dim"))
    pages = [text(f"fleet page  {request.output / 'fleet.html'}")]
    pages += [
        text(f"report      {request.output / report / 'report.html'}, written anew") for report in recorded.reports
    ]
    terminal.show(*machine_parts(recorded.machines), "", *pages)


def _date(text: str, now: datetime | None = None) -> int:
    """Moment of a repair [ns since 1970].

    Raises
    ------
    ConfigError
        Where it is no date, or one on which no repair can have been.
    """
    moment = moment_of("--on", text)
    if moment > (now or datetime.now(UTC)):
        raise ConfigError(f"--on {text}: lies ahead; give the date on which the part was repaired")
    if moment.year < _FIRST_YEAR:
        raise ConfigError(f"--on {text}: lies before {_FIRST_YEAR}; give the date on which the part was repaired")
    return nanoseconds(moment)


def _unheard(event: str, facts: EventFacts) -> None:
    """Take an event that nobody asked for."""
