#!/usr/bin/env python3
"""A scene.toml for other renderers: same geometry, camera, light.

    bench/peers/export.py SCENE.toml -o FOLDER

writes FOLDER/scene.json, which render_cycles.py and render_mitsuba.py beside this file read, and
FOLDER/scene.pbrt, which render_pbrt.py does; README.md says how they are run and compared. What none of them
shares with us is refused by name, and what one of them does not is named in "refused" of scene.json:
{"mitsuba": sentence}.
"""

import argparse
import json
import pathlib
import sys
import tomllib

import ies
from pbrt import pbrt_scene
from refused import Refused
from scene import read_scene

# Of the photometric files for Cycles, which interpolates by cubics: linear pieces stay linear.
POLAR_STEP_DEG, AZIMUTH_STEP_DEG = 0.125, 1


def refusals(scene):
    """Peers that cannot show it, with why."""
    refused = {}
    if any(ies.spot(d) is None for d in scene["distributions"]):
        refused["mitsuba"] = "Mitsuba has no light of a photometric file other than spots of even light that falls linearly"
    return refused


def export(scene, folder, samples):
    for k, distribution in enumerate(scene["distributions"]):
        distribution["dense"] = str((folder / f"distribution_{k}.ies").resolve())
        ies.write_dense(distribution["dense"], distribution, POLAR_STEP_DEG, AZIMUTH_STEP_DEG)
    (folder / "scene.pbrt").write_text(pbrt_scene(scene, samples))
    (folder / "scene.json").write_text(json.dumps(scene | {"refused": refusals(scene)}, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="folder")
    parser.add_argument("--spp", type=int, default=256, help="of scene.pbrt")
    parser.add_argument("--width", type=int, help="pixels instead of the scene's")
    parser.add_argument("--height", type=int, help="pixels instead of the scene's")
    arguments = parser.parse_args()
    try:
        scene = read_scene(arguments.scene)
        for key in ("width", "height"):
            scene["camera"][key] = getattr(arguments, key) or scene["camera"][key]
        arguments.output.mkdir(parents=True, exist_ok=True)
        export(scene, arguments.output, arguments.spp)
    except (Refused, OSError, tomllib.TOMLDecodeError, KeyError) as error:
        print(f"export.py: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
