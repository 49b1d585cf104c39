"""What was counted of each format: as a table, as a line on the way, and as a file."""

from __future__ import annotations

import json
import os
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from replay.atomic_write import atomic_path

BAD = ("foreign", "crash", "hang", "waited", "memory", "silent", "shape", "peer")


@dataclass
class Score:
    """What was counted of one format.

    Attributes
    ----------
    inputs : int
        Inputs that were read to their end, or ended their worker.
    cpu_s, slowest_s : float
        Time of a processor in the readers alone: of all inputs, and of the slowest [s].
    outcomes, findings : Counter[str]
        Inputs by what became of them, and findings by what those of one cause share.
    """

    inputs: int = 0
    cpu_s: float = 0.0
    slowest_s: float = 0.0
    outcomes: Counter[str] = field(default_factory=Counter)
    findings: Counter[str] = field(default_factory=Counter)


def table(scores: dict[str, Score]) -> str:
    """What was counted, a line for each format."""
    words = sorted({word for score in scores.values() for word in score.outcomes}, key=lambda w: (w in BAD, w))
    lines = [f"{'format':12}{'inputs':>9}" + "".join(f"{word:>10}" for word in words) + f"{'CPU s':>9}{'slowest':>9}"]
    rows = [(name, score.inputs, score.outcomes, score.cpu_s, score.slowest_s) for name, score in scores.items()]
    whole = sum((score.outcomes for score in scores.values()), Counter[str]())
    rows.append(("all", inputs(scores), whole, cpu(scores), max((s.slowest_s for s in scores.values()), default=0.0)))
    for name, count, outcomes, cpu_s, slowest_s in rows:
        cells = "".join(f"{outcomes[word]:10}" for word in words)
        lines.append(f"{name:12}{count:9}{cells}{cpu_s:9.1f}{slowest_s:9.2f}")
    return "\n".join(lines)


def inputs(scores: dict[str, Score]) -> int:
    """Inputs of all formats."""
    return sum(score.inputs for score in scores.values())


def cpu(scores: dict[str, Score]) -> float:
    """Time of a processor in the readers, of all formats [s]."""
    return sum(score.cpu_s for score in scores.values())


class Progress:
    """Says at intervals how far a run is, and keeps it in a file that is always whole.

    Parameters
    ----------
    every_s : float
        Between two lines; 0: no lines, and no file before the end [s].
    path : Path or None
        Of the file; None: none.
    facts : dict[str, Any]
        What is to stand in the file beside the counts.
    """

    def __init__(self, every_s: float, path: Path | None, facts: dict[str, Any]) -> None:
        self._every_s, self._path, self._facts = every_s, path, facts
        self._start = self._last = time.monotonic()
        self._inputs = 0

    def tell(self, scores: dict[str, Score], cpu_s: Callable[[], float], state: str = "running") -> None:
        """Say it where it is time for it, or the run is no longer ``running``; `cpu_s` gives what all took of a processor [s]."""
        now = time.monotonic()
        if state == "running" and (not self._every_s or now - self._last < self._every_s):
            return
        count, since = inputs(scores), now - self._start
        rate = (count - self._inputs) / max(now - self._last, 1e-3) if state == "running" else count / max(since, 1e-3)
        self._last, self._inputs = now, count
        found = sum(sum(score.findings.values()) for score in scores.values())
        load = os.getloadavg()[0]
        if self._every_s:
            words = f"{since:.0f} s, {count} inputs ({rate:.0f} a second), {found} findings, load {load:.1f}, {state}"
            print(words, file=sys.stderr, flush=True)
        if self._path is None:
            return
        formats = {
            name: {
                "inputs": score.inputs, "reading_cpu_s": round(score.cpu_s, 3), "slowest_s": round(score.slowest_s, 3),
                "outcomes": dict(score.outcomes), "findings": dict(score.findings),
            }
            for name, score in scores.items()
        }  # fmt: skip
        document = {
            **self._facts, "state": state, "inputs": count, "findings": found, "wall_s": round(since, 1), "load": round(load, 2),
            "reading_cpu_s": round(cpu(scores), 1), "whole_cpu_s": round(cpu_s(), 1), "formats": formats,
        }  # fmt: skip
        with atomic_path(self._path) as part:
            part.write_text(json.dumps(document, indent=1), encoding="utf-8")
