-- The audit store, schema 1. Times in seconds of the mission or nanoseconds of the log's clock; ratios plain.
CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;

-- One row per file that was ever hashed: a resume looks here before it reads a log again.
CREATE TABLE file (
    path TEXT PRIMARY KEY,          -- relative to the store's folder, or a URL
    size INTEGER NOT NULL,
    stamp TEXT NOT NULL,            -- mtime in ns, or the object's version or ETag
    sha256 TEXT NOT NULL
) STRICT;

-- One row per mission as found in the tree; several may share a result (copies).
CREATE TABLE mission (
    name TEXT PRIMARY KEY,          -- relative name without ending, unique in the audit; name of its report's folder
    files TEXT NOT NULL,            -- JSON list of paths of `file`
    bytes INTEGER NOT NULL,
    result INTEGER REFERENCES result (id),  -- NULL: not audited yet, or changed since
    seen INTEGER NOT NULL,          -- number of the audit run that saw it last
    gone INTEGER                    -- number of the run that looked where it was and did not find it; NULL: it is there
) STRICT;
CREATE INDEX mission_result ON mission (result);

-- One row per log content, configuration and version: the last attempt's outcome.
CREATE TABLE result (
    id INTEGER PRIMARY KEY,
    log_hash TEXT NOT NULL,         -- sha256 over the files' hashes and roles
    config_hash TEXT NOT NULL,      -- machine document, options, machine identity
    version TEXT NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('ok', 'degraded', 'unreadable', 'timeout', 'out_of_memory', 'crashed')),
    reason TEXT NOT NULL,           -- one sentence; empty where ok
    attempts INTEGER NOT NULL,
    machine_id TEXT NOT NULL,
    machine_name TEXT NOT NULL,
    verdict TEXT,                   -- ready, watch, stop, not_assessed; NULL where there is no report
    title TEXT NOT NULL DEFAULT '',
    start_ns INTEGER,               -- log clock; NULL where unknown
    duration_s REAL,
    driving_s REAL,
    decided_s REAL,                 -- mean over components and sides of decided driving
    distance_m REAL,
    open_loop INTEGER NOT NULL DEFAULT 0,
    left_out INTEGER NOT NULL DEFAULT 0, -- 1: the log lacks nothing but whole files that were left out
    report TEXT,                    -- folder of the report, relative to the output; NULL where there is none
    limit_option TEXT,              -- --timeout, --cpu or --memory, where it was stopped at that limit
    limit_value REAL,
    no_log INTEGER,                 -- 1: a table that is no machine's log; NULL: of an earlier version, which says both in `reason` alone
    UNIQUE (log_hash, config_hash, version)
) STRICT;
CREATE INDEX result_machine ON result (machine_id, start_ns);

-- Every try, failed ones too.
CREATE TABLE attempt (
    result INTEGER NOT NULL REFERENCES result (id) ON DELETE CASCADE,
    number INTEGER NOT NULL,        -- 1, 2, …
    state TEXT NOT NULL,
    reason TEXT NOT NULL,
    wall_s REAL,
    cpu_s REAL,
    peak_mb REAL,
    PRIMARY KEY (result, number)
) STRICT;

CREATE TABLE fault (
    result INTEGER NOT NULL REFERENCES result (id) ON DELETE CASCADE,
    id TEXT NOT NULL,               -- F1, F2, … as in the mission's report
    component TEXT NOT NULL,
    kind TEXT NOT NULL,             -- wheel or steer
    side TEXT NOT NULL,             -- sensor, actuator, sensor_or_actuator
    mode TEXT NOT NULL,
    severity TEXT NOT NULL,
    start_s REAL NOT NULL,
    stop_s REAL NOT NULL,
    start_ns INTEGER NOT NULL,
    epsilon REAL, epsilon_low REAL, epsilon_high REAL,
    sat REAL, sat_unit TEXT,
    probability REAL NOT NULL,
    unclear INTEGER NOT NULL DEFAULT 0, -- 1: no row has half of the probability, so that its kind is not told
    PRIMARY KEY (result, id)
) STRICT;

-- One row per component and side of a mission: what was judged, and the loss ε over the whole mission.
CREATE TABLE component (
    result INTEGER NOT NULL REFERENCES result (id) ON DELETE CASCADE,
    component TEXT NOT NULL,
    side TEXT NOT NULL,             -- sensor or actuator
    driving_s REAL NOT NULL,
    decided_s REAL NOT NULL,
    healthy_s REAL NOT NULL,
    faulty_s REAL NOT NULL,
    worst TEXT NOT NULL DEFAULT '', -- most severe mode in the mission, empty where none
    epsilon REAL, epsilon_low REAL, epsilon_high REAL,  -- over healthy and inefficient driving; NULL where not identifiable
    epsilon_s REAL,                 -- driving time behind it
    epsilon_relative INTEGER NOT NULL DEFAULT 0,  -- 1: against the other wheels, only its change over missions counts
    PRIMARY KEY (result, component, side)
) STRICT;

-- What `mfhca audit --repaired` was told, one row per repair; stores of earlier versions get this table when they are opened.
CREATE TABLE repair (
    machine_id TEXT NOT NULL,
    machine_name TEXT NOT NULL,     -- of a machine without an identity, else empty
    component TEXT NOT NULL,
    side TEXT NOT NULL,             -- sensor or actuator; empty: both
    repaired_ns INTEGER NOT NULL,   -- from when on the part counts as another one, by the clock of the logs
    withdrawn INTEGER NOT NULL,     -- 1: the repair was recorded by mistake
    noted_ns INTEGER NOT NULL,      -- when it was recorded; of one repair the last note counts
    PRIMARY KEY (machine_id, machine_name, component, side, repaired_ns, noted_ns)
) STRICT;
