"""Installing the checkout itself (`pip install -e .`) compiles the numerical kernels, so that the first diagnosis need not.

numba keeps what it compiled beside the sources, for this machine's kind of processor; a wheel has none of it, since it
goes to other machines. Where the tool's own packages are not installed yet, the first diagnosis compiles as before.
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


class KernelHook(BuildHookInterface[Any]):
    """Diagnoses the sample log, and a simulated one of commands and speeds alone, once an editable wheel is made."""

    PLUGIN_NAME = "custom"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Compile; what goes wrong here costs time in the first diagnosis and nothing else."""
        samples = Path(self.root, "sample_logs")
        log, machine = samples / "three_faults.mcap", samples / "haulotte.toml"
        if version != "editable" or not log.exists():
            return
        self.app.display_info("compiling the numerical kernels, about half a minute")
        with TemporaryDirectory() as folder:
            own = Path(folder, "own.csv")
            words = ["simulate", "--scenario", "random", "--duration", "20", "--rate", "100", "--evidence", "base"]
            lines = [[self._diagnosis(log, Path(folder, "sample"), "-m", str(machine))]]
            if (
                os.cpu_count() or 1
            ) > 1:  # what a log without second measurements needs beyond that, by another processor
                lines.append([[*words, "-o", str(own)], self._diagnosis(own, Path(folder, "own"))])
            with ThreadPoolExecutor(len(lines)) as pool:
                if not all(list(pool.map(self._run, lines))):
                    self.app.display_info("not compiled now; the first diagnosis does it")

    @staticmethod
    def _diagnosis(log: Path, folder: Path, *words: str) -> list[str]:
        return ["diagnose", str(log), "-o", str(folder), "--fail-on", "never", *words]

    def _run(self, commands: list[list[str]]) -> bool:
        """Run commands one after the other; whether all ended well."""
        try:
            for command in commands:
                subprocess.run(
                    [sys.executable, "-m", "cli.main", "-q", *command],
                    cwd=self.root,
                    stdin=subprocess.DEVNULL,
                    capture_output=True,
                    timeout=_LIMIT_S,
                    check=True,
                )
        except (OSError, subprocess.SubprocessError):
            return False
        return True
