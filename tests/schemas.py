"""What a document has that its schema does not know."""

from __future__ import annotations

from typing import Any


def unknown_keys(value: Any, schema: dict[str, Any], definitions: dict[str, Any], place: str = "$") -> list[str]:
    """Keys that a document has and its schema does not."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].rpartition("/")[2]]
    if "anyOf" in schema:
        kind = {dict: "object", list: "array"}.get(type(value))
        found = [
            unknown_keys(value, s, definitions, place)
            for s in schema["anyOf"]
            if kind is not None and ("$ref" in s or s.get("type") == kind)
        ]
        return min(found, key=len, default=[])
    if isinstance(value, list):
        return [x for v in value for x in unknown_keys(v, schema.get("items") or {}, definitions, f"{place}[]")]
    if isinstance(value, dict) and "properties" in schema:
        out = [f"{place}.{key}" for key in value if key not in schema["properties"]]
        known = [(k, v) for k, v in value.items() if k in schema["properties"]]
        return out + [
            x for k, v in known for x in unknown_keys(v, schema["properties"][k], definitions, f"{place}.{k}")
        ]
    return []
