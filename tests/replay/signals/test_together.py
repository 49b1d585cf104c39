"""Tables of one drive that were written into several files."""

from __future__ import annotations

import pytest

from replay.signals.together import Extent, are_together, tables_together

_S = 10**9


def table(*columns: str, start: float = 100.0, stop: float = 400.0) -> Extent:
    return Extent(round(start * _S), round(stop * _S), frozenset(columns))


DRIVE, STEER = table("n_FL", "n_FR"), table("phi_front", start=100.8, stop=401.0)


def groups(**extents: Extent | None) -> list[tuple[str, list[str]]]:
    names = list(extents)
    found = tables_together(names, lambda k: extents[names[k]])
    return [(shared, [names[k] for k in places]) for shared, places in found]


def test_files_of_one_drive() -> None:
    later = table("n_FL", "n_FR", start=900.0, stop=950.0), table("phi_front", start=900.0, stop=950.5)
    found = groups(Trip_1_Drive=DRIVE, Trip_1_Steer=STEER, Trip_2_Drive=later[0], Trip_2_Steer=later[1], other=DRIVE)
    assert found == [("Trip_1", ["Trip_1_Drive", "Trip_1_Steer"]), ("Trip_2", ["Trip_2_Drive", "Trip_2_Steer"])]


def test_single_words() -> None:
    assert groups(wheels=DRIVE, steering=STEER) == [("wheels+steering", ["wheels", "steering"])]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (DRIVE, table("n_FL", "n_FR")),  # two machines, or a copy
        (DRIVE, table("phi_front", start=120.0)),
        (DRIVE, table("phi_front", stop=380.0)),
        (DRIVE, None),
    ],
)
def test_other_files(one: Extent, other: Extent | None) -> None:
    assert groups(AX_drive=one, BX_drive=other) == []


def test_numbers_and_dates_tell_missions_apart() -> None:
    assert groups(**{"AX_2026-03-01": DRIVE, "AX_2026-03-02": STEER, "m1": DRIVE, "m2": STEER}) == []


def test_a_table_for_each_wheel() -> None:
    left, right = table("speed"), table("speed")
    assert groups(wheel_FL=left, wheel_FR=right) == [("wheel", ["wheel_FL", "wheel_FR"])]
    assert groups(wheel_AX=left, wheel_BX=right) == []
    assert not are_together([left, right])


def test_machines_of_one_folder_are_asked_few_times() -> None:
    asked = []
    stems = [f"{machine}_{day}" for day in range(500) for machine in ("AX", "BX")]

    def extent(k: int) -> Extent:
        asked.append(k)
        return DRIVE

    assert tables_together(stems, extent) == []
    assert len(asked) <= 6
