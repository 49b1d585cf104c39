"""Oracle: Python's float(), which rounds correctly."""

from __future__ import annotations

import random
import struct

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from replay.readers.tables.number_kernel import BAD, FLOAT, HARD, INTEGER, number


def parsed(text: str, decimal: str = ".") -> tuple[int, float | int, int]:
    kind, value, end = number(np.frombuffer(text.encode() + b"\n" + bytes(16), np.uint8), 0, np.uint8(ord(decimal)))
    return kind, struct.unpack("d", struct.pack("q", value))[0] if kind == FLOAT else int(value), end


def check(text: str) -> int:
    """Compare with float() bit for bit; returns the kind."""
    kind, value, end = parsed(text)
    assert end == len(text)
    if kind == INTEGER:
        assert value == int(text)
    elif kind == FLOAT:
        assert struct.pack("d", value) == struct.pack("d", float(text)), text
    else:
        assert kind == HARD
    return kind


@given(st.floats(allow_nan=False, allow_infinity=False))
@example(5e-324)
@example(2.2250738585072014e-308)
@example(1.7976931348623157e308)
@example(9007199254740993.0)
@example(-0.0)
def test_every_double_comes_back(value: float) -> None:
    check(repr(value))


@given(st.integers(0, 10**25), st.integers(-345, 345))
def test_digits_and_exponents(digits: int, exponent: int) -> None:
    check(f"{digits}e{exponent}")


def test_random_numbers_of_logs_need_no_help() -> None:
    source = random.Random(5)
    texts = [f"{source.gauss(0, 100):.{source.randint(1, 17)}f}" for _ in range(3000)]
    texts += [repr(source.uniform(-1e-3, 1e-3)) for _ in range(3000)]
    assert {check(t) for t in texts} == {FLOAT}


def test_numbers_half_way_between_two_doubles() -> None:
    source = random.Random(7)
    for _ in range(3000):
        odd = 2 * (source.getrandbits(52) | 1 << 52) + 1
        check(f"{odd}.0")
        check(f"{odd}e{source.randint(-4, 24)}")
        check(f"{odd}.00000000000000000001")


@pytest.mark.parametrize(
    ("text", "kind", "value", "end"),
    [
        ("12;", INTEGER, 12, 2),
        ("-9223372036854775807", INTEGER, -(2**63) + 1, 20),
        ("9223372036854775808", FLOAT, 2.0**63, 19),
        ("-0", FLOAT, 0.0, 2),
        ("+.5", FLOAT, 0.5, 3),
        ("5.", FLOAT, 5.0, 2),
        ("1.5e", BAD, 0, 3),
        (".", BAD, 0, 1),
        ("-", BAD, 0, 1),
        ("", BAD, 0, 0),
        ("x1", BAD, 0, 0),
    ],
)
def test_forms(text: str, kind: int, value: float, end: int) -> None:
    assert parsed(text) == (kind, value, end)


def test_a_decimal_comma() -> None:
    assert parsed("-2,5E-05", ",") == (FLOAT, -2.5e-05, 8)
    assert parsed("1.5", ",") == (INTEGER, 1, 1)
