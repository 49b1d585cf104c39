"""Linear algebra of kernels without `scipy.linalg`, which is whole where it is asked for."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.campaigns import campaign

_ASKED = """
import sys
from replay.arrays.linear_algebra import load_addresses
load_addresses()
import numpy as np
from numba import njit

@njit
def same(a):
    return {}

a = np.array([[2.0, 1.0], [0.0, 4.0]])
print(np.array_equal(same(a), a), "scipy.linalg" in sys.modules)
import scipy.linalg
from scipy.linalg import cython_blas, expm
from scipy.optimize import nnls
print(expm(np.zeros((2, 2))).tolist(), nnls(a, a @ [1.0, 2.0])[0].round(9).tolist(), cython_blas.__name__)
whole = scipy.linalg
load_addresses()
print(sys.modules["scipy.linalg"] is whole)
"""


@pytest.mark.parametrize(
    "product", campaign(["a @ np.eye(2)", "np.linalg.solve(a, a) @ a"])
)  # solving compiles for long
def test_kernels_multiply_and_solve_and_scipy_loads_the_rest_when_asked_for(product: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _ASKED.replace("{}", product)], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == [
        "True False",
        "[[1.0, 0.0], [0.0, 1.0]] [1.0, 2.0] scipy.linalg.cython_blas",
        "True",
    ]
