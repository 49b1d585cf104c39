"""Collect the kernels that numba compiled for a common kind of processor, as a wheel brings them (`shipped_cache`).

`python -m replay.arrays.shipped_kernels CACHE FOLDER`, at the top of the sources: CACHE is the NUMBA_CACHE_DIR of the
runs that compiled, in an environment with `environment()`; FOLDER becomes the wheel's `replay/compiled`.
"""

from __future__ import annotations

import platform
import shutil
import sys
from pathlib import Path

from replay.arrays.shipped_cache import KINDS, PACKAGES, shipped_folder


def environment(cache: Path) -> dict[str, str]:
    """Variables with which numba compiles for this machine's common kind of processor; empty where none is known."""
    kind = KINDS.get(platform.machine())
    if kind is None:
        return {}
    return {
        "NUMBA_CACHE_DIR": str(cache),
        "NUMBA_CPU_NAME": kind.name,
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_DISABLE_INTEL_SVML": "1",  # a library that the wheel's users may not have
    }


def collect(cache: Path, root: Path, folder: Path) -> int:
    """Copy the kernels of our packages out of numba's folder.

    Parameters
    ----------
    cache : Path
        What `NUMBA_CACHE_DIR` named.
    root : Path
        Folder of the sources that were run, with the packages in it.
    folder : Path
        Where to; one folder below it for each package.

    Returns
    -------
    int
        Number of files.
    """
    from numba.core.caching import UserProvidedCacheLocator

    count = 0
    for package in PACKAGES:
        for init in sorted((root / package).rglob("__init__.py")):
            found = cache / UserProvidedCacheLocator.get_suitable_cache_subpath(str(init))
            module = ".".join(init.relative_to(root).with_suffix("").parts)
            kernels = [f for f in sorted(found.iterdir()) if f.suffix in (".nbi", ".nbc")] if found.is_dir() else []
            for file in kernels:
                target = shipped_folder(module, folder)
                target.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(file, target / file.name)
            count += len(kernels)
    return count


if __name__ == "__main__":
    sys.exit(0 if collect(Path(sys.argv[1]), Path.cwd(), Path(sys.argv[2])) else 1)
