"""filterpy's filter, loaded without what it does not need of SciPy."""

from __future__ import annotations

import subprocess
import sys

_ASKED = """
import sys
import numpy as np
from diagnosis.estimation.filterpy_loading import kalman_filter

kf = kalman_filter()(dim_x=2, dim_z=1)
kf.H = np.array([[1.0, 0.0]])
kf.predict()
kf.update(1.0)
print(float(kf.x[0, 0]), "scipy.stats" in sys.modules)
print(round(kf.log_likelihood, 6), "scipy.stats" in sys.modules)

from filterpy.kalman import KalmanFilter
from filterpy.stats import norm_cdf
print(KalmanFilter is kalman_filter(), round(float(norm_cdf((-1.0, 1.0), 0.0, 1.0)), 4))
"""


def test_the_filter_is_filterpys_and_densities_are_loaded_when_asked_for() -> None:
    done = subprocess.run([sys.executable, "-c", _ASKED], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["0.6666666666666666 False", "-1.634911 True", "True 0.6827"]


def test_where_scipy_stats_is_there_already_it_stays() -> None:
    words = "import scipy.stats, sys; from diagnosis.estimation.filterpy_loading import kalman_filter as k; k()"
    asked = f"{words}; print(sys.modules['scipy.stats'] is scipy.stats, hasattr(scipy.stats, 'norm'))"
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout == "True True\n"


_OTHERS = """
import sys
import numpy as np
from diagnosis.estimation.filterpy_loading import kalman_filter

kalman_filter()
left_out = ("scipy.stats", "scipy.ndimage", "scipy.linalg", "scipy.sparse", "scipy.sparse.linalg")
print([name for name in left_out if name in sys.modules])
from filterpy.discrete_bayes import predict
print(np.round(predict(np.array([0.0, 1.0, 0.0]), 1, np.array([0.1, 0.8, 0.1])), 6).tolist())
import scipy.ndimage, scipy.sparse.linalg
from scipy.ndimage import maximum_filter1d
print(maximum_filter1d(np.array([0.0, 1.0, 0.0]), 3).tolist(), scipy.sparse.linalg.norm(scipy.sparse.eye(4)))
"""


def test_images_and_sparse_matrices_are_loaded_when_asked_for() -> None:
    done = subprocess.run([sys.executable, "-c", _OTHERS], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[]", "[0.1, 0.1, 0.8]", "[1.0, 1.0, 1.0] 2.0"]
