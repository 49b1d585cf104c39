"""`mfhca audit`: many missions, unattended."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from cli.commands.audit_forgotten import run_forget
from cli.commands.audit_repairs import RepairRequest, one_date, run_repairs
from cli.commands.audit_run import AuditRequest, run_audit
from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.options import FailOn, Json, MaxSize

EXAMPLES = """\b
Examples:
  mfhca audit logs/                                  # every mission below logs/, into mfhca-audit/
  mfhca audit logs/ -o night -m machine.toml -j 8    # again: only what is new or changed
  mfhca audit logs/ --dry-run
  mfhca audit s3://fleet/2026/ --dask tcp://scheduler:8786 --events events.jsonl
  mfhca audit --repaired "HX4-07 FR sensor" --on 2026-10-05   # close the faults of that part
  find logs -name '*.bag' -mtime -1 | mfhca audit - --json | jq .counts"""

OUTPUT = Path("mfhca-audit")


class TrendAxis(StrEnum):
    """What trends are drawn over."""

    HOURS = "hours"
    DAYS = "days"


Paths = Annotated[
    list[str] | None,
    typer.Argument(metavar="PATH", help="Folders, logs, globs, URLs, or - for names on stdin.", show_default=False),
]
Output = Annotated[
    Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the store, the fleet page and the reports.")
]
MachineFile = Annotated[
    Path | None,
    typer.Option(
        "--machine",
        "-m",
        metavar="FILE",
        help="Machine file (TOML) of all missions. Default: the machine.toml in or above each log's folder, else the paper's Haulotte.",
        show_default=False,
    ),
]
MachineId = Annotated[
    str | None,
    typer.Option(
        "--machine-id", metavar="ID", help="Id of the machine that all missions belong to.", show_default=False
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        "-j",
        metavar="N",
        min=1,
        help="Missions to diagnose at the same time. Default: one per processor.",
        show_default=False,
    ),
]
Memory = Annotated[
    float | None,
    typer.Option(
        "--memory",
        metavar="MB",
        min=16,
        help="Most memory for each mission. Default: 4096, or its share of the free memory.",
        show_default=False,
    ),
]
Timeout = Annotated[float, typer.Option("--timeout", metavar="S", min=0.1, help="Longest time for each mission [s].")]
Cpu = Annotated[
    float | None,
    typer.Option(
        "--cpu",
        metavar="S",
        min=1,
        help="Longest processor time for each mission [s]. Default: no limit.",
        show_default=False,
    ),
]
Retries = Annotated[
    int,
    typer.Option("--retries", metavar="N", min=0, help="Further attempts at a mission that crashed or met a limit."),
]
FailOnOrUnjudged = Annotated[
    FailOn,
    typer.Option(
        "--fail-on",
        help="Lowest severity that ends with code 1; with never, a log that is not judged counts as 0 too.",
    ),
]
Resume = Annotated[
    bool, typer.Option("--resume/--no-resume", help="Skip missions that are done and unchanged, or audit all again.")
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="List the missions and their state, and stop.")]
Events = Annotated[
    str | None,
    typer.Option(
        "--events", metavar="FILE", help="Add a line of JSON per event to FILE; - for stdout.", show_default=False
    ),
]
Baseline = Annotated[
    Path | None,
    typer.Option(
        "--baseline", metavar="STORE", help="Store or folder of an audit to compare with.", show_default=False
    ),
]
Trends = Annotated[TrendAxis, typer.Option("--trends", help="Trends over hours of driving or over days.")]
Export = Annotated[
    str | None,
    typer.Option("--export", metavar="FORMAT", help="Also write the store's tables: parquet.", show_default=False),
]
Dask = Annotated[
    str | None,
    typer.Option("--dask", metavar="ADDRESS", help="Scheduler of a Dask cluster to run on.", show_default=False),
]
Repaired = Annotated[
    list[str] | None,
    typer.Option(
        "--repaired",
        metavar="WORDS",
        help='Record a repair, "MACHINE PART" or "MACHINE PART sensor|actuator", and audit nothing; may be given again.',
        show_default=False,
    ),
]
NotRepaired = Annotated[
    list[str] | None,
    typer.Option("--not-repaired", metavar="WORDS", help="Take back a repair of that date.", show_default=False),
]
On = Annotated[
    list[str] | None,
    typer.Option(
        "--on",
        metavar="DATE",
        help="When it was repaired: 2026-10-05T14:30+02:00, '2026-10-05T14:30 Europe/Berlin' or '… local'; UTC without a zone.",
        show_default=False,
    ),
]
Forget = Annotated[
    list[str] | None,
    typer.Option(
        "--forget",
        metavar="MISSION",
        help="Leave out a log that was not judged and is no longer there, and audit nothing; may be given again.",
        show_default=False,
    ),
]


def audit(
    context: typer.Context,
    paths: Paths = None,
    output: Output = OUTPUT,
    machine: MachineFile = None,
    machine_id: MachineId = None,
    jobs: Jobs = None,
    memory: Memory = None,
    timeout: Timeout = 1800.0,
    cpu: Cpu = None,
    retries: Retries = 1,
    fail_on: FailOnOrUnjudged = FailOn.LOW,
    resume: Resume = True,
    dry_run: DryRun = False,
    json: Json = False,
    events: Events = None,
    baseline: Baseline = None,
    trends: Trends = TrendAxis.HOURS,
    export: Export = None,
    dask: Dask = None,
    max_size: MaxSize = 8.0,
    repaired: Repaired = None,
    not_repaired: NotRepaired = None,
    on: On = None,
    forget: Forget = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Diagnose a tree of logs: a report per mission and a page about the fleet; or record a repair."""
    repairs = RepairRequest(output, repaired or [], not_repaired or [], one_date(on), json, max_size)
    if forget and not (repaired or not_repaired):
        run_forget(terminal_of(context, json=json), output, forget, paths or [], json=json)
        return
    if repairs.is_asked(paths or []):
        run_repairs(terminal_of(context, json=json), repairs)
        return
    request = AuditRequest(
        paths=paths or [],
        output=output,
        machine=machine,
        machine_id=machine_id,
        jobs=jobs,
        memory_mb=memory,
        timeout_s=timeout,
        cpu_s=cpu,
        retries=retries,
        fail_on=fail_on,
        resume=resume,
        dry_run=dry_run,
        json=json,
        events=events,
        baseline=baseline,
        trends=trends.value,
        export=export,
        dask=dask,
        max_size_mb=max_size,
    )
    code = run_audit(terminal_of(context, json=json), request)
    if code:
        raise typer.Exit(code)
