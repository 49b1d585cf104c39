"""An audit in a few lines of the terminal, and as one JSON document."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import RenderableType
from rich.text import Text

from cli.tables.layout import bullets, key_values, section, table, text
from cli.tables.looks import verdict_style
from diagnosis.audit.store.outcome import ENDS, READ, MissionState
from diagnosis.results.vocabulary import Leave, Verdict

if TYPE_CHECKING:
    from diagnosis.audit.discovery.discover import Discovery
    from diagnosis.audit.fleet.listed import ListedMachine
    from diagnosis.audit.plan import Planned
    from diagnosis.audit.session import Audited

SCHEMA = "mfhca-audit/1"
_VERDICTS = (Verdict.STOP, Verdict.WATCH, Verdict.READY, Verdict.NOT_ASSESSED)
_WORST_FIRST = (MissionState.CRASHED, MissionState.OUT_OF_MEMORY, MissionState.TIMEOUT, MissionState.UNREADABLE)
_LEAVES = {Leave.MUST_NOT: Verdict.STOP, Leave.CHECK: Verdict.NOT_ASSESSED, Leave.MAY: Verdict.READY}
_SHOWN, _MACHINES, _FAULTS = 10, 20, 2
_NAMED = 5  # missions


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
    """What failed, the machines, counts, and where the page is."""
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
    parts += [*leave_parts(audited.machines), *machine_parts(audited.machines)]
    verdicts: Counter[str | None] = Counter(end.verdict for end in ends)
    states: Counter[str] = Counter(end.state for end in ends)
    counted = [
        Text.assemble(f"{v.group.lower()}: ", (str(verdicts[v]), verdict_style(v))) for v in _VERDICTS if verdicts[v]
    ]
    counted += [text(f"{s.words}: {states[s]}") for s in ENDS if s not in READ and states[s]]
    parts += [section("Missions"), Text(" · ").join(counted)]
    notes = [f"{len(ends)} in all, {audited.skipped} of them from an earlier run"]
    notes += [f"{states['degraded']} with damage, or in part left out"] if states[MissionState.DEGRADED] else []
    parts.append(text(", ".join(notes), "dim"))
    damaged = [end.name for end in ends if end.state is MissionState.DEGRADED]
    parts += _named("damaged, or in part left out", damaged)
    told = {end.name for end in ends} - set(damaged)
    in_part = [name for m in audited.machines for name in m.in_part if name in told]
    parts += _named("not every part of a wheel judged long enough", in_part)
    parts += [
        text(f"copies of one log, which count once: {', '.join(same)}", "dim") for same in _copies(audited)[:_NAMED]
    ]
    if audited.gone:
        was = "mission that is" if audited.gone == 1 else "missions that are"
        parts.append(text(f"the fleet page also counts {audited.gone} {was} no longer there", "dim"))
    files: list[tuple[str, object]] = [("fleet page", output / "fleet.html")]
    if audited.failed:
        files.append(("failures", output / "failures.txt"))
    return [*parts, "", key_values(files)]


def _named(what: str, names: Sequence[str]) -> list[RenderableType]:
    """A line with the first of some missions; none where there are none."""
    rest = len(names) - _NAMED
    more = f" and {rest} more" if rest > 0 else ""
    return [text(f"{what}: {', '.join(names[:_NAMED])}{more}", "dim")] if names else []


def _copies(audited: Audited) -> list[list[str]]:
    """Names of missions that are one log: they have one report, or lie in folders of several machines, where each has its own."""
    names: dict[str, list[str]] = defaultdict(list)
    first = {name: original for m in audited.machines for name, original in m.copies}
    reports = {end.report: first.get(end.name, end.name) for end in reversed(audited.ends) if end.report is not None}
    for end in audited.ends:
        if end.report is not None:
            names[first.get(end.name, reports[end.report])].append(end.name)
    return [same for same in names.values() if len(same) > 1]


def leave_parts(machines: Sequence[ListedMachine]) -> list[RenderableType]:
    """Which machines must not go out, which must be checked first, and which may: why, and by which mission."""
    parts: list[RenderableType] = []
    for leave, verdict in _LEAVES.items():
        mine = [m for m in machines if m.leave == leave]
        if not mine:
            continue
        parts.append(Text(f"{leave[:1].upper()}{leave[1:]} ({len(mine)})", style=verdict_style(verdict)))
        parts.append(
            bullets(
                [
                    Text.assemble(
                        text(m.label, "bold"),
                        f" – {m.reason}  ",
                        text(f"{m.lead} {m.mission}".strip(), "dim"),
                        text(f" ({m.note})" if m.note else ""),
                    )
                    for m in mine[:_MACHINES]
                ]
            )
        )
        if len(mine) > _MACHINES:
            parts.append(text(f"… and {len(mine) - _MACHINES} more on the fleet page", "dim"))
    return [section("Which machines may go out"), *parts] if parts else []


def machine_parts(machines: Sequence[ListedMachine]) -> list[RenderableType]:
    """The machines as the fleet page lists them: the same order, the same words."""
    if not machines:
        return []
    rows = []
    for m in machines[:_MACHINES]:
        more = [f"+{len(m.faults) - _FAULTS}"] if len(m.faults) > _FAULTS else []
        faults = "; ".join(m.faults[:_FAULTS]) + "".join(f" {w}" for w in more)
        rows.append((m.label, text(m.words, verdict_style(m.verdict)), faults or "–", f"{m.with_faults} of {m.judged}"))
    parts: list[RenderableType] = [
        section("Machines, worst first"),
        table(("machine", "now", "faults", "missions with faults"), rows, right=(3,)),
    ]
    if len(machines) > _MACHINES:
        parts.append(text(f"… and {len(machines) - _MACHINES} more on the fleet page", "dim"))
    return parts


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
        "machines": [asdict(m) for m in audited.machines],
        "missions": [asdict(end) for end in audited.ends],
    }


def _size(count: float) -> str:
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.0f} {unit}" if unit == "B" or count >= 10 else f"{count:.1f} {unit}"
        count /= 1000
    return f"{count:.1f} TB"
