"""Dates without a time zone: which one they are meant in, and what they are in UTC."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta, timezone, tzinfo
from functools import lru_cache
from typing import TYPE_CHECKING

from replay.errors import ConfigError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: What a note says of dates without a zone.
NO_ZONE = "its dates state no time zone"
_OFFSET = re.compile(r"(?:UTC)?([+-])(\d\d):?(\d\d)")
_HOUR = 3_600 * 1_000_000_000


@lru_cache(maxsize=64)
def zone_called(name: str) -> tzinfo:
    """The time zone ``Europe/Berlin``, ``UTC`` or ``+02:00``.

    Parameters
    ----------
    name : str
        As the database of time zones calls it, or its hours and minutes ahead of UTC.

    Raises
    ------
    ConfigError
        Where it is neither.
    """
    if name.upper() in ("UTC", "Z"):
        return UTC
    if found := _OFFSET.fullmatch(name):
        ahead = timedelta(hours=int(found[2]), minutes=int(found[3]))
        return timezone(ahead if found[1] == "+" else -ahead)
    from zoneinfo import ZoneInfo, ZoneInfoNotFoundError  # hardly a log is in such a zone

    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:
        raise ConfigError(
            f"time zone {name!r} is not known; expected one such as Europe/Berlin, UTC or +02:00"
        ) from error


def from_zone(stamps: NDArray[np.int64], name: str) -> NDArray[np.int64]:
    """Stamps of clocks that show the time of a zone, in UTC; summer time counts from the hour in which it begins.

    Parameters
    ----------
    stamps : NDArray[np.int64], shape (n,)
        Nanoseconds from 1970-01-01T00:00 of that clock.
    name : str
        As for `zone_called`.

    Returns
    -------
    NDArray[np.int64], shape (n,)
        Nanoseconds since 1970 in UTC.

    Raises
    ------
    ConfigError
        Where the zone is not known.
    """
    import numpy as np  # the command line, which asks for zones of dates, does without it

    zone = zone_called(name)
    hours, place = np.unique(stamps // _HOUR, return_inverse=True)
    shown = (datetime(1970, 1, 1) + timedelta(hours=int(h)) for h in hours)
    ahead = [moment.replace(tzinfo=zone).utcoffset() or timedelta() for moment in shown]
    offsets = np.array([round(a.total_seconds()) * 1_000_000_000 for a in ahead], dtype=np.int64)
    return stamps - offsets[place] if len(offsets) else stamps
