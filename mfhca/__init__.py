"""Replay and diagnose the logs of heavy-duty wheeled machines from Python.

>>> import mfhca
>>> result = mfhca.diagnose("sample_logs/spool.mcap")
>>> result.faults[["component", "side", "mode", "start_s", "stop_s"]]

`diagnose` and `read_result` give a `Diagnosis`: verdict, tables of faults, states and signals, figures, and files. `read_log`
gives a log's channels as recorded. `simulate` and `inject` write logs with known faults, `evaluate` compares a diagnosis with
them, `audit` goes through a folder of missions, `load_machine` reads a machine file. Paths are text or `pathlib.Path`.
Errors are `MfhcaError` and what stands below it, with the sentence that the command line shows; see ``docs/python.md``.

Everything is loaded when it is first used, so that the import itself takes no time.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from replay.version import __version__

if TYPE_CHECKING:
    from diagnosis.api.auditing import Audit, audit
    from diagnosis.api.diagnosing import diagnose, load_machine, read_result
    from diagnosis.api.evaluating import Evaluation, evaluate
    from diagnosis.api.injecting import inject
    from diagnosis.api.logs import Log, read_log
    from diagnosis.api.result import Diagnosis
    from diagnosis.api.simulating import MadeLog, simulate
    from diagnosis.api.verdict import Verdict
    from replay.errors import ConfigError, LogError, MfhcaError, NotJudged, OutputError
    from replay.machine.config import Machine

__all__ = [
    "Audit",
    "ConfigError",
    "Diagnosis",
    "Evaluation",
    "Log",
    "LogError",
    "Machine",
    "MadeLog",
    "MfhcaError",
    "NotJudged",
    "OutputError",
    "Verdict",
    "__version__",
    "audit",
    "diagnose",
    "evaluate",
    "inject",
    "load_machine",
    "read_log",
    "read_result",
    "simulate",
]

_HOMES = {
    "diagnosis.api.auditing": ("Audit", "audit"),
    "diagnosis.api.diagnosing": ("diagnose", "load_machine", "read_result"),
    "diagnosis.api.evaluating": ("Evaluation", "evaluate"),
    "diagnosis.api.injecting": ("inject",),
    "diagnosis.api.logs": ("Log", "read_log"),
    "diagnosis.api.result": ("Diagnosis",),
    "diagnosis.api.simulating": ("MadeLog", "simulate"),
    "diagnosis.api.verdict": ("Verdict",),
    "replay.errors": ("ConfigError", "LogError", "MfhcaError", "NotJudged", "OutputError"),
    "replay.machine.config": ("Machine",),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    """Load what a name stands for, once."""
    if name not in _HOME:
        raise AttributeError(f"module 'mfhca' has no attribute {name!r}")
    from replay.arrays.kernel_cache import drop_own_stale_kernels

    drop_own_stale_kernels()
    found = globals()[name] = getattr(import_module(_HOME[name]), name)
    return found


def __dir__() -> list[str]:
    return __all__
