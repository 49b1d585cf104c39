"""The documents that the tool writes as JSON, by name, and their JSON schemas."""

from __future__ import annotations

from typing import Any

import msgspec

from diagnosis.audit.fleet.fleet_types import FleetDocument
from diagnosis.evaluation.document import ScoresDocument
from diagnosis.results.comparison_document import ComparisonDocument
from diagnosis.results.document import ReportDocument
from replay.errors import ConfigError

#: Type of each document; its docstrings are the schema's descriptions.
DOCUMENTS: dict[str, type] = {
    "report": ReportDocument,
    "comparison": ComparisonDocument,
    "scores": ScoresDocument,
    "fleet": FleetDocument,
}


def schema_of(name: str) -> dict[str, Any]:
    """JSON schema of a document.

    Parameters
    ----------
    name : str
        One of `DOCUMENTS`.

    Returns
    -------
    dict[str, Any]
        Of JSON Schema 2020-12; further keys are allowed everywhere, because later versions may add some.

    Raises
    ------
    ConfigError
        Where there is no document of that name.
    """
    if name not in DOCUMENTS:
        raise ConfigError(f"schema {name}: no such document; the tool writes {', '.join(DOCUMENTS)}")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **msgspec.json.schema(DOCUMENTS[name])}
