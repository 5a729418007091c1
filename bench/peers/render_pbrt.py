#!/usr/bin/env python3
"""A scene of export.py through pbrt-v4: direct light, a ray through the middle of each pixel, radiance as it is.

    python3 render_pbrt.py SCENE.json -o pbrt.exr --spp 64

takes `pbrt` and `imgtool` from PATH. The pictures of light that scene.pbrt names are made beside it the first time.
"""

import json
import pathlib
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import arguments
import equal_area
import ies

ENVIRONMENT_SIZE, LAMP_SIZE = 2048, 1024


def make_pictures(scene, folder):
    environment = folder / "environment.pfm"
    if scene["environment"] and not environment.exists():
        flat = folder / "latlong.pfm"
        subprocess.run(["imgtool", "convert", "--outfile", flat, scene["environment"]["file"]], check=True)
        equal_area.write_pfm(environment, equal_area.of_latlong(equal_area.read_pfm(flat), ENVIRONMENT_SIZE))
    for k, distribution in enumerate(scene["distributions"]):
        lamp = folder / f"distribution_{k}.pfm"
        if not lamp.exists():
            light = equal_area.of_intensity(lambda polar, azimuth, d=distribution: ies.intensity(d, polar, azimuth), LAMP_SIZE)
            equal_area.write_pfm(lamp, light)


def main():
    how = arguments.parse(__doc__.splitlines()[0])
    if shutil.which("pbrt") is None or shutil.which("imgtool") is None:
        sys.exit("render_pbrt.py: no pbrt and imgtool of pbrt-v4 in PATH")
    if how.version:
        print(subprocess.run(["pbrt", "--help"], capture_output=True, text=True, check=False).stderr.splitlines()[0])
        return
    folder = how.scene.parent
    make_pictures(json.loads(how.scene.read_text()), folder)
    subprocess.run(["pbrt", "--quiet", "--spp", str(how.spp), "--seed", str(how.seed), "--outfile", how.output.resolve(),
                    *(["--nthreads", str(how.threads)] if how.threads else []), "scene.pbrt"], cwd=folder, check=True)


main()
