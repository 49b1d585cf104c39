"""Single modules of SciPy, without the packages that they stand in.

`scipy.optimize` loads two hundred modules, whatever is asked of it: a sixteenth of a short diagnosis for one function.
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType


def part_of(package: str, name: str) -> ModuleType:
    """One module of a package, under a name of its own: whoever imports the package meanwhile or later gets it whole.

    Where SciPy is another one than expected, the package itself, which has its public names too.

    Parameters
    ----------
    package : str
        Such as ``scipy.optimize``.
    name : str
        A module in it that needs nothing of the package but modules beside it.
    """
    known = sys.modules.get(f"{package}.{name}")
    if known is not None:
        return known
    alias = f"_parts_of_{package.replace('.', '_')}"
    try:
        import scipy

        stand_in = ModuleType(alias)
        stand_in.__path__ = [str(Path(folder, *package.split(".")[1:])) for folder in scipy.__path__]
        sys.modules.setdefault(alias, stand_in)
        return import_module(f"{alias}.{name}")
    except ImportError:
        return import_module(package)
