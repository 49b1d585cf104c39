"""Decimal text to doubles, correctly rounded, as compiled functions.

Short numbers are exact in one multiplication or division (Clinger); the rest goes through a 128-bit product with a table
of powers of five (Lemire, "Number parsing at a gigabyte per second", 2021; Mushtak and Lemire, 2023, prove that no
fallback is needed up to 19 digits). What neither settles (subnormals, longer numbers on the edge between two doubles) is
left to the caller.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

BAD, INTEGER, FLOAT, HARD = 0, 1, 2, 3

_LOWEST, _HIGHEST = -342, 308


def _powers_of_five() -> NDArray[np.uint64]:
    """Leading 128 bits of 5**q, shape (651, 2): rounded down for q ≥ 0, their reciprocals up for q < 0."""
    rows = []
    for q in range(_LOWEST, _HIGHEST + 1):
        if q >= 0:
            bits = (5**q).bit_length()
            word = 5**q << (128 - bits) if bits <= 128 else 5**q >> (bits - 128)
        else:
            power = 5**-q
            bits = (power - 1).bit_length()
            word = 2 ** (bits + 127) // power + 1 if q >= -27 else 2 ** (2 * bits + 128) // power + 1
            word >>= max(word.bit_length() - 128, 0)
        rows.append((word >> 64, word & (2**64 - 1)))
    return np.array(rows, np.uint64)


FIVES = _powers_of_five()
TENS = np.array([10.0**q for q in range(23)])
_U0, _U1, _U3 = np.uint64(0), np.uint64(1), np.uint64(3)
_U10, _U52, _U63 = np.uint64(10), np.uint64(52), np.uint64(63)
_ONES = np.uint64(2**64 - 1)
_MASK = np.uint64((2**64 - 1) >> 55)
_HIDDEN = np.uint64(1 << 52)
_NINETEEN = 19


@intrinsic
def _bits(_context: Any, _value: Any) -> Any:
    """Bits of a double as an integer."""

    def build(_c: Any, builder: Any, _s: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), build


@intrinsic
def _high(_context: Any, _a: Any, _b: Any) -> Any:
    """Upper half of a 64 × 64 bit product."""

    def build(_c: Any, builder: Any, _s: Any, args: Any) -> Any:
        wide = ir.IntType(128)
        a, b = (builder.zext(x, wide) for x in args)
        return builder.trunc(builder.lshr(builder.mul(a, b), wide(64)), ir.IntType(64))

    return types.uint64(types.uint64, types.uint64), build


@intrinsic
def _leading_zeros(_context: Any, _w: Any) -> Any:
    """Count the zero bits above the highest one of w > 0."""

    def build(_c: Any, builder: Any, _s: Any, args: Any) -> Any:
        return builder.ctlz(args[0], ir.IntType(1)(1))

    return types.int64(types.uint64), build


@njit(cache=True)
def bits_of(w: Any, q: int, fives: NDArray[np.uint64]) -> tuple[bool, Any]:
    """Bits of the double nearest to w · 10**q, w > 0; False where the caller has to find it."""
    if q < _LOWEST or q > _HIGHEST:
        return False, _U0
    zeros = _leading_zeros(w)
    w = w << np.uint64(zeros)
    five = fives[q - _LOWEST, 0]
    high, low = _high(w, five), w * five
    if high & _MASK == _MASK:
        more = _high(w, fives[q - _LOWEST, 1])
        low = low + more
        if more > low:
            high = high + _U1
    upper = high >> _U63
    shift = upper + np.uint64(9)
    mantissa = high >> shift
    exponent = ((217706 * q) >> 16) + 63 + np.int64(upper) - zeros + 1023
    if exponent <= 0:
        return False, _U0
    if low <= _U1 and -4 <= q <= 23 and mantissa & _U3 == _U1 and mantissa << shift == high:
        mantissa = mantissa & ~_U1
    mantissa = (mantissa + (mantissa & _U1)) >> _U1
    if mantissa >= _HIDDEN << _U1:
        mantissa = _HIDDEN
        exponent += 1
    if exponent >= 2047:
        return False, _U0
    return True, (mantissa & ~_HIDDEN) | (np.uint64(exponent) << _U52)


@njit(cache=True)
def number(
    data: NDArray[np.uint8], at: int, stop: int, decimal: np.uint8, tens: NDArray[np.float64],
    fives: NDArray[np.uint64],
) -> tuple[int, Any, int]:  # fmt: skip
    """Read one number.

    Parameters
    ----------
    data : NDArray[np.uint8]
        Text.
    at, stop : int
        Where the number begins, and where the text ends.
    decimal : np.uint8
        Decimal sign.
    tens, fives : NDArray
        `TENS` and `FIVES`.

    Returns
    -------
    tuple[int, int, int]
        `BAD`, `INTEGER`, `FLOAT` or `HARD`; the integer, or the bits of the double; the first byte behind the number.
    """
    i = at
    negative = False
    if i < stop and (data[i] == 45 or data[i] == 43):
        negative = data[i] == 45
        i += 1
    w = _U0
    digits = 0  # significant ones taken into w
    dropped = 0  # integer digits that w has no room for
    q = 0
    inexact = False
    first = i
    while i < stop:
        d = data[i] - np.uint8(48)
        if d > 9:
            break
        if digits < _NINETEEN:
            w = w * _U10 + np.uint64(d)
            if w != _U0:
                digits += 1
        else:
            dropped += 1
            inexact |= d != 0
        i += 1
    count = i - first
    whole = True
    if i < stop and data[i] == decimal:
        whole = False
        i += 1
        first = i
        while i < stop:
            d = data[i] - np.uint8(48)
            if d > 9:
                break
            if digits < _NINETEEN:
                w = w * _U10 + np.uint64(d)
                if w != _U0:
                    digits += 1
                q -= 1
            else:
                inexact |= d != 0
            i += 1
        count += i - first
    if count == 0:
        return BAD, 0, i
    if i < stop and (data[i] | 32) == 101:
        whole = False
        j = i + 1
        minus = False
        if j < stop and (data[j] == 45 or data[j] == 43):
            minus = data[j] == 45
            j += 1
        first = j
        e: Any = 0
        while j < stop:
            d = data[j] - np.uint8(48)
            if d > 9:
                break
            if e < 100_000:
                e = e * 10 + np.int64(d)
            j += 1
        if j == first:
            return BAD, 0, i
        q += -e if minus else e
        i = j
    if whole and dropped == 0 and w <= _ONES >> _U1 and not (negative and w == _U0):
        return INTEGER, -np.int64(w) if negative else np.int64(w), i
    q += dropped
    if w == _U0:
        return FLOAT, _bits(-0.0 if negative else 0.0), i
    if not inexact and w <= _HIDDEN << _U1 and -22 <= q <= 22:
        value = np.float64(w)
        value = value / tens[-q] if q < 0 else value * tens[q]
        return FLOAT, _bits(-value if negative else value), i
    good, bits = bits_of(w, q, fives)
    if good and inexact:
        good, above = bits_of(w + _U1, q, fives)
        good = good and above == bits
    if not good:
        return HARD, 0, i
    if negative:
        bits = bits | (_U1 << _U63)
    return FLOAT, np.int64(bits), i
