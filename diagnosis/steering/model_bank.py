"""The models of a steering axle: which rows of the two tables each combines, and which states it frees."""

from __future__ import annotations

import numpy as np

OK, STUCK, NONE, GAIN, NOISY, DRIFT = range(6)
# rows of sensor and actuator that a model combines; from `SECOND` on only where a second measurement tells them apart
SENSOR = np.array([0, 1, 2, 3, 4, 5, 0, 0, 0, 0, 3, 3, 3, 3, 4, 4, 4, 4, 1, 1, 1, 1, 2, 2, 2, 2, 5, 5, 5, 5])
ACTUATOR = np.array([0, 0, 0, 0, 0, 0, 3, 1, 2, 4, 3, 1, 2, 4, 3, 1, 2, 4, 3, 1, 2, 4, 3, 1, 2, 4, 3, 1, 2, 4])
SECOND = 18
MODELS = SENSOR.size
STATES = 6
# states that a model frees, φ, r and b first; the others have no variance
ACTIVE = np.array([[0, 1, 3, 2, 2, 2]] * MODELS)
FREE = np.full(MODELS, 3)
for _m in range(MODELS):
    for _i, _on in ((2, ACTUATOR[_m] in (GAIN, NOISY)), (4, SENSOR[_m] >= GAIN), (5, SENSOR[_m] in (1, 4, 5))):
        if _on:
            ACTIVE[_m, FREE[_m]] = _i
            FREE[_m] += 1
