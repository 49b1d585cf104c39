"""What became of a machine's faults since another of its missions, as a report keeps it.

The key ``previous`` of ``report.json`` holds the comparison without the older document, so that the page can be made
again from the newer result alone. ``older`` and ``newer`` go by the logs' clocks, not by the order of the arguments.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from diagnosis.comparison.compare import ComparedMission, Comparison, compare_reports, machine_difference
from diagnosis.results.result import to_json
from replay.errors import ConfigError

THIS, OTHER = "this mission", "the other mission"


def with_previous(report: Mapping[str, Any], previous: Mapping[str, Any], name: str = "") -> dict[str, Any]:
    """Give a report with the comparison with another mission of the same machine under the key ``previous``.

    Parameters
    ----------
    report : Mapping[str, Any]
        Document of the mission, as in ``report.json``.
    previous : Mapping[str, Any]
        Document of the other mission.
    name : str
        What to call the other result in an error.

    Returns
    -------
    dict[str, Any]
        `report` with ``previous``: ``order`` (``earlier``, or ``later`` where the other mission was recorded after
        this one), ``mission`` (the other one), ``worse``, ``counts``, ``faults``, ``coverage`` (what changed),
        ``loss`` (ε̂ of each part in both), ``notes``.

    Raises
    ------
    ConfigError
        Where the other result is of another machine.
    LogError
        Where a document lacks what every report holds.
    """
    require_same_machine(report.get("machine") or {}, previous, name or "the previous result")
    later = _start(previous) > _start(report) > 0
    pair = (report, previous) if later else (previous, report)
    names = (THIS, OTHER) if later else (OTHER, THIS)
    found = compare_reports(*pair, names, force=True)
    return {**report, "previous": _compact(found, pair, later)}


def require_same_machine(machine: Mapping[str, Any], previous: Mapping[str, Any], name: str) -> None:
    """Refuse a result of another machine.

    Parameters
    ----------
    machine : Mapping[str, Any]
        ``id`` and ``wheels`` of this mission's machine.
    previous : Mapping[str, Any]
        Document of the other mission.
    name : str
        What to call it.

    Raises
    ------
    ConfigError
        Where ids or wheels differ.
    """
    difference = machine_difference(machine, previous.get("machine") or {}, (THIS, name))
    if difference:
        raise ConfigError(f"--previous {difference}; give a result of the same machine")


def _start(report: Mapping[str, Any]) -> int:
    return int((report.get("log") or {}).get("start_ns") or 0)


def _compact(found: Comparison, pair: tuple[Mapping[str, Any], Mapping[str, Any]], later: bool) -> dict[str, Any]:
    other: ComparedMission = found.newer if later else found.older
    mission = {k: v for k, v in to_json(other).items() if k != "name"}
    return {
        "order": "later" if later else "earlier",
        "mission": mission,
        "worse": found.worse,
        "counts": {name: n for name, n in found.counts.items() if n},
        "faults": [to_json(c) for c in found.faults],
        "coverage": [to_json(c) for c in found.coverage if c.change],
        "loss": _losses(*pair),
        "notes": list(found.notes),
    }


def _losses(older: Mapping[str, Any], newer: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Mission-wide ε̂ of the parts for which both missions have one."""
    before, now = (
        {(str(x["component"]), str(x["side"])): x.get("epsilon") for x in r.get("loss") or ()} for r in (older, newer)
    )
    return [
        {"component": c, "side": side, "older": before[c, side], "newer": e}
        for (c, side), e in now.items()
        if e and before.get((c, side))
    ]
