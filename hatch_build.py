"""Installing or building compiles the numerical kernels, so that the first diagnosis need not.

The checkout installed in place (`pip install -e .`) diagnoses the sample log, and numba keeps what it compiled beside the
sources, for this machine's processor, where a run finds it whatever `NUMBA_CACHE_DIR` says then. A wheel brings the kernels compiled for a common kind of processor, in
`replay/compiled`; Python and numba must be those that made them. Nothing here can fail a build: what is not compiled now
is compiled by the first diagnosis. `MFHCA_KERNELS=0` in the environment compiles nothing.
"""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_LIMIT_S = 600
_SHIPPED = "replay/compiled"
# What a wheel's kernels are compiled by: a log of each kind of container, with the second measurements that it is to have.
_LOGS = (("a.mcap", "direct"), ("b.csv", "base"), ("c.bag", "spool"), ("d", "base"))


class KernelHook(BuildHookInterface[Any]):
    """Runs the tool's own commands while it is installed in place, or before a wheel is made."""

    PLUGIN_NAME = "custom"
    _work: TemporaryDirectory[str] | None = None  # a wheel's kernels, until it is made

    def dependencies(self) -> list[str]:
        """An isolated build of a wheel needs what the tool itself needs, to compile the kernels."""
        return [] if _is_off() else list(self.metadata.core.dependencies)

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile a wheel's kernels and put them into it."""
        if version != "standard" or self.target_name != "wheel" or _is_off():
            return
        self.app.display_info("compiling the numerical kernels for a wheel, about a minute")
        self._work = TemporaryDirectory()
        folder = Path(self._work.name)
        kernels = folder / "compiled"
        if self._compiled(folder, kernels):
            build_data["force_include"][str(kernels)] = _SHIPPED
        else:
            self.app.display_info("not compiled now; the first diagnosis does it")

    def _compiled(self, folder: Path, kernels: Path) -> bool:
        """Compile into a folder; whether all went well."""
        cache = folder / "cache"
        ask = f"from pathlib import Path; from replay.arrays.shipped_kernels import environment; e = environment(Path({str(cache)!r}))"
        lines = f"{ask}; print(*(f'{{k}}={{v}}' for k, v in e.items()), sep='\\n')"
        try:
            told = self._python("-c", lines).stdout.decode()
            variables = dict(line.split("=", 1) for line in told.splitlines() if line)
            if not variables:
                return False  # no common kind of this processor is known
            environment = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")} | variables
            # One after the other: two processes that compile one kernel for two kinds of arguments may mix them up.
            for name, evidence in _LOGS:
                log = folder / name
                form = [] if log.suffix else ["-f", "rosbag2"]
                self._tool(_simulation(log, evidence) + form, environment)
                self._tool(_diagnosis(log, folder / f"{log.stem}-report"), environment)
            self._python("-m", "replay.arrays.shipped_kernels", str(cache), str(kernels))
        except (OSError, subprocess.SubprocessError):
            return False
        return True

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Compile for the checkout; what goes wrong here costs time in the first diagnosis and nothing else."""
        if self._work is not None:
            self._work.cleanup()
        samples = Path(self.root, "sample_logs")
        log, machine = samples / "three_faults.mcap", samples / "haulotte.toml"
        if version != "editable" or not log.exists() or _is_off():
            return
        self.app.display_info("compiling the numerical kernels, about half a minute")
        with TemporaryDirectory() as folder:
            lines = [[_diagnosis(log, Path(folder, "sample"), "-m", str(machine))]]
            if (
                os.cpu_count() or 1
            ) > 1:  # what logs with fewer second measurements need beyond that, by another processor
                lines.append([*_made(Path(folder, "own.csv"), "base"), *_made(Path(folder, "spool.csv"), "spool")])
            with ThreadPoolExecutor(len(lines)) as pool:
                if not all(list(pool.map(self._run, lines))):
                    self.app.display_info("not compiled now; the first diagnosis does it")

    def _run(self, commands: list[list[str]]) -> bool:
        """Run commands one after the other; whether all ended well."""
        try:
            for command in commands:
                self._tool(command)
        except (OSError, subprocess.SubprocessError):
            return False
        return True

    def _tool(self, words: list[str], environment: dict[str, str] | None = None) -> None:
        """Run one command of the tool."""
        self._python("-m", "cli.main", "-q", *words, environment=environment)

    def _python(self, *words: str, environment: dict[str, str] | None = None) -> subprocess.CompletedProcess[bytes]:
        """Run Python at the top of the sources, which it finds there also where pipx asks for a safe path."""
        variables = dict(os.environ if environment is None else environment)
        variables.pop("PYTHONSAFEPATH", None)
        if environment is None:
            variables.pop("NUMBA_CACHE_DIR", None)  # beside the sources, where each run looks
        return subprocess.run(
            [sys.executable, *words],
            cwd=self.root,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_LIMIT_S,
            check=True,
            env=variables,
        )


def _is_off() -> bool:
    return os.environ.get("MFHCA_KERNELS") == "0"


def _simulation(log: Path, evidence: str) -> list[str]:
    words = ["simulate", "--scenario", "random", "--duration", "20", "--rate", "100", "--evidence", evidence]
    return [*words, "-o", str(log)]


def _diagnosis(log: Path, folder: Path, *words: str) -> list[str]:
    return ["diagnose", str(log), "-o", str(folder), "--fail-on", "never", *words]


def _made(log: Path, evidence: str) -> list[list[str]]:
    """A mission is simulated and diagnosed beside it."""
    return [_simulation(log, evidence), _diagnosis(log, log.with_suffix(""))]
