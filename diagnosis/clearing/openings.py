"""Whether the opening of a wheel's drive is a speed, as a valve's is and a torque's is not."""

from __future__ import annotations

import numpy as np

from diagnosis.clearing.cells import Cells
from diagnosis.clearing.limits import usual_limits
from diagnosis.clearing.measure import lowest_passed
from diagnosis.clearing.responses import LAG_S, MOVING, USUAL_TOP, Responses, largest

_ALIKE = 0.5  # of the limit: where half of the wheels deviate by more, openings tell little of speeds
#: Of the power of a speed, what its opening explains: on tuning machines 0.91 and more of a healthy valve's and 0.69 and less of a
#: torque's, and 0.56 and more of valves with wide dead bands.
_SURELY, _FOLLOWS = 0.8, 0.45


def speeds_follow_openings(cells: Cells, *, surely: bool = False) -> bool:
    """Whether any wheel's speed is a multiple of its opening, as a valve's is and a torque's is not; `surely`: as all healthy valves' were."""
    return _explained(cells) > (_SURELY if surely else _FOLLOWS)


def _explained(cells: Cells) -> float:
    """Share of the power of a wheel's speed that its opening explains, of the wheel of which it explains most [1]."""
    speed, command, opening = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied"))
    used = lowest_passed(np.where(np.isfinite(opening), opening, command), cells.dt, LAG_S)
    explained = []
    for v, u in zip(speed.T, used.T, strict=True):
        moves = (
            np.isfinite(v) & np.isfinite(u) & (np.abs(np.nan_to_num(v)) > MOVING * cells.machine.max_speed / USUAL_TOP)
        )
        v, u = v[moves], u[moves]
        power = float(u @ u) * float(v @ v)
        explained.append(float(u @ v) ** 2 / power if power > 0.0 else 1.0)
    return max(explained, default=1.0)


def openings_tell(cells: Cells, responses: Responses) -> bool:
    """Whether an opening is a speed: it explains nearly all of it, or enough while most wheels stay near what is usual."""
    explained = _explained(cells)
    if explained > _SURELY:  # several faulty wheels make no torque of the openings
        return True
    limit = usual_limits((True, True), cells.machine.limits.clear_at).below
    most = largest(np.abs(responses.windows))
    known = np.sort(most[np.isfinite(most)])
    alike = not known.size or known[(known.size - 1) // 2] <= _ALIKE * limit
    return bool(alike and explained > _FOLLOWS)
