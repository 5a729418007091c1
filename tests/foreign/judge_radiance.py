"""Illuminance that Radiance's rtrace finds of an exported lamp, by its jittered quadrature, repeated.

    python judge_radiance.py lamp.rad receivers.json answer.json [REPEATS] [DS]
"""

import os
import pathlib
import subprocess
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import receivers

LUMENS_PER_WATT = 179
LUMINANCE = (0.265, 0.670, 0.065)  # of Radiance's primaries
BEFORE_M = 1e-4  # rtrace -I lights the place this far before the one that it is asked for


def main(lamp, receivers_file, answer, repeats=8, ds="0.0001"):
    lamp, repeats = pathlib.Path(lamp), int(repeats)
    positions, normals = (np.array(rows) for rows in receivers.read(receivers_file))
    programs = pathlib.Path(__file__).parents[2] / "build/foreign/bin"
    environment = dict(os.environ, PATH=f"{programs}:{os.environ['PATH']}")
    octree = lamp.with_suffix(".oct").name
    with open(lamp.parent / octree, "wb") as out:
        subprocess.run(["oconv", lamp.name], cwd=lamp.parent, env=environment, stdout=out, check=True)
    asked = np.repeat(np.hstack([positions - BEFORE_M * normals, normals]), repeats, axis=0)
    said = subprocess.run(["rtrace", "-h", "-I", "-ab", "0", "-dt", "0", "-dc", "1", "-ds", ds, "-dj", "1", "-fdd", octree],
                          cwd=lamp.parent, env=environment, input=asked.astype("<f8").tobytes(), stdout=subprocess.PIPE,
                          check=True).stdout
    values = LUMENS_PER_WATT * np.frombuffer(said, "<f8").reshape(-1, repeats, 3) @ LUMINANCE
    version = subprocess.run(["rtrace", "-version"], env=environment, capture_output=True, text=True).stdout.split()
    receivers.write(answer, " ".join(version[:2]) or "Radiance", values.mean(axis=1),
                    values.std(axis=1, ddof=1) / repeats**0.5)


if __name__ == "__main__":
    main(*sys.argv[1:])
