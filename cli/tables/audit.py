"""An audit in a few lines of the terminal, and as one JSON document."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import RenderableType
from rich.text import Text

from cli.tables.layout import bullets, key_values, section, table, text
from cli.tables.looks import verdict_style
from diagnosis.audit.store.outcome import ENDS, READ, MissionState
from diagnosis.results.vocabulary import Verdict

if TYPE_CHECKING:
    from diagnosis.audit.discovery.discover import Discovery
    from diagnosis.audit.plan import Planned
    from diagnosis.audit.session import Audited

SCHEMA = "mfhca-audit/1"
_VERDICTS = (Verdict.STOP, Verdict.WATCH, Verdict.READY, Verdict.NOT_ASSESSED)
_WORST_FIRST = (MissionState.CRASHED, MissionState.OUT_OF_MEMORY, MissionState.TIMEOUT, MissionState.UNREADABLE)
_SHOWN, _MACHINES = 10, 5


def plan_parts(rows: Sequence[tuple[Planned, str]], found: Discovery) -> list[RenderableType]:
    """List of missions with size and state."""
    cells = [(one.mission.name, _size(one.mission.bytes), one.problem or state) for one, state in rows]
    to_do = [one for one, state in rows if state == "to do"]
    total = _size(sum(one.mission.bytes for one in to_do))
    files = "file" if found.left_aside == 1 else "files"
    aside = f"; {found.left_aside} other {files} skipped" if found.left_aside else ""
    return [
        table(("mission", "size", "state"), cells, right=(1,)),
        "",
        text(f"{len(rows)} missions, {len(to_do)} to do ({total}){aside}"),
    ]


def summary_parts(audited: Audited, found: Discovery, output: Path) -> list[RenderableType]:
    """What failed, the worst machines, counts, and where the page is."""
    ends = audited.ends
    parts: list[RenderableType] = []
    failed = sorted((end for end in ends if end.state not in READ), key=lambda end: _WORST_FIRST.index(end.state))
    if failed:
        rows = [
            Text.assemble(text(e.state.words, "bold red"), f"  {e.name}  ", text(e.reason, "dim"))
            for e in failed[:_SHOWN]
        ]
        parts += [section("Failed"), bullets(rows)]
        if len(failed) > _SHOWN:
            parts.append(text(f"… and {len(failed) - _SHOWN} more", "dim"))
    machines: dict[str, Counter[str]] = {}
    for end in ends:
        if end.verdict in (Verdict.STOP, Verdict.WATCH):
            machines.setdefault(end.machine_id or end.machine_name, Counter())[end.verdict] += 1
    if machines:
        worst = sorted(machines.items(), key=lambda m: (-m[1][Verdict.STOP], -m[1][Verdict.WATCH], m[0]))
        rows_ = [(name, str(c[Verdict.STOP] or "–"), str(c[Verdict.WATCH] or "–")) for name, c in worst[:_MACHINES]]
        parts += [
            section("Worst machines"),
            table(("machine", *(v.short.lower() for v in (Verdict.STOP, Verdict.WATCH))), rows_, right=(1, 2)),
        ]
    verdicts: Counter[str | None] = Counter(end.verdict for end in ends)
    states: Counter[str] = Counter(end.state for end in ends)
    counted = [
        Text.assemble(f"{v.short.lower()}: ", (str(verdicts[v]), verdict_style(v))) for v in _VERDICTS if verdicts[v]
    ]
    counted += [text(f"{s.words}: {states[s]}") for s in ENDS if s not in READ and states[s]]
    parts += [section("Missions"), Text(" · ").join(counted)]
    notes = [f"{len(ends)} in all, {audited.skipped} of them from an earlier run"]
    notes += (
        [f"{states['degraded']} with damage or parts that cannot be judged"] if states[MissionState.DEGRADED] else []
    )
    parts.append(text(", ".join(notes), "dim"))
    if audited.gone:
        was = "mission that is" if audited.gone == 1 else "missions that are"
        parts.append(text(f"the fleet page also counts {audited.gone} {was} no longer there", "dim"))
    files: list[tuple[str, object]] = [("fleet page", output / "fleet.html")]
    if audited.failed:
        files.append(("failures", output / "failures.txt"))
    return [*parts, "", key_values(files)]


def document(audited: Audited, found: Discovery, output: Path, code: int) -> dict[str, object]:
    """The audit as a JSON document."""
    return {
        "schema": SCHEMA,
        "output": str(output),
        "page": str(output / "fleet.html"),
        "code": code,
        "skipped": audited.skipped,
        "gone": audited.gone,
        "counts": dict(Counter(end.state for end in audited.ends)),
        "verdicts": dict(Counter(end.verdict for end in audited.ends if end.verdict)),
        "problems": [*found.problems, *found.notes],
        "missions": [asdict(end) for end in audited.ends],
    }


def _size(count: float) -> str:
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.0f} {unit}" if unit == "B" or count >= 10 else f"{count:.1f} {unit}"
        count /= 1000
    return f"{count:.1f} TB"
