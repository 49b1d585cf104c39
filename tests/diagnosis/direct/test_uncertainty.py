"""What is usual of channels of one kind, though faults spoil what is found of half of them."""

from __future__ import annotations

from diagnosis.direct.uncertainty import HealthyNoise, usual_of_kind


def test_two_of_four_spoilt_channels_do_not_move_what_is_usual() -> None:
    sound = HealthyNoise(0.004, 0.0, 0.1, 0.0)
    spoilt = HealthyNoise(0.0043, 0.05, 1.0, 0.0)
    usual = usual_of_kind([spoilt, sound, spoilt, sound])
    assert usual == sound
    assert spoilt.exceeds(sound)
    assert not sound.exceeds(sound)
    assert usual_of_kind([sound, spoilt]) is None
