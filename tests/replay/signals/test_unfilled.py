"""Arrays of joint states that a driver leaves at 0 are no measurements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.setup.draft import draft_machine
from replay.setup.read import read_everything
from tests.replay.signals.test_mapping import joints, mapped, topic
from tests.ros_robots import Robot, _Topics, write_robot

Array = NDArray[np.float64]

MOVES, ZERO = np.linspace(0.0, 5.0, 200), np.zeros(200)
JOINTS = ("front_left_wheel", "front_right_wheel")


@pytest.mark.parametrize("unfilled", [0.0, np.nan])
@pytest.mark.parametrize(
    ("empty", "other"), [("effort", "velocity"), ("position", "velocity"), ("velocity", "position")]
)
def test_an_array_of_zeros_or_no_numbers_while_another_moves_is_not_mapped(
    empty: str, other: str, unfilled: float
) -> None:
    nothing = np.full(200, unfilled)
    found = mapped(*joints({f"{k}[{j}]": nothing if k == empty else MOVES for k in (empty, other) for j in JOINTS}))
    assert not any((s.origin.field or "").startswith(empty) for s in found.items.values())
    assert found.items
    assert sum(f"/joint_states {empty}: 0 or no number of every joint" in note for note in found.notes) == 1


@pytest.mark.parametrize(
    ("still", "value", "kept"),
    [("pose", 0.0, {"odom.v"}), ("pose", 3.5, {"odom.v"}), ("twist", 0.0, {"odom.x", "odom.y"})],
)
def test_an_odometry_of_which_a_part_stays_is_used_without_it(still: str, value: float, kept: set[str]) -> None:
    fields = ("pose.pose.position.x", "pose.pose.position.y", "twist.twist.linear.x")
    columns = {f: np.full(200, value) if f.startswith(still) else MOVES for f in fields}
    found = mapped(*topic("/odom", "nav_msgs/msg/Odometry", columns))
    assert set(found.items) == kept
    assert sum(f"/odom {still}: the same throughout" in note for note in found.notes) == 1
    rest = mapped(*topic("/odom", "nav_msgs/msg/Odometry", dict.fromkeys(fields, ZERO)))
    assert {"odom.v", "odom.x"} <= set(rest.items)


def test_one_silent_joint_and_a_machine_at_rest_stay() -> None:
    one = mapped(
        *joints(
            {
                "velocity[front_left_wheel]": MOVES,
                "velocity[front_right_wheel]": ZERO,
                "position[front_left_wheel]": MOVES,
                "position[front_right_wheel]": MOVES,
            }
        )
    )
    rest = mapped(*joints({f"{k}[{j}]": ZERO for k in ("position", "velocity") for j in JOINTS}))
    for found in (one, rest):
        assert {s.origin.field for s in found.items.values()} >= {f"velocity[{j}]" for j in JOINTS}
        assert not any("0 or no number of every joint" in note for note in found.notes)


@pytest.mark.parametrize("unfilled", [0.0, np.nan])
def test_a_draft_says_it_and_names_no_such_array(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, unfilled: float
) -> None:
    as_written = _Topics.joints

    def not_filled_in(self: _Topics, topic: str, at: int, names: list[str], speeds: Array, rolled: Array) -> None:
        as_written(self, topic, at, names, speeds, np.full_like(rolled, unfilled))

    monkeypatch.setattr(_Topics, "joints", not_filled_in)
    write_robot(tmp_path / "run.mcap", Robot(positions=True), 20.0)
    draft = draft_machine(read_everything([tmp_path / "run.mcap"], every=False))
    assert not [n for n in draft.machine.signals if n.endswith("v_position")]
    assert any("/joint_states position: 0 or no number of every joint" in text for text in draft.found)
