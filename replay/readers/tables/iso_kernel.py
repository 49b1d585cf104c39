"""Dates and times as text to nanoseconds since 1970, as a compiled function."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.readers.common.compiled import part

_MISSING = -(2**63)


@njit(cache=True, no_cpython_wrapper=True)
def _digits(data: NDArray[np.uint8], at: int, count: int, stop: int) -> Any:
    """Value of `count` digits, −1 where they are not all there."""
    if at + count > stop:
        return -1
    value: Any = 0
    for i in range(at, at + count):
        if data[i] < 48 or data[i] > 57:
            return -1
        value = value * 10 + np.int64(data[i] - 48)
    return value


@njit(cache=True, no_cpython_wrapper=True)
def _days(year: int, month: int, day: int) -> int:
    """Days from 1970-01-01 in the Gregorian calendar, years counted from March."""
    y = year - (month <= 2)
    era = y // 400
    of_era = y - era * 400
    of_year = (153 * (month + (-3 if month > 2 else 9)) + 2) // 5 + day - 1
    return era * 146_097 + of_era * 365 + of_era // 4 - of_era // 100 + of_year - 719_468


@part
def _midnight(data: NDArray[np.uint8], at: int, stop: int, month_first: bool) -> Any:
    """Seconds from 1970 to the day of a date of ten characters, `_MISSING` where it is none."""
    if month_first:
        month, day, year = _digits(data, at, 2, stop), _digits(data, at + 3, 2, stop), _digits(data, at + 6, 4, stop)
    elif data[at + 2] == 46 and data[at + 5] == 46:
        day, month, year = _digits(data, at, 2, stop), _digits(data, at + 3, 2, stop), _digits(data, at + 6, 4, stop)
    else:
        year, month, day = _digits(data, at, 4, stop), _digits(data, at + 5, 2, stop), _digits(data, at + 8, 2, stop)
        if data[at + 4] != data[at + 7] or (data[at + 4] != 45 and data[at + 4] != 47):
            return _MISSING
    if year < 1678 or year > 2261 or month < 1 or month > 12 or day < 1 or day > 31:
        return _MISSING
    if day > 28 and _days(year, month, day) >= _days(year + month // 12, month % 12 + 1, 1):
        return _MISSING
    return _days(year, month, day) * 86_400


@part
def _of_day(data: NDArray[np.uint8], i: int, stop: int) -> tuple[int, Any, Any, Any]:
    """Place behind a time of day (−1 where it is none), its hour, its seconds and its nanoseconds."""
    seconds: Any = 0
    nanoseconds: Any = 0
    hour, minute = _digits(data, i + 1, 2, stop), _digits(data, i + 4, 2, stop)
    if hour < 0 or hour > 23 or minute < 0 or minute > 59 or data[i + 3] != 58:
        return -1, hour, seconds, nanoseconds
    seconds += hour * 3600 + minute * 60
    i += 6
    if i < stop and data[i] == 58:
        second = _digits(data, i + 1, 2, stop)
        if second < 0 or second > 60:
            return -1, hour, seconds, nanoseconds
        seconds += second
        i += 3
    if i < stop and (data[i] == 46 or data[i] == 44):
        i += 1
        scale = 100_000_000
        while i < stop and 48 <= data[i] <= 57:
            nanoseconds += np.int64(data[i] - 48) * scale
            scale //= 10
            i += 1
    while i < stop and data[i] == 32:
        i += 1
    return i, hour, seconds, nanoseconds


@part
def _zone(data: NDArray[np.uint8], i: int, stop: int) -> tuple[int, Any]:
    """Place behind the zone that may stand at `i`, and its seconds ahead of UTC; −1 where it is damaged."""
    if i < stop and (data[i] == 90 or data[i] == 122):
        return i + 1, 0
    if i < stop and (data[i] == 43 or data[i] == 45):
        sign = 1 if data[i] == 43 else -1
        hour = _digits(data, i + 1, 2, stop)
        colon = i + 3 < stop and data[i + 3] == 58
        minute = _digits(data, i + (4 if colon else 3), 2, stop)
        if hour < 0:
            return -1, 0
        return i + (3 if minute < 0 else 6 if colon else 5), sign * (hour * 3600 + max(minute, 0) * 60)
    return i, 0


@njit(cache=True)
def iso_ns(data: NDArray[np.uint8], at: int, stop: int) -> Any:
    """Moment of ``2024-05-01T10:00:00.25+02:00``, ``DT#2024-05-01-10:00:00`` or ``01.05.2024 10:00:00,25``.

    Also of ``05/31/2024 10:00:00.25 AM`` (month first, with AM or PM alone) and of ``10:00:00.25``, on 1970-01-01.

    Parameters
    ----------
    data : NDArray[np.uint8]
        Text.
    at, stop : int
        The cell without blanks around it.

    Returns
    -------
    int
        Nanoseconds since 1970 (UTC where no zone is written), the smallest integer where it is none of these.
    """
    if at + 3 < stop and data[at] == 68 and data[at + 1] == 84 and data[at + 2] == 35:
        at += 3
    if stop - at < 8:
        return _MISSING
    clock_alone = data[at + 2] == 58 and data[at + 5] == 58
    if stop - at < 10 and not clock_alone:
        return _MISSING
    halves = data[at + 2] == 47 and data[at + 5] == 47  # months first, so AM or PM must follow
    seconds: Any = 0
    nanoseconds: Any = 0
    if not clock_alone:
        seconds = _midnight(data, at, stop, halves)
        if seconds == _MISSING:
            return _MISSING
    i = at - 1 if clock_alone else at + 10
    if clock_alone or (
        i < stop and (data[i] == 84 or data[i] == 32 or data[i] == 45 or data[i] == 116 or data[i] == 95)
    ):
        i, hour, more, nanoseconds = _of_day(data, i, stop)
        if i < 0:
            return _MISSING
        seconds += more
        if halves and i + 1 < stop and (data[i] == 65 or data[i] == 80) and data[i + 1] == 77:
            if hour < 1 or hour > 12:
                return _MISSING
            seconds += 3600 * ((hour % 12 + (12 if data[i] == 80 else 0)) - hour)
            halves = False
            i += 2
        else:
            i, ahead = _zone(data, i, stop)
            seconds -= ahead
    if i != stop or halves:
        return _MISSING
    return seconds * 1_000_000_000 + nanoseconds


@njit(cache=True)
def iso_many(data: NDArray[np.uint8], starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Moments of texts, shape (n,); see `iso_ns`.

    Parameters
    ----------
    data : NDArray[np.uint8]
        Texts, one behind the other.
    starts : NDArray[np.int64], shape (n + 1,)
        Where each begins, and where the last ends.
    """
    out = np.empty(len(starts) - 1, np.int64)
    for i in range(len(out)):
        out[i] = iso_ns(data, starts[i], starts[i + 1])
    return out
