"""SciPy's function, loaded without its package."""

from __future__ import annotations

import subprocess
import sys

import pytest

_ALONE = """
import sys
from concurrent.futures import ThreadPoolExecutor
import numpy as np
from diagnosis.estimation.nnls_loading import non_negative_least_squares

with ThreadPoolExecutor(4) as pool:
    found = {*pool.map(lambda _: non_negative_least_squares(), range(8))}
a = np.array([[1.0, 2.0], [3.0, 1.0], [1.0, 1.0]])
mine = non_negative_least_squares()(a, a @ [1.0, -2.0])[0]
print(len(found), "scipy.optimize" in sys.modules)
from scipy.optimize import linprog, nnls
print(nnls is non_negative_least_squares(), mine.tolist() == nnls(a, a @ [1.0, -2.0])[0].tolist(), linprog([1.0], bounds=(2, 3)).fun)
"""
_BESIDE = """
import sys, scipy.optimize
from diagnosis.estimation.nnls_loading import non_negative_least_squares
print(non_negative_least_squares() is scipy.optimize.nnls)
"""
_OTHER = """
import sys
from diagnosis.estimation import nnls_loading
nnls_loading.EXTENSION_SUFFIXES[:] = [".none"]
print(nnls_loading.non_negative_least_squares()([[2.0]], [4.0])[0].tolist(), "scipy.optimize" in sys.modules)
"""


@pytest.mark.parametrize(
    ("asked", "said"),
    [(_ALONE, ["1 False", "True True 2.0"]), (_BESIDE, ["True"]), (_OTHER, ["[2.0] True"])],
    ids=["alone", "beside the package", "another SciPy"],
)
def test_it_is_scipys_function(asked: str, said: list[str]) -> None:
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == said
