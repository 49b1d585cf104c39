"""What a missing signal costs the diagnosis."""

from __future__ import annotations

from replay.machine.signal_table import signal_of

# By signal, without its wheel or axle.
_COSTS = {
    "wheel.v_ref": "v_c,i is computed from v_c and ω_c by the kinematics; without those and a geometry there is no e and no Ψ̂",
    "wheel.v": "the speed sensor is not assessed, and the actuator only where its valve opening is measured (u_applied)",
    "wheel.v_true": "ε of the speed sensor rests on the wheel model instead of a second measurement",
    "wheel.v_position": "a speed channel that leaves its own position is seen by other channels alone",
    "wheel.u": "the actuator is not assessed, no Ψ̂ is implied, and without v_true the speed sensor only by whether it follows v_c,i",
    "wheel.u_applied": "ε of the actuator rests on the wheel model, and a loss of the sensor and one of the actuator are harder to distinguish",
    "wheel.effort": "a drive without a valve is judged by its speed alone, and whether it is weak is not assessed",
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
    "imu.yaw_rate": "the direction of travel rests on the steering angles alone",
    "gnss.lat": "no speed of the body by GNSS to judge the wheels by; the path is drawn from odometry, if at all",
    "gnss.lon": "no speed of the body by GNSS to judge the wheels by; the path is drawn from odometry, if at all",
    "gnss.speed": "the speed of the body rests on positions, where they are logged",
    "odom.x": "no speed of the body by odometry to judge the wheels by; the path is drawn from GNSS, if at all",
    "odom.y": "no speed of the body by odometry to judge the wheels by; the path is drawn from GNSS, if at all",
    "odom.v": "the speed of the body by odometry rests on its positions, where they are logged",
    "odom.yaw": "no effect on the verdict: it is only shown beside the evidence",
}


def cost_of_missing(name: str) -> str:
    """What the diagnosis loses without a canonical signal; raises `ConfigError` where the name is not canonical."""
    return _COSTS[signal_of(name).kind]
