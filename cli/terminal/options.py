"""Arguments and options that several commands share."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

Logs = Annotated[
    list[Path],
    typer.Argument(metavar="LOG", help="The files of one mission, e.g. a bag and a PLC export.", show_default=False),
]
MachineFile = Annotated[
    Path | None,
    typer.Option(
        "--machine",
        "-m",
        metavar="FILE",
        help="Machine file (TOML). Default: the paper's Haulotte, signals found automatically.",
        show_default=False,
    ),
]
Start = Annotated[
    float | None, typer.Option("--start", metavar="S", help="Start at this mission time [s].", show_default=False)
]
End = Annotated[
    float | None, typer.Option("--end", metavar="S", help="End at this mission time [s].", show_default=False)
]
Json = Annotated[bool, typer.Option("--json", help="One JSON document on stdout, all else on stderr.")]
MaxSize = Annotated[
    float,
    typer.Option("--max-size", metavar="MB", min=0.5, help="Largest size of the data in the page; faults come first."),
]
Previous = Annotated[
    Path | None,
    typer.Option(
        "--previous",
        metavar="RESULT",
        help="Earlier result of the same machine (folder or report.json) to compare with.",
        show_default=False,
    ),
]
OpenPage = Annotated[bool, typer.Option("--open", help="Open the report in the browser.")]


class FailOn(StrEnum):
    """Lowest severity that ends with exit code 1."""

    INFO = "info"
    LOW = "low"
    MEDIUM = "medium"
    HIGH = "high"
    NEVER = "never"
