"""A validator of the part of JSON Schema 2020-12 that docs/formats/*.schema.json are written with."""

import re

TYPES = {"object": dict, "array": list, "string": str, "number": (int, float), "integer": int,
         "boolean": bool, "null": type(None)}  # fmt: skip
# Anything else would go unchecked.
KNOWN = {"$schema", "$id", "$defs", "$ref", "title", "description", "type", "const", "enum", "anyOf",
         "required", "properties", "patternProperties", "additionalProperties", "items", "minItems",
         "maxItems", "pattern"}  # fmt: skip


def is_of(value, name):
    if isinstance(value, bool):
        return name == "boolean"
    return isinstance(value, TYPES[name])


def mistakes(value, schema, where="it", root=None):
    """What of a value is not as the schema says."""
    root = root or schema
    if schema is True:
        return []
    if schema is False:
        return [f"{where} should not be there"]
    assert set(schema) <= KNOWN, f"{where}: {set(schema) - KNOWN} of the schema is not known here"
    if "$ref" in schema:
        return mistakes(value, root["$defs"][schema["$ref"].removeprefix("#/$defs/")], where, root)
    if "anyOf" in schema:
        tried = [mistakes(value, one, where, root) for one in schema["anyOf"]]
        return [] if [] in tried else min(tried, key=len)
    names = schema.get("type", list(TYPES))
    names = [names] if isinstance(names, str) else names
    if not any(is_of(value, name) for name in names):
        return [f"{where} is not of type {names}"]
    found = []
    if "const" in schema and value != schema["const"]:
        found.append(f"{where} is not {schema['const']}")
    if "enum" in schema and value not in schema["enum"]:
        found.append(f"{where} is none of {schema['enum']}")
    if isinstance(value, str) and not re.search(schema.get("pattern", ""), value):
        found.append(f"{where} does not match {schema['pattern']}")
    if isinstance(value, list):
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            found.append(f"{where} has {len(value)} items")
        for k, item in enumerate(value):
            found += mistakes(item, schema.get("items", True), f"{where}[{k}]", root)
    if isinstance(value, dict):
        found += [f"{where}.{key} is missing" for key in schema.get("required", ()) if key not in value]
        for key, item in value.items():
            of = [schema["properties"][key]] if key in schema.get("properties", {}) else []
            of += [one for pattern, one in schema.get("patternProperties", {}).items()
                   if re.search(pattern, key)]  # fmt: skip
            for one in of or [schema.get("additionalProperties", True)]:
                found += mistakes(item, one, f"{where}.{key}", root)
    return found
