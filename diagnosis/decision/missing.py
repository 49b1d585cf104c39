"""What a missing signal costs the diagnosis."""

from __future__ import annotations

from replay.machine.signal_table import signal_of

# By signal, without its wheel or axle.
_COSTS = {
    "wheel.v_ref": "v_c,i is computed from v_c and ω_c by the kinematics; without those and a geometry there is no e and no Ψ̂",
    "wheel.v": "the speed sensor is not assessed, and the actuator only where its valve opening is measured (u_applied)",
    "wheel.v_true": "ε of the speed sensor rests on the wheel model instead of a second measurement",
    "wheel.u": "the actuator is not assessed, no Ψ̂ is implied, and without v_true the speed sensor only by whether it follows v_c,i",
    "wheel.u_applied": "ε of the actuator rests on the wheel model, and a loss of the sensor and one of the actuator are harder to distinguish",
    "wheel.psi": "no effect on the verdict; the recorded and the replayed Ψ̂ cannot be compared",
    "wheel.pressure_a": "no effect on the verdict: pressures are only shown beside the evidence",
    "wheel.pressure_b": "no effect on the verdict: pressures are only shown beside the evidence",
    "steer.phi_ref": "φ_c is computed from v_c and ω_c by the kinematics; without those the steering loop is not replayed",
    "steer.phi": "the steering sensor is not assessed, and the wheels' own angles are unknown",
    "steer.phi_true": "the steering sensor is judged by the model of its axle alone, which holds while the axle is steered",
    "steer.u": "the steering valve is not judged, and its replayed command cannot be compared with a recorded one",
    "steer.u_applied": "the steering valve is judged by how the angle follows its command; a constant angle gives no evidence on it",
    "cmd.v": "without recorded v_c,i no wheel has a command: no e, no Ψ̂, no driving time",
    "cmd.omega": "commands of the wheels are computed as if driving straight ahead, unless v_c,i is recorded",
    "imu.yaw_rate": "no effect on the verdict: the yaw rate is only shown beside the evidence",
    "gnss.lat": "the path is drawn from odometry; without GNSS and odometry no path is drawn",
    "gnss.lon": "the path is drawn from odometry; without GNSS and odometry no path is drawn",
    "gnss.speed": "no effect on the verdict: it is only shown beside the evidence",
    "odom.x": "the path is drawn from GNSS; without GNSS and odometry no path is drawn",
    "odom.y": "the path is drawn from GNSS; without GNSS and odometry no path is drawn",
    "odom.yaw": "no effect on the verdict: it is only shown beside the evidence",
}


def cost_of_missing(name: str) -> str:
    """What the diagnosis loses without a canonical signal; raises `ConfigError` where the name is not canonical."""
    return _COSTS[signal_of(name).kind]
