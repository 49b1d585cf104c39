"""How an audit's missions stand in the store after a run, what exit code they make, and what failed."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.plan import Planned
from diagnosis.audit.runner import absolute
from diagnosis.audit.store.folders import holds_report, write_whole
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.outcome import READ, MissionState
from diagnosis.audit.store.store import Store
from diagnosis.audit.store.stored import limit_of_row
from diagnosis.results.vocabulary import Severity, Verdict
from replay.log.file_types import part_of

FAILURES = "failures.txt"
NEVER = "never"
NOT_READ = 3
_FAULT, _CRASHED = 1, 70
_HIDDEN = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


@dataclass(frozen=True)
class Ending:
    """How a mission stands.

    Attributes
    ----------
    name : str
        Of the mission.
    state, reason : str
        As in `Outcome`.
    attempts : int
        Attempts so far.
    machine_id, machine_name : str
        Its machine.
    verdict : Verdict or None
        None where there is no report.
    title : str
        Verdict in words.
    report : str or None
        Folder of the report, relative to the output.
    faults : int
        Number of faults.
    severity : Severity or ""
        Of the worst fault; empty where there is none.
    """

    name: str
    state: MissionState
    reason: str
    attempts: int
    machine_id: str
    machine_name: str
    verdict: Verdict | None
    title: str
    report: str | None
    faults: int
    severity: Severity | Literal[""]
    limit: tuple[str, float] | None = None


def endings(store: Store, missions: Iterable[MissionSource]) -> list[Ending]:
    """Ends of missions, in the order of their names; those without a result are left out."""
    with store.database.decoding():
        return _endings(store, {mission.name: mission.files for mission in missions})


def _endings(store: Store, wanted: Mapping[str, Sequence[str]]) -> list[Ending]:
    faults: dict[int, list[Severity]] = {}
    for row in store.database.rows("SELECT result, severity FROM fault"):
        faults.setdefault(row[0], []).append(Severity(row[1]))
    columns = (
        "state",
        "reason",
        "attempts",
        "machine_id",
        "machine_name",
        "verdict",
        "title",
        "report",
        "limit_option",
        "limit_value",
        "no_log",
    )
    query = (
        f"SELECT m.name, r.id, r.log_hash, r.config_hash, r.version, {', '.join(f'r.{c}' for c in columns)} "
        "FROM mission m JOIN result r ON r.id = m.result ORDER BY m.name"
    )
    out = []
    for row in store.database.rows(query):
        if row["name"] in wanted:
            found = faults.get(row["id"], [])
            report, reason = row["report"], row["reason"]
            if report and not holds_report(store.folder / report, Key(*row[2:5])):
                report = None  # another result's is there
            if reason:
                reason = store.reason_for(row["id"], reason, wanted[row["name"]])
            out.append(
                Ending(
                    name=row["name"],
                    state=MissionState(row["state"]),
                    limit=limit_of_row(row),
                    reason=reason,
                    attempts=row["attempts"],
                    machine_id=row["machine_id"],
                    machine_name=row["machine_name"],
                    verdict=Verdict(row["verdict"]) if row["verdict"] is not None else None,
                    title=row["title"],
                    report=report,
                    faults=len(found),
                    severity=sorted(found, key=_rank)[-1] if found else "",
                )
            )
    return out


def _rank(severity: Severity) -> int:
    return severity.rank


def exit_code(ends: Iterable[Ending], fail_on: str) -> int:
    """Exit code of the worst mission: 0 no fault, 1 faults, 3 not read or not judged, 70 crashed.

    Parameters
    ----------
    ends : Iterable[Ending]
        The missions.
    fail_on : str
        Lowest severity that counts as a fault; ``never``: none does, nor a mission that could not be judged.
    """
    return max((_code(end, fail_on) for end in ends), default=0)


def _code(end: Ending, fail_on: str) -> int:
    if end.state == MissionState.CRASHED:
        return _CRASHED
    if end.state not in READ or (end.verdict == Verdict.NOT_ASSESSED and fail_on != NEVER):
        return NOT_READ
    serious = fail_on != NEVER and end.severity != "" and Severity(end.severity).rank >= Severity(fail_on).rank
    return _FAULT if serious else 0


def write_failures(output: Path, planned: Sequence[Planned], ends: Sequence[Ending], machine: Path | None) -> int:
    """Write ``failures.txt``: each mission that failed, why, and the command that shows it again.

    Returns
    -------
    int
        Number of missions that failed; the file is removed where there is none.

    Raises
    ------
    OutputError
        Where it cannot be written.
    """
    by_name = {one.mission.name: one for one in planned}
    lines = []
    for end in ends:
        if end.state not in READ and end.name in by_name:
            one = by_name[end.name]
            tried = "" if end.attempts == 1 else f", {end.attempts} attempts"
            lines.append(f"{end.name}: {end.state.words}{tried}: {_HIDDEN.sub('?', end.reason)}\n")
            lines.append(f"  {again(end, one, machine, output)}\n\n")
    path = output / FAILURES
    if lines:
        write_whole(path, "".join(lines).encode("utf-8", "surrogateescape"))
    else:
        path.unlink(missing_ok=True)
    return len(lines) // 2


def again(end: Ending, one: Planned, machine: Path | None, output: Path) -> str:
    """Command line that shows how a mission ended; where it met a limit, the audit of that mission with twice as much."""
    limit = end.limit
    if limit is None:
        return command(one, machine)
    option, value = limit
    words = ["mfhca", "audit", *(absolute(file) for file in one.mission.files), "--no-resume", option, f"{2 * value:g}"]
    words += _machine_words(one, machine)
    return " ".join(quoted(word) for word in [*words, "-o", absolute(str(output))])


def _machine_words(one: Planned, machine: Path | None) -> list[str]:
    file = str(machine) if machine is not None else one.mission.machine_file
    words = ["-m", absolute(file)] if file else []
    return [*words, "--machine-id", one.machine_id] if one.machine_id else words


def command(one: Planned, machine: Path | None) -> str:
    """Command line that diagnoses a mission by itself."""
    mission = one.mission
    if mission.problem:
        return " ".join(
            quoted(word) for word in ("mfhca", "audit", absolute(mission.files[-1]), "-o", f"{mission.name}-audit")
        )
    remote = any("://" in file for file in mission.files)
    parts = [part[::2] for file in mission.files if (part := part_of(Path(file).name)) is not None]
    words = ["mfhca", "audit" if remote or len(set(parts)) < len(parts) else "diagnose", "-v"]
    words += [absolute(file) for file in mission.files]
    words += [*_machine_words(one, machine), "-o", f"{mission.name}-report"]
    return " ".join(quoted(word) for word in words)


def quoted(word: str) -> str:
    """A word for a POSIX shell; bytes that no terminal should see are written out, as bash, zsh and ksh read them."""
    if not _HIDDEN.search(word):
        return shlex.quote(word)
    out: list[str] = []
    for byte in os.fsencode(word):
        printable = 0x20 <= byte < 0x7F and byte not in b"'\\"
        out.append(chr(byte) if printable else f"\\x{byte:02x}")
    return "$'" + "".join(out) + "'"
