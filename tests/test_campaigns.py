"""What runs with `--long` alone: values beyond the first ones, and combinations that have no turn."""

from __future__ import annotations

from itertools import product

import pytest

from tests.campaigns import campaign, campaign_of_rows, long_ones

pytest_plugins = ["pytester"]


def test_the_first_values_are_in_every_run() -> None:
    for values in (campaign([1, 2, 3], 2), campaign_of_rows([(1, "a"), (2, "b"), (3, "c")], 2)):
        assert [[mark.name for mark in value.marks] for value in values] == [[], [], ["long"]]


def run_of(pytester: pytest.Pytester, source: str) -> set[tuple[object, ...]]:
    """Parameters of the tests that are in every run."""
    items, _ = pytester.inline_genitems(pytester.makepyfile(f"import pytest\n{source}"))
    left_out = set(long_ones(items))
    return {tuple(item.callspec.params.values()) for item in items if item not in left_out}  # type: ignore[attr-defined]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnknownMarkWarning")
@pytest.mark.parametrize(("rows", "values"), [(3, 2), (2, 3), (4, 4), (1, 3), (5, 1)])
def test_each_row_meets_a_value_and_each_value_a_row(pytester: pytest.Pytester, rows: int, values: int) -> None:
    source = (
        "@pytest.mark.turns('b')\n"
        f"@pytest.mark.parametrize('b', range({values}))\n"
        f"@pytest.mark.parametrize(('a', 'same'), [(k, 0) for k in range({rows})])\n"
        "def test_it(a, same, b): pass\n"
    )
    found = run_of(pytester, source)
    assert {a for a, *_ in found} == set(range(rows))
    assert {b for *_, b in found} == set(range(values))
    assert len(found) == max(rows, values) or min(rows, values) == 1


@pytest.mark.filterwarnings("ignore::pytest.PytestUnknownMarkWarning")
def test_every_combination_of_the_others_runs(pytester: pytest.Pytester) -> None:
    source = (
        "@pytest.mark.turns('c')\n"
        "@pytest.mark.parametrize('c', [0, 1])\n"
        "@pytest.mark.parametrize('b', [0, 1])\n"
        "@pytest.mark.parametrize('a', [0, 1, 2])\n"
        "def test_it(a, b, c): pass\n"
    )
    found = run_of(pytester, source)
    assert len(found) == 6
    assert {(a, b) for a, b, _ in found} == set(product(range(3), range(2)))
    assert {(b, c) for _, b, c in found} == set(product(range(2), range(2)))
