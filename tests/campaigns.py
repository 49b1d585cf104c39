"""Parameters over which a test repeats its proof: a few values in every run, all of them with `pytest --long` alone."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import pytest
from _pytest.mark.structures import ParameterSet


def campaign(values: Iterable[object], short: int = 1) -> list[ParameterSet]:
    """Values of a parameter, all after the first `short` marked as long."""
    return [pytest.param(value, marks=[pytest.mark.long] if k >= short else []) for k, value in enumerate(values)]


def campaign_of_rows(rows: Iterable[Sequence[object]], short: int = 1) -> list[ParameterSet]:
    """The same of parameters that go together: each row has a value of each."""
    return [pytest.param(*row, marks=[pytest.mark.long] if k >= short else []) for k, row in enumerate(rows)]


def long_ones(items: Sequence[pytest.Item]) -> list[pytest.Item]:
    """Tests that run with `--long` alone: by their mark, or as combinations that have no turn.

    `pytest.mark.turns("evidence")`: every combination of a test's other parameters runs with one value of this one, and
    of those that go together with it; all values have their turn, the next one wherever another parameter takes its next value.
    """
    found = [item for item in items if item.get_closest_marker("long")]
    marked = set(found)
    in_turn: defaultdict[str, list[pytest.Item]] = defaultdict(list)
    for item in items:
        if item not in marked and item.get_closest_marker("turns"):
            in_turn[item.nodeid.partition("[")[0]].append(item)
    for of_one in in_turn.values():
        places = _places(of_one)
        turns = 1 + min(max(own for own, _ in places), max(others for _, others in places))
        found += [item for item, (own, others) in zip(of_one, places, strict=True) if (own - others) % turns]
    return found


def _places(items: Sequence[pytest.Item]) -> list[tuple[int, int]]:
    """Which value of the parameter in turn each combination of one test has, and the sum of the same over the others."""
    (name,) = items[0].get_closest_marker("turns").args  # type: ignore[union-attr]
    together = [mark.args[0] for mark in items[0].iter_markers("parametrize")]
    groups = [names.replace(" ", "").split(",") if isinstance(names, str) else list(names) for names in together]
    in_turn = next(k for k, names in enumerate(groups) if name in names)
    seen: list[dict[str, int]] = [{} for _ in groups]
    places = []
    for item in items:
        params = item.callspec.params  # type: ignore[attr-defined]
        values = (repr([params[n] for n in names]) for names in groups)
        at = [known.setdefault(value, len(known)) for known, value in zip(seen, values, strict=True)]
        places.append((at[in_turn], sum(at) - at[in_turn]))
    return places
