"""What a missing signal costs the diagnosis."""

from __future__ import annotations

from replay.machine.signal_table import signal_of

# By signal, without its wheel or axle.
_COSTS = {
    "wheel.v_ref": "v_c,i is computed from v_c and ω_c by the kinematics; without those and a geometry there is no e and no Ψ̂",
    "wheel.v": "the speed sensor is not assessed, and the actuator only where its valve opening is measured (u_applied)",
    "wheel.v_true": "ε of the speed sensor rests on the wheel model instead of a second measurement",
    "wheel.u": "the actuator is not assessed, no Ψ̂ is implied, and without v_true the speed sensor only by whether it follows v_c,i",
    "wheel.u_applied": "ε of the actuator rests on the wheel model, and sensor and actuator loss are harder to tell apart",
    "wheel.psi": "nothing is judged by it; the replayed Ψ̂ has no recorded one beside it",
    "wheel.pressure_a": "nothing: pressures are shown beside the evidence and not judged",
    "wheel.pressure_b": "nothing: pressures are shown beside the evidence and not judged",
    "steer.phi_ref": "φ_c is computed from v_c and ω_c by the kinematics; without those the steering loop is not replayed",
    "steer.phi": "the steering sensor is not assessed, and the wheels' own angles are unknown",
    "steer.phi_true": "the steering sensor is judged by the model of its axle alone, which holds while the axle is steered",
    "steer.u": "the steering valve is not judged, and its replayed command has no recorded one beside it",
    "steer.u_applied": "the steering valve is judged by how the angle follows its command, so that a held angle says nothing of it",
    "cmd.v": "without recorded v_c,i no wheel has a command: no e, no Ψ̂, no driving time",
    "cmd.omega": "commands of the wheels are computed as if driving straight ahead, unless v_c,i is recorded",
    "imu.yaw_rate": "nothing: the yaw rate is shown beside the evidence and not judged",
    "gnss.lat": "the path is drawn from odometry; without either there is none",
    "gnss.lon": "the path is drawn from odometry; without either there is none",
    "gnss.speed": "nothing: it is shown beside the evidence and not judged",
    "odom.x": "the path is drawn from GNSS; without either there is none",
    "odom.y": "the path is drawn from GNSS; without either there is none",
    "odom.yaw": "nothing: it is shown beside the evidence and not judged",
}


def cost_of_missing(name: str) -> str:
    """What the diagnosis loses without a canonical signal; raises `ConfigError` where the name is not canonical."""
    return _COSTS[signal_of(name).kind]
