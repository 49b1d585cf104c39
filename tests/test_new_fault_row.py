"""A fault row that is added to the two tables has its words, colours, symbols, advice and form of ``--fault`` everywhere."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

_PROGRAM = '''
import importlib.abc, importlib.machinery, importlib.util, sys
from pathlib import Path

ROW = """    TableRow(
        Side.SENSOR, FaultMode.DRIFTING, False, Saturation.VARYING, epsilon=0.4, sat=0.02, sat_std=0.1, sat_tau_s=60.0
    ),
"""
WORDS = """    FaultRow(Side.SENSOR, FaultMode.DRIFTING, 0.05, "Drifting", "drifting", "{part} drifting, {rms} r.m.s."),
"""
LOOK = """    State.DRIFTING: StateLook("Drifting", "~", "#336699", "#88aacc", "#88aacc", "<circle r='3'/>", "dot"),
"""
EDITS = {
    "replay.faults": (
        ('    NOISY = "noisy"\\n', '    NOISY = "noisy"\\n    DRIFTING = "drifting"\\n', 2),
        (")\\n\\n#: Modes of the tables, which", ROW + ")\\n\\n#: Modes of the tables, which", 1),
    ),
    "diagnosis.results.fault_rows": (
        (")\\n\\n\\n@dataclass(frozen=True)\\nclass StateLook", WORDS + ")\\n\\n\\n@dataclass(frozen=True)\\nclass StateLook", 1),
        ("    State.NOT_EXCITED: ", LOOK + "    State.NOT_EXCITED: ", 1),
    ),
}


class Edited(importlib.machinery.SourceFileLoader):
    def get_code(self, fullname):
        text = Path(self.path).read_text(encoding="utf-8")
        for old, new, count in EDITS[fullname]:
            assert text.count(old) == count, (fullname, old)
            text = text.replace(old, new)
        return compile(text, self.path, "exec")


class Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, fullname, path, target=None):
        if fullname not in EDITS:
            return None
        place = str(Path(*fullname.split(".")).with_suffix(".py").resolve())
        return importlib.util.spec_from_file_location(fullname, place, loader=Edited(fullname, place))


sys.meta_path.insert(0, Finder())

import numpy as np

from diagnosis.api.fault_words import parse_fault
from cli.tables.looks import mode_text
from diagnosis.audit.fleet.page.svg import LEGEND, sprite
from diagnosis.decision.advice import check_of
from diagnosis.decision.severity import severity_of
from diagnosis.estimation.row_probability import row_probabilities
from diagnosis.pages.labels import fault_title, known, mode_legend
from diagnosis.pages.mode_style import mode_style
from diagnosis.pages.svg import icon
from diagnosis.results.fault_rows import ROWS, codes_of, mode_words, prior, state_label
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Kind
from replay.errors import ConfigError
from replay.faults import FaultMode, Side, drawn_modes
from tests.diagnosis.decision.findings import LIMITS, finding

drifting = FaultMode.DRIFTING
assert (state_label(drifting), mode_words("sensor", drifting), known(drifting)) == ("Drifting", "drifting", drifting)
assert mode_legend(drifting) == "Drifting"
assert str(mode_text(drifting, "words")) == "~ words"
assert "--drifting: #336699;" in mode_style() and ".ic.drifting" in mode_style()
assert "<circle r='3'/>" in icon(drifting)
assert drifting in LEGEND and 'id="g-drifting"' in sprite()
sat = {"mean": 0.1, "rms": 0.25, "low": 0.0, "high": 0.2, "unit": "m/s"}
fault = {"kind": "wheel", "component": "FR", "side": "sensor", "mode": "drifting", "sat": sat, "epsilon": None}
fault |= {"hypotheses": []}
assert fault_title(fault, HYDRAULIC) == "FR speed sensor drifting, 0.25 m/s r.m.s."
assert fault_title(fault | {"sat": None}, HYDRAULIC) == "FR speed sensor drifting"
assert "no reason to stop" in severity_of(finding(Side.SENSOR, drifting, epsilon=0.4), 60.0, LIMITS, HYDRAULIC)[1]
assert check_of(Kind.WHEEL, "FR", Side.SENSOR, drifting, HYDRAULIC)
assert parse_fault("FR sensor drifting 30 60").sat_tau_s == 60.0
try:
    parse_fault("FR actuator drifting 30 60")
except ConfigError as e:
    assert "expected one of stuck, no_signal, inefficient, noisy" in str(e)
else:
    raise AssertionError("the valve's table has no such row")
assert drifting not in drawn_modes(Side.SENSOR)  # what the seeds draw stays
code = ROWS.index("drifting")
assert code in codes_of(Side.SENSOR) and code not in codes_of(Side.ACTUATOR)
assert prior(code, Side.ACTUATOR) == 0.0 and prior(0, Side.ACTUATOR) == 0.8
assert row_probabilities(np.zeros(len(ROWS)), Side.ACTUATOR)[code] == 0.0
unseen = np.where(np.arange(len(ROWS)) == code, -np.inf, 0.0)
assert row_probabilities(unseen, Side.SENSOR)[code] == 0.0
print("every table knows the row")
'''


def test_two_tables_are_all_that_names_and_shows_need() -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", _PROGRAM], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert done.stdout == "every table knows the row\n"
