"""What a missing signal costs the diagnosis."""

from __future__ import annotations

from collections.abc import Container, Sequence

from diagnosis.results.machine_words import MachineWords
from replay.machine.signal_table import signal_of

# By signal, without its wheel or axle.
_COSTS = {
    "wheel.v_ref": "commanded speeds of the {wheels} (v_c,i) are computed from v_c and ω_c; without those and a geometry there is no tracking error",
    "wheel.v": "the {wheel.sensor} is not assessed, and the {wheel.actuator} only where its output is measured (u_applied)",
    "wheel.v_true": "how much a {wheel.sensor} has lost rests on a model or on other channels instead of a second measurement",
    "wheel.v_position": "a speed channel that leaves its own position is seen by other channels alone",
    "wheel.u": "the {wheel.actuator} is judged by its effort alone, if that is logged, and without v_true the {wheel.sensor} by its command and other channels",
    "wheel.u_applied": "how much a {wheel.actuator} has lost rests on a model, and its loss and one of the {wheel.sensor} are harder to distinguish",
    "wheel.effort": "whether the {wheel.actuator} is weak is not assessed: log its current, duty or torque",
    "wheel.psi": "no effect on the verdict; the recorded and the replayed Ψ̂ cannot be compared",
    "wheel.pressure_a": "no effect on the verdict: pressures are only shown beside the evidence",
    "wheel.pressure_b": "no effect on the verdict: pressures are only shown beside the evidence",
    "steer.phi_ref": "φ_c is computed from v_c and ω_c by the kinematics; without those the steering loop is not replayed",
    "steer.phi": "the {steer.sensor} is not assessed, and the {wheels}' own angles are unknown",
    "steer.phi_true": "the steering sensor is judged by the model of its axle alone, which holds while the axle is steered",
    "steer.u": "the {steer.actuator} is judged by what the replayed control law would have commanded, and where the angle does not fit that, not at all",
    "steer.u_applied": "the {steer.actuator} is judged by how the angle follows its command; a constant angle gives no evidence on it",
    "cmd.v": "without recorded v_c,i no {wheel} has a command: no tracking error, and driving time by measured speeds",
    "cmd.omega": "commands of the {wheels} follow from the steering angles, unless v_c,i is recorded; where no axle is steered they are unknown, but on the middle line",
    "cmd.lateral": "{wheels} with rollers have no expected speed while the machine is to move sideways",
    "imu.acceleration": "a speed that falls at once beside a body that goes on, and a machine that shakes though all speeds stand, are not seen by it",
    "imu.yaw_rate": "how the machine turns is known by commands, {wheels} and steering angles alone",
    "gnss.lat": "no speed of the body by GNSS to judge the {wheels} by; the path is drawn from odometry, if at all",
    "gnss.lon": "no speed of the body by GNSS to judge the {wheels} by; the path is drawn from odometry, if at all",
    "gnss.speed": "the speed of the body rests on positions, where they are logged",
    "odom.x": "no speed of the body by odometry to judge the {wheels} by; the path is drawn from GNSS, if at all",
    "odom.y": "no speed of the body by odometry to judge the {wheels} by; the path is drawn from GNSS, if at all",
    "odom.v": "the speed of the body by odometry rests on its positions, where they are logged",
    "odom.yaw": "a gyro is not held against the turns of odometry, which matters where no {wheel} speeds are logged",
}

# Of a steering of which not both are logged: a position says nothing of what it was told.
_POSITION_ALONE = "the {steer.actuator} is not judged: its position is logged, but not what it was told"
_NEITHER = "as for the command: neither what the {steer.actuator} was told nor what it did is logged"
_OF_WHEELS = "little: the commanded speed of every {wheel} is recorded"


def is_commanded(names: Container[str], wheels: Sequence[str]) -> bool:
    """Whether signals of these names say what any of the wheels was asked to do."""
    own = [f"wheel.{w}.{leaf}" for w in wheels for leaf in ("v_ref", "u", "u_applied")]
    return any(name in names for name in ("cmd.v", *own))


def applies(name: str, words: MachineWords) -> bool:
    """Whether a machine of this kind can have a canonical signal at all: no motor has pressures or a spool, no valve an effort, no arm an odometry."""
    leaf, group = name.rpartition(".")[2], name.partition(".")[0]
    if name in ("cmd.lateral", "imu.acceleration"):  # of few machines; nobody misses what tells most others nothing
        return False
    if words.drive != "valve" and leaf in ("pressure_a", "pressure_b", "psi"):
        return False
    if leaf == ("effort" if words.drive == "valve" else "u_applied"):
        return False
    return words.part == "wheel" or group in ("wheel", "steer")


def cost_of_missing(name: str, words: MachineWords, items: Container[str] = (), wheels: Sequence[str] = ()) -> str:
    """What the diagnosis loses without a canonical signal.

    Parameters
    ----------
    name : str
        The signal.
    words : MachineWords
        How parts of the machine are called.
    items : Container[str]
        Signals that were found.
    wheels : Sequence[str]
        Wheels of the machine.

    Raises
    ------
    ConfigError
        Where the name is not canonical.
    """
    if name in ("cmd.v", "cmd.omega") and wheels and all(f"wheel.{w}.v_ref" in items for w in wheels):
        return words.fill(_OF_WHEELS)
    stem, _, leaf = name.rpartition(".")
    if name.startswith("steer.") and leaf == "u" and f"{stem}.u_applied" in items:
        return words.fill(_POSITION_ALONE)
    if name.startswith("steer.") and leaf == "u_applied" and f"{stem}.u" not in items:
        return words.fill(_NEITHER)
    return words.fill(_COSTS[signal_of(name).kind])
