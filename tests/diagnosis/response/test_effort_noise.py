"""An effort that is only noise, from end to end, while others pull."""

import numpy as np
import pytest

from diagnosis.response.effort import powered


def _efforts(seed: int, share: float) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    load = np.repeat(rng.normal(0.0, 3.0, 60), 6)
    efforts = {w: load + rng.normal(0.0, 0.2, load.size) for w in ("FL", "RR", "RL")}
    return efforts | {"FR": share * load + rng.normal(0.0, 0.06, load.size)}


@pytest.mark.parametrize("seed", range(5))
def test_a_wheel_whose_effort_is_noise_has_no_drive_that_is_seen(seed: int) -> None:
    assert powered(_efforts(seed, 0.0))[1] == ("FR",)


def test_a_small_effort_that_follows_the_load_is_a_drives() -> None:
    assert powered(_efforts(1, 0.02))[1] == ()
