from __future__ import annotations

import numpy as np
import pytest

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.tables.row_kernel import MISSING
from replay.readers.tables.time_cells import DC_EPOCH, FILETIME_EPOCH, TimeBase, epoch_ns, spread_seconds

SECOND = 1_000_000_000


def test_the_distributed_clock_counts_from_2000() -> None:
    base = TimeBase("dc", DC_EPOCH, "t", Report())
    assert base.stamps(np.array([0, 5, MISSING])).tolist() == [946_684_800 * SECOND, 946_684_800 * SECOND + 5, MISSING]


def test_a_32_bit_clock_is_unwrapped_across_blocks() -> None:
    report = Report()
    base = TimeBase("dc32", 0, "log.csv, column 'dc'", report)
    true = np.arange(5, 12_000_000_000, 400_000_000)
    raw = true % 2**32
    found = np.concatenate([base.stamps(raw[:7]), base.stamps(raw[7:8]), base.stamps(raw[8:])])
    assert found.tolist() == true.tolist()
    base.finish()
    assert any("starts again every 4.29 s" in n for n in report.notes)
    assert report.damage == []


def test_a_32_bit_clock_with_blanks_rows_out_of_order_and_a_gap() -> None:
    report = Report()
    base = TimeBase("dc32", 0, "log.csv", report)
    true = np.array([4_294_000_000, 4_295_000_000, 4_294_900_000, 4_296_000_000, 7_000_000_000])
    cells = np.insert(true % 2**32, 2, MISSING)
    assert base.stamps(cells).tolist() == [*true[:2], MISSING, *true[2:]]
    base.finish()
    assert any("1 of 6 rows have no readable time" in d for d in report.damage)
    assert any(
        "longest step is 2.70 s; a gap may have lasted longer by any multiple of 4.29 s" in d for d in report.damage
    )


def test_filetimes_as_integers_are_exact_and_as_doubles_told() -> None:
    ticks = np.array([133_000_000_000_000_001, 133_000_000_000_000_003])
    exact = ((ticks - FILETIME_EPOCH) * 100).tolist()
    assert TimeBase("filetime", 0, "t", Report()).stamps(ticks).tolist() == exact
    report = Report()
    base = TimeBase("filetime", 0, "t", report)
    assert np.abs(base.stamps(ticks.astype(float)) - exact).max() <= 1600
    base.finish()
    assert any("written as floating-point numbers" in n for n in report.notes)


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns", "filetime", "dc", "dc32", "dt"])
def test_absurd_cells_are_missing(unit: str) -> None:
    base = TimeBase(unit, 0, "t", Report())
    assert (base.stamps(np.array([2**63 - 1, -(2**63) + 1, MISSING])) == MISSING).all()
    assert (base.stamps(np.array([np.nan, np.inf, -1e300])) == MISSING).all()


def test_samples_of_one_second_are_spread_evenly() -> None:
    report = Report()
    stamps = np.repeat([10, 11, 12, 13], [2, 4, 4, 3]) * SECOND
    spread = spread_seconds(stamps, "log.csv, column 'dt'", report)
    assert (spread / SECOND).tolist() == [10.5, 10.75, 11, 11.25, 11.5, 11.75, 12, 12.25, 12.5, 12.75, 13, 13.25, 13.5]
    assert any("the 4 samples of each were spread evenly" in n for n in report.notes)


def test_one_sample_a_second_stays() -> None:
    stamps = np.array([1, 2, 4]) * SECOND
    assert spread_seconds(stamps, "t", Report()) is stamps


def test_uneven_seconds_are_refused() -> None:
    stamps = np.repeat([1, 2, 3, 4, 5], [3, 9, 2, 30, 4]) * SECOND
    with pytest.raises(LogError, match="whole seconds with 2 to 30 samples in each"):
        spread_seconds(stamps, "log.csv", Report())


def test_a_gap_of_rows_is_told() -> None:
    report = Report()
    stamps = np.repeat(np.arange(30), [10] * 7 + [4] + [10] * 22) * SECOND
    spread = spread_seconds(stamps, "log.csv", report)
    assert (np.diff(spread) > 0).all()
    assert any("1 seconds hold more or fewer than 10 samples" in d for d in report.damage)


@pytest.mark.parametrize("epoch", ["0001-01-01", "1601-01-01", "1899-12-31T23:59:59", "2101-01-01", "9999-12-31"])
def test_an_epoch_with_which_stamps_would_not_fit_is_refused(epoch: str) -> None:
    with pytest.raises(LogError, match=r"a\.csv: epoch = .* expected a date of the years 1900 to 2100"):
        epoch_ns(SourceOptions(epoch=epoch), "a.csv")


@pytest.mark.parametrize("epoch", ["1900-01-01", "2100-12-31T23:59:59"])
@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns", "dc", "dc32"])
def test_stamps_at_the_ends_of_the_range_fit(epoch: str, unit: str) -> None:
    zero = epoch_ns(SourceOptions(epoch=epoch), "a.csv")
    found = TimeBase(unit, zero, "t", Report()).stamps(np.array([-(2**62), 0, 2**62, 2**63 - 1, 1]))
    assert found[1] == zero
    assert (np.abs((found[found != MISSING] - zero).astype(np.float64)) <= 2.0**62).all()
