"""Dates of the command line: ISO 8601, UTC without an offset; and moments as they are shown, in UTC and in local time."""

from __future__ import annotations

from datetime import UTC, datetime

from replay.errors import ConfigError

_EARLIEST, _LATEST = 1970, 2100


def moment_of(option: str, text: str) -> datetime:
    """Moment that an option gives as ``2026-10-05``, ``2026-10-05T14:30`` or ``2026-10-05T14:30+02:00``.

    Parameters
    ----------
    option : str
        Its name, for errors.
    text : str
        What was given; without a time midnight is meant, without an offset UTC.

    Raises
    ------
    ConfigError
        Where it is no date, or one that no log has.
    """
    try:
        moment = datetime.fromisoformat(text.strip())
    except ValueError as error:
        raise ConfigError(
            f"{option} {text}: is no date; expected one such as 2026-10-05 or 2026-10-05T14:30 (UTC), or 2026-10-05T14:30+02:00"
        ) from error
    moment = moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment
    if not datetime(_EARLIEST, 1, 1, tzinfo=UTC) <= moment < datetime(_LATEST, 1, 1, tzinfo=UTC):
        raise ConfigError(f"{option} {text}: is out of range; expected {_EARLIEST} to {_LATEST - 1}")
    return moment.astimezone(UTC)


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
    if 0 <= start_ns < UNDATED_NS:
        return f"{start_ns / 1e9:.0f} s of a clock without a date (simulated time, or counted from a start)"
    if not local.utcoffset():
        return shown
    day = "" if local.date() == moment.date() else f"{local:%Y-%m-%d} "
    return f"{shown} ({day}{local:%H:%M:%S %Z})"
