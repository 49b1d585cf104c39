"""Dates of the command line: ISO 8601, UTC without an offset or a zone; and moments as they are shown, in UTC and in local time."""

from __future__ import annotations

from datetime import UTC, datetime

from replay.errors import ConfigError
from replay.log.time_zone import zone_called

_EARLIEST, _LATEST = 1970, 2100


def moment_of(option: str, text: str) -> datetime:
    """Moment that an option gives as ``2026-10-05``, ``2026-10-05T14:30``, ``2026-10-05T14:30+02:00`` or ``2026-10-05T14:30 Europe/Berlin``.

    Parameters
    ----------
    option : str
        Its name, for errors.
    text : str
        What was given; without a time midnight is meant, without an offset UTC. Behind a blank may stand a time zone, or
        ``local`` for that of this computer.

    Raises
    ------
    ConfigError
        Where it is no date, or one that no log has.
    """
    date, zone = _split(text)
    try:
        moment = datetime.fromisoformat(date)
    except ValueError as error:
        raise ConfigError(
            f"{option} {text}: is no date; expected one such as 2026-10-05 or 2026-10-05T14:30 (UTC), 2026-10-05T14:30+02:00, "
            "'2026-10-05T14:30 Europe/Berlin' or '2026-10-05T14:30 local'"
        ) from error
    if moment.tzinfo is None:
        moment = moment.astimezone() if zone == "local" else moment.replace(tzinfo=zone_called(zone or "UTC"))
    elif zone:
        raise ConfigError(f"{option} {text}: has an offset and the zone {zone}; give one of them")
    if not datetime(_EARLIEST, 1, 1, tzinfo=UTC) <= moment < datetime(_LATEST, 1, 1, tzinfo=UTC):
        raise ConfigError(f"{option} {text}: is out of range; expected {_EARLIEST} to {_LATEST - 1}")
    return moment.astimezone(UTC)


def _split(text: str) -> tuple[str, str]:
    """A date with its time, and the zone behind it; empty where there is none."""
    words = text.split()
    if len(words) > 1 and not words[-1][0].isdigit():
        return " ".join(words[:-1]), words[-1]
    return " ".join(words), ""


def has_zone(text: str) -> bool:
    """Whether a date says in which zone it is meant."""
    date, zone = _split(text)
    return bool(zone) or datetime.fromisoformat(date).tzinfo is not None


def nanoseconds(moment: datetime) -> int:
    """Nanoseconds since 1970 of a moment."""
    since = moment - datetime(1970, 1, 1, tzinfo=UTC)
    return ((since.days * 86_400 + since.seconds) * 1_000_000 + since.microseconds) * 1000


def shown_moment(start_ns: int) -> str:
    """Moment in UTC, and beside it in local time where that is another: ``2026-10-05 12:30:00 UTC (14:30:00 CEST)``."""
    from diagnosis.pages.labels import UNDATED_NS  # loads much

    try:
        moment = datetime.fromtimestamp(start_ns // 10**9, tz=UTC)
        local = moment.astimezone()
    except (ValueError, OverflowError, OSError):
        return "an unknown time"
    shown = f"{moment:%Y-%m-%d %H:%M:%S} UTC"
    if abs(start_ns) < UNDATED_NS:
        return f"{round(start_ns / 1e9)} s of a clock without a date (simulated time, or counted from a start)"
    if not local.utcoffset():
        return shown
    day = "" if local.date() == moment.date() else f"{local:%Y-%m-%d} "
    return f"{shown} ({day}{local:%H:%M:%S %Z})"
