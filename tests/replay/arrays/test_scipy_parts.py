"""Modules of SciPy without their packages, which are whole where they are asked for."""

from __future__ import annotations

import subprocess
import sys

_ASKED = """
import sys
from replay.arrays.scipy_parts import part_of
import numpy as np
part = part_of("scipy.optimize", "_nnls")
print(part.nnls(np.eye(2), np.array([1.0, -1.0]))[0].tolist(), "scipy.optimize" in sys.modules)
import scipy.optimize
from scipy.optimize import least_squares, nnls
print(nnls(np.eye(2), np.array([1.0, -1.0]))[0].tolist(), least_squares(lambda x: x - 2.0, [0.0]).x.round(6).tolist())
print(part_of("scipy.optimize", "_nnls").nnls is nnls)
"""


def test_a_part_gives_what_the_package_gives_and_the_package_is_whole_afterwards() -> None:
    done = subprocess.run([sys.executable, "-c", _ASKED], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[1.0, 0.0] False", "[1.0, 0.0] [2.0]", "True"]


def test_the_package_stands_for_a_part_that_another_scipy_does_not_have() -> None:
    asked = """
from replay.arrays.scipy_parts import part_of
print(part_of("scipy.optimize", "_no_such_module").nnls.__name__)
"""
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["nnls"]


def test_a_diagnosis_is_loaded_without_the_large_packages() -> None:
    packages = "('signal', 'stats', 'optimize', 'ndimage', 'interpolate', 'sparse')"
    asked = f"""
import sys
import diagnosis.output, diagnosis.pipeline
print([name for name in {packages} if "scipy." + name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
