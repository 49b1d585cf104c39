"""The documents that the tool writes as JSON, by name, and their JSON schemas."""

from __future__ import annotations

from typing import Any

import msgspec

from diagnosis.audit.fleet.fleet_types import SCHEMA as FLEET_SCHEMA
from diagnosis.audit.fleet.fleet_types import FleetDocument
from diagnosis.counterfactual.document import SCHEMA as COUNTERFACTUAL_SCHEMA
from diagnosis.counterfactual.document import CounterfactualDocument
from diagnosis.evaluation.document import SCHEMA as SCORES_SCHEMA
from diagnosis.evaluation.document import ScoresDocument
from diagnosis.results.comparison_document import SCHEMA as COMPARISON_SCHEMA
from diagnosis.results.comparison_document import ComparisonDocument
from diagnosis.results.document import SCHEMA as REPORT_SCHEMA
from diagnosis.results.document import ReportDocument
from replay.errors import ConfigError

#: Type of each document, whose docstrings are the schema's descriptions, and what it says of its own schema.
DOCUMENTS: dict[str, tuple[type, str]] = {
    "report": (ReportDocument, REPORT_SCHEMA),
    "comparison": (ComparisonDocument, COMPARISON_SCHEMA),
    "scores": (ScoresDocument, SCORES_SCHEMA),
    "counterfactual": (CounterfactualDocument, COUNTERFACTUAL_SCHEMA),
    "fleet": (FleetDocument, FLEET_SCHEMA),
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
        Of JSON Schema 2020-12; further keys are allowed everywhere, because later versions may add some. Its ``$id`` ends in
        what the document's own ``schema`` says.

    Raises
    ------
    ConfigError
        Where there is no document of that name.
    """
    if name not in DOCUMENTS:
        raise ConfigError(f"schema {name}: no such document; the tool writes {', '.join(DOCUMENTS)}")
    document, version = DOCUMENTS[name]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:{version.replace('/', ':')}",
        "title": f"mfhca {name}, {version}",
        **msgspec.json.schema(document),
    }
