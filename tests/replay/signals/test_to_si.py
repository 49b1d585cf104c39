"""From recorded numbers to SI: what no sensor reads is missing."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from replay.arrays.column_store import ColumnStore
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.to_si import LARGEST, convert

NAME = "wheel.FR.v"


@pytest.mark.parametrize("block", [3, 1000])
def test_numbers_that_no_sensor_reads_are_missing_and_said(block: int) -> None:
    recorded = np.array([1.0, 1e300, -1e31, np.nan, np.inf, -2.0, LARGEST, 1e38])
    got = convert(
        NAME, (np.arange(8) * 10**6, recorded), SignalSource(column="v"), haulotte(), ColumnStore(block=block)
    )
    assert_array_equal(got.values, [1.0, np.nan, np.nan, np.nan, np.inf, -2.0, LARGEST, np.nan])
    assert got.notes == ("3 numbers beyond 1e+30 are no readings and were left out",)


def test_the_unit_counts_before_the_limit() -> None:
    stamps, recorded = np.arange(2) * 10**6, np.array([1e30, 1.0])
    assert (
        convert(NAME, (stamps, recorded), SignalSource(column="v", unit="km/h"), haulotte(), ColumnStore()).notes == ()
    )
