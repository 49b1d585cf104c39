from __future__ import annotations

from diagnosis.report.evidence import delay_words, evidence_of
from tests import report_samples as samples


def test_panels_follow_the_columns() -> None:
    report, columns = samples.five_faults()
    found = evidence_of(report, columns, (0.0, 0.01))
    assert list(found) == ["F1", "F2", "F3", "F4", "F5"]
    assert [p.title for p in found["F1"].course] == ["Wheel speed", "Residual"]
    columns["evidence.FR.sensor.probability"] = 1.0 - columns["evidence.FR.sensor.p_healthy"]
    found = evidence_of(report, columns, (0.0, 0.01))
    assert [p.title for p in found["F1"].course][2:] == ["Probability that it deviates"]
    assert "limit 0.9" in found["F1"].course[2].picture
    assert [p.title for p in found["F4"].course][:1] == ["Steering angle"]
    assert [bool(p.picture) for p in found["F4"].edges] == [True, True]


def test_no_columns_no_panels() -> None:
    report, _ = samples.one_wheel()
    found = evidence_of(report, {}, (0.0, 0.01))["F1"]
    assert (found.edges, found.course, found.keys) == ((), (), ())
    assert found.rests == "second measurement"


def test_an_end_that_the_log_does_not_hold_is_said() -> None:
    report, columns = samples.one_wheel()
    report["intervals"][0]["stop_s"] = 120.0
    end = evidence_of(report, columns, (0.0, 0.01))["F1"].edges[1]
    assert (end.picture, end.words) == ("", "The fault lasts to the end of the samples of wheel.drive.v.")


def test_slower_channels_are_named() -> None:
    report, columns = samples.one_wheel()
    next(s for s in report["signals"] if s["name"] == "wheel.drive.v_true")["rate_hz"] = 20.0
    note = evidence_of(report, columns, (0.0, 0.01))["F1"].note
    assert note == "wheel.drive.v_true came at 20 Hz; until its next sample the last one is shown at 100 Hz."


def test_delay() -> None:
    assert delay_words(samples.fault(start_s=5.0, detected_s=5.02)) == "detected 20 ms after onset"
    assert delay_words(samples.fault(start_s=5.0, detected_s=5.0)) == "detected at its first sample"
    assert delay_words(samples.fault(detected_s=None)) == "when it would have been detected is not known"


def test_missing_pictures_are_explained() -> None:
    report, columns = samples.one_wheel()
    del columns["wheel.drive.v"]
    found = evidence_of(report, columns, (0.0, 0.01))["F1"]
    assert found.note == "The channel of this fault is not among the saved time series."
    found = evidence_of(*samples.one_wheel(), (0.0, 0.01), per=64)["F1"]
    assert found.edges == ()
    assert found.note.startswith("Of this long mission the smallest and largest of every 64 samples are kept")


def test_only_the_wanted_faults() -> None:
    report, columns = samples.five_faults()
    assert set(evidence_of(report, columns, (0.0, 0.01), faults=report["intervals"][1:3])) == {"F2", "F3"}
