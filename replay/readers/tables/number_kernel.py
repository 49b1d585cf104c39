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
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from replay.arrays.compiling import njit

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

_ZEROS, _HIGH_HALVES, _SIXES = (np.uint64(int(d * 8, 16)) for d in ("30", "f0", "06"))
_PAIRS = np.uint64(0x000000FF000000FF)
_UPPER, _LOWER = np.uint64(1_000_000 * 2**32 + 100), np.uint64(10_000 * 2**32 + 1)
_U8, _U16 = np.uint64(8), np.uint64(16)
_THREES = np.uint64(int("33" * 8, 16))
_LARGEST, _EXACT = np.uint64(2**63 - 1), np.uint64(1 << 53)
_U32, _EIGHT = np.uint64(32), np.uint64(100_000_000)


@intrinsic
def _bits(_context: Any, _value: Any) -> Any:
    """Bits of a double as an integer."""

    def build(_c: Any, builder: Any, _s: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), build


@intrinsic
def byte_at(_context: Any, _data: Any, _at: Any) -> Any:
    """Byte of a contiguous array, without the check for places counted from the end."""

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, args[0])
        return builder.load(builder.gep(array.data, [args[1]]))

    return types.uint8(_data, types.int64), build


@intrinsic
def _eight_at(_context: Any, _data: Any, _at: Any) -> Any:
    """Eight bytes of a contiguous array as a little-endian number."""

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, args[0])
        place = builder.bitcast(builder.gep(array.data, [args[1]]), ir.IntType(64).as_pointer())
        return builder.load(place, align=1)

    return types.uint64(_data, types.int64), build


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


@njit(cache=True, no_cpython_wrapper=True)
def bits_of(w: Any, q: int) -> tuple[bool, Any]:
    """Bits of the double nearest to w · 10**q, w > 0; False where the caller has to find it."""
    if q < _LOWEST or q > _HIGHEST:
        return False, _U0
    zeros = _leading_zeros(w)
    w = w << np.uint64(zeros)
    five = FIVES[q - _LOWEST, 0]
    high, low = _high(w, five), w * five
    if high & _MASK == _MASK:
        more = _high(w, FIVES[q - _LOWEST, 1])
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


@njit(cache=True, no_cpython_wrapper=True)
def _settled(w: Any, q: int, negative: bool, inexact: bool) -> tuple[int, Any]:
    """Kind and bits of ±w · 10**q, w > 0, where more digits than w holds may follow (`inexact`)."""
    good, bits = bits_of(w, q)
    if good and inexact:
        good, above = bits_of(w + _U1, q)
        good = good and above == bits
    if not good:
        return HARD, np.int64(0)
    return FLOAT, np.int64(bits | (_U1 << _U63)) if negative else np.int64(bits)


@njit(cache=True, forceinline=True)
def number(data: NDArray[np.uint8], at: int, decimal: np.uint8) -> tuple[int, Any, int]:
    """Read one number.

    `data` of shape (bytes,).

    Parameters
    ----------
    data : NDArray[np.uint8]
        Text; it holds a line feed behind the number, and eight more bytes.
    at : int
        Where the number begins.
    decimal : np.uint8
        Decimal sign.

    Returns
    -------
    tuple[int, int, int]
        `BAD`, `INTEGER`, `FLOAT` or `HARD`; the integer, or the bits of the double; the first byte behind the number.
    """
    i = at
    d = byte_at(data, i)
    negative = d == 45
    if negative or d == 43:
        i += 1
    first = i
    w = _U0
    d = byte_at(data, i) - np.uint8(48)
    while d <= 9:
        w = w * _U10 + np.uint64(d)
        i += 1
        d = byte_at(data, i) - np.uint8(48)
    count = i - first
    q: Any = 0
    point = byte_at(data, i) == decimal
    if point:
        i += 1
        part = i
        eight = _eight_at(data, i)
        while ((eight & _HIGH_HALVES) | (((eight + _SIXES) & _HIGH_HALVES) >> np.uint64(4))) == _THREES:
            eight = eight - _ZEROS
            eight = eight * _U10 + (eight >> _U8)
            eight = ((eight & _PAIRS) * _UPPER + ((eight >> _U16) & _PAIRS) * _LOWER) >> _U32
            w = w * _EIGHT + eight
            i += 8
            eight = _eight_at(data, i)
        d = byte_at(data, i) - np.uint8(48)
        while d <= 9:
            w = w * _U10 + np.uint64(d)
            i += 1
            d = byte_at(data, i) - np.uint8(48)
        q = part - i
        count += i - part
    kind = BAD
    value: Any = np.int64(0)
    if count > 0:
        inexact = False
        dropped = 0
        if count > _NINETEEN:  # w may have run over: take 19 significant digits again
            w, dropped, inexact = _again(data, first, i, decimal)
            q += dropped
        whole = not point
        good = True
        if (byte_at(data, i) | 32) == 101:
            whole = False
            j = i + 1
            d = byte_at(data, j)
            minus = d == 45
            if minus or d == 43:
                j += 1
            digits = j
            e: Any = np.int64(0)
            d = byte_at(data, j) - np.uint8(48)
            while d <= 9:
                if e < 100_000:
                    e = e * 10 + np.int64(d)
                j += 1
                d = byte_at(data, j) - np.uint8(48)
            if j == digits:
                good = False
            else:
                q += -e if minus else e
                i = j
        if good:
            if whole and dropped == 0 and w <= _LARGEST and not (negative and w == _U0):
                kind, value = INTEGER, -np.int64(w) if negative else np.int64(w)
            elif w == _U0:
                kind, value = FLOAT, _bits(-0.0 if negative else 0.0)
            elif not inexact and w <= _EXACT and -22 <= q <= 22:
                real = np.float64(w)
                real = real / TENS[-q] if q < 0 else real * TENS[q]
                kind, value = FLOAT, _bits(-real if negative else real)
            else:
                kind, value = _settled(w, q, negative, inexact)
    return kind, value, i


@njit(cache=True, no_cpython_wrapper=True)
def _again(data: NDArray[np.uint8], at: int, stop: int, decimal: np.uint8) -> tuple[Any, int, bool]:
    """First 19 significant digits, how many digits were left out, and whether one of these is not zero."""
    w: Any = _U0
    digits = dropped = 0
    inexact = False
    for i in range(at, stop):
        if data[i] == decimal:
            continue
        d = data[i] - np.uint8(48)
        if digits < _NINETEEN:
            w = w * _U10 + np.uint64(d)
            if w != _U0:
                digits += 1
        else:
            dropped += 1
            inexact |= d != 0
    return w, dropped, inexact
