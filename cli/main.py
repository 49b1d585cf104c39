"""The `mfhca` command: its commands, and the exit code of every way a run can end.

0 no fault, 1 faults found, 2 usage or configuration, 3 a log could not be read or judged, 70 internal error,
130 interrupted.
"""

from __future__ import annotations

import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import typer

from cli.commands import (
    audit,
    channels,
    compare,
    config,
    controllers,
    counterfactual,
    diagnose,
    evaluate,
    export,
    fit,
    inject,
    inspect,
    report,
    schema,
    simulate,
)
from cli.commands import replay as replay_command  # the package of that name is another thing
from cli.terminal.collecting import collect_little
from cli.terminal.command import USAGE, App, Command, Quiet, Verbose
from cli.terminal.console import Terminal, discard
from cli.terminal.interrupts import asked, check, forget, listen
from cli.terminal.leaving import leave
from replay.arrays.kernel_cache import drop_own_stale_kernels
from replay.errors import MfhcaError
from replay.version import __version__

INTERNAL, INTERRUPTED = 70, 130

app = typer.Typer(
    name="mfhca",
    cls=App,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="\b\nExit codes: 0 no fault · 1 faults found · 2 usage or configuration ·\n"
    "3 a log could not be read or judged · 70 internal error · 130 interrupted",
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mfhca-replay {__version__}")
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", "-V", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Replay the logs of a heavy-duty wheeled machine and find its sensor and actuator faults."""


_DIAGNOSE, _LOOK, _MAKE = "Diagnose", "Inspect logs", "Set up and try"
for _panel, _function, _name, _epilog in (
    (_DIAGNOSE, diagnose.diagnose, "diagnose", diagnose.EXAMPLES),
    (_DIAGNOSE, report.report, "report", report.EXAMPLES),
    (_DIAGNOSE, audit.audit, "audit", audit.EXAMPLES),
    (_DIAGNOSE, compare.compare, "compare", compare.EXAMPLES),
    (_DIAGNOSE, evaluate.evaluate, "evaluate", evaluate.EXAMPLES),
    (_LOOK, inspect.inspect, "inspect", inspect.EXAMPLES),
    (_LOOK, channels.channels, "channels", channels.EXAMPLES),
    (_LOOK, replay_command.replay_log, "replay", replay_command.EXAMPLES),
    (_LOOK, export.export, "export", export.EXAMPLES),
    (_DIAGNOSE, counterfactual.counterfactual, "counterfactual", counterfactual.EXAMPLES),
    (_MAKE, fit.fit, "fit", fit.EXAMPLES),
    (_MAKE, simulate.simulate, "simulate", simulate.EXAMPLES),
    (_MAKE, controllers.controllers, "evaluate controllers", controllers.EXAMPLES),
    (_MAKE, inject.inject, "inject", inject.EXAMPLES),
    (_MAKE, schema.schema, "schema", schema.EXAMPLES),
):
    app.command(_name, cls=Command, rich_help_panel=_panel, epilog=_epilog)(_function)
app.add_typer(config.app, name="config", rich_help_panel=_MAKE)


@cache
def _whole() -> Any:
    """All commands with their options; a process that runs several reads them from the functions once."""
    return typer.main.get_command(app)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command line and give its exit code; every error becomes one line on stderr."""
    terminal = Terminal()
    forget()
    try:
        result = _whole()(args=arguments, obj=terminal, standalone_mode=False, prog_name="mfhca")
        code = result if isinstance(result, int) else 0
        check()
        sys.stdout.flush()
        return code if code != INTERRUPTED else _interrupted(terminal)
    except (KeyboardInterrupt, typer.Abort):
        return _interrupted(terminal)
    except MfhcaError as error:
        terminal.error(error)
        return error.exit_code
    except BrokenPipeError:
        discard(sys.stdout)
        return 0
    except OSError as error:
        return _interrupted(terminal) if asked() else _system_error(terminal, error)
    except ModuleNotFoundError as error:
        return _missing_package(terminal, error)
    except Exception as error:
        if asked():  # what compiled code makes of it
            return _interrupted(terminal)
        if isinstance(error, typer.TyperException):
            return _usage_error(terminal, error)
        return _internal_error(terminal, error)


def _interrupted(terminal: Terminal) -> int:
    terminal.error("interrupted")
    return INTERRUPTED


def _usage_error(terminal: Terminal, error: typer.TyperException) -> int:
    """Print what is wrong and where to read on."""
    context = getattr(error, "ctx", None)  # of errors that know their command
    path = getattr(context, "command_path", "mfhca")
    message = error.format_message().replace("Value error, ", "")
    terminal.error(f"{message.rstrip('.')}; see `{path} --help`")
    return USAGE


def _system_error(terminal: Terminal, error: OSError) -> int:
    reason = "no such file" if isinstance(error, FileNotFoundError) else (error.strerror or str(error))
    if error.filename is None:
        if terminal.verbose:
            traceback.print_exc()
        terminal.error(f"cannot write or read: {reason}")
        discard(sys.stdout)
        return 2
    terminal.error(f"{error.filename}: {reason}")
    return 3


def _missing_package(terminal: Terminal, error: ModuleNotFoundError) -> int:
    """Say which package an update asks for; what is missing of the tool itself is an internal error."""
    if (error.name or "").partition(".")[0] in ("", "cli", "diagnosis", "replay"):
        return _internal_error(terminal, error)
    terminal.error(
        f"the package {error.name} is not installed; install what this version needs: "
        "`pip install --require-hashes -r requirements.lock` in its folder, or install mfhca-replay again"
    )
    return INTERNAL


def _internal_error(terminal: Terminal, error: Exception) -> int:
    if terminal.verbose:
        traceback.print_exc()
    hint = "" if terminal.verbose else "; run it again with -v and report what it prints"
    terminal.error(f"internal error: {type(error).__name__}: {error}{hint}")
    return INTERNAL


def main() -> None:
    """Entry of the installed command."""
    # Products of two or three columns gain nothing from threads of the linear algebra, which spin while they wait.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Looking for plugins of pydantic reads what every installed package says of itself.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    collect_little()
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # closed by the caller
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115 - for the whole run
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    listen()  # being asked to end removes unfinished files too
    drop_own_stale_kernels()
    leave(run())


if __name__ == "__main__":
    main()
