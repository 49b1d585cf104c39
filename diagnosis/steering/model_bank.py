"""The models of a steering axle: which rows of the two tables each combines."""

from __future__ import annotations

import numpy as np

from replay.faults import FaultMode, Side

# codes of this bank alone; `COLOURED` is the noisy sensor with noise that changes fast
HEALTHY, STUCK, NO_SIGNAL, INEFFICIENT, NOISY, COLOURED = range(6)

#: Fault mode of each filter's row, by side; a row that is not here is healthy.
MODES: dict[tuple[Side, int], FaultMode] = {
    (Side.SENSOR, STUCK): FaultMode.STUCK,
    (Side.SENSOR, NO_SIGNAL): FaultMode.NO_SIGNAL,
    (Side.SENSOR, INEFFICIENT): FaultMode.INEFFICIENT,
    (Side.SENSOR, NOISY): FaultMode.NOISY,
    (Side.SENSOR, COLOURED): FaultMode.NOISY,
    (Side.ACTUATOR, STUCK): FaultMode.STUCK,
    (Side.ACTUATOR, NO_SIGNAL): FaultMode.NO_SIGNAL,
    (Side.ACTUATOR, INEFFICIENT): FaultMode.INEFFICIENT,
    (Side.ACTUATOR, NOISY): FaultMode.NOISY,
}

_SENSOR_FAULTS = (STUCK, NO_SIGNAL, INEFFICIENT, NOISY, COLOURED)
_VALVE_FAULTS = (INEFFICIENT, STUCK, NO_SIGNAL, NOISY)
_SINGLE = [(HEALTHY, HEALTHY), *((s, HEALTHY) for s in _SENSOR_FAULTS), *((HEALTHY, a) for a in _VALVE_FAULTS)]
_DOUBLE = [(s, a) for s in (INEFFICIENT, NOISY) for a in _VALVE_FAULTS]
_HIDDEN = [(s, a) for s in (STUCK, NO_SIGNAL, COLOURED) for a in _VALVE_FAULTS]
_MODELS = [*_SINGLE, *_DOUBLE, *_HIDDEN]

#: Row of the sensor and of the valve that each model combines.
SENSOR = np.array([sensor for sensor, _ in _MODELS])
ACTUATOR = np.array([actuator for _, actuator in _MODELS])
MODELS = len(_MODELS)
#: Models that have nothing to learn: of the healthy axle, and of the sensor without signal.
HEALTHY_MODEL = _MODELS.index((HEALTHY, HEALTHY))
NO_SIGNAL_MODEL = _MODELS.index((NO_SIGNAL, HEALTHY))
#: From this model on only a redundant measurement tells the two faults apart.
FIRST_HIDDEN = len(_SINGLE) + len(_DOUBLE)
STATES = 6
