"""Illuminance that web/python/luxfield_gltf.py finds of an exported lamp. Also holds the file's extension to its schema,
where jsonschema is installed.

    python judge_gltf.py lamp.glb receivers.json answer.json
"""

import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "web/python"))
import luxfield_gltf
import receivers

NAME = luxfield_gltf.NAME
SCHEMA = pathlib.Path(__file__).parents[2] / "docs/formats" / f"{NAME}.schema.json"


def main(lamp, receivers_file, answer):
    light = luxfield_gltf.Light(lamp)
    try:
        import jsonschema
        for part in [light.extension] + [node["extensions"][NAME] for node in light.json["nodes"]
                                         if NAME in node.get("extensions", {})]:
            jsonschema.validate(part, json.loads(SCHEMA.read_text()))
    except ImportError:
        print("the schema is not tried: jsonschema is not installed")
    found = [light.illuminance(p, n) for p, n in zip(*receivers.read(receivers_file))]
    receivers.write(answer, "a reader of the page", found, [0] * len(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
