"""The table of formats that are fuzzed."""

from __future__ import annotations

from collections.abc import Callable

from tests.benchmarks.fuzzing.bag import Ros1Bag
from tests.benchmarks.fuzzing.binary_tables import Parquet, Svdx, Tdms
from tests.benchmarks.fuzzing.case import Target
from tests.benchmarks.fuzzing.first_look import FirstLook
from tests.benchmarks.fuzzing.mcap import Mcap
from tests.benchmarks.fuzzing.results import AuditStore, Results
from tests.benchmarks.fuzzing.rosbag2 import Rosbag2
from tests.benchmarks.fuzzing.text_tables import Csv, Scope
from tests.benchmarks.fuzzing.toml_files import Toml

TARGETS: dict[str, Callable[[], Target]] = {
    "mcap": Mcap,
    "bag": Ros1Bag,
    "rosbag2": Rosbag2,
    "csv": Csv,
    "twincat": Scope,
    "parquet": Parquet,
    "tdms": Tdms,
    "svdx": Svdx,
    "toml": Toml,
    "results": Results,
    "store": AuditStore,
    "first-look": FirstLook,
}
