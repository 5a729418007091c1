"""Illuminance that Radiance's rtrace finds of an exported lamp, by its jittered quadrature, repeated.

    python judge_radiance.py lamp.rad receivers.json answer.json [REPEATS] [SIDE]

Each knot cell of the lamp is cut into SIDE x SIDE parts (a power of two, 8 at most), or more near it.
"""

import concurrent.futures
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


def cell_side(scene):
    """Longest side of the first polygon of a scene: all knot cells are alike."""
    words = scene.read_text().partition("polygon")[2].split()
    corners = np.array(words[4:16], float).reshape(4, 3)
    return np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max()


def traced(octree, environment, receivers_asked, ds):
    said = subprocess.run(["rtrace", "-h", "-I", "-ab", "0", "-dt", "0", "-dc", "1", "-ds", f"{ds:.9g}", "-dj", "1", "-fdd",
                           octree.name], cwd=octree.parent, env=environment,
                          input=receivers_asked.astype("<f8").tobytes(), stdout=subprocess.PIPE, check=True).stdout
    return LUMENS_PER_WATT * np.frombuffer(said, "<f8").reshape(-1, 3) @ LUMINANCE


def main(lamp, receivers_file, answer, repeats=16, side=4):
    lamp, repeats, side = pathlib.Path(lamp), int(repeats), int(side)
    positions, normals = (np.array(rows) for rows in receivers.read(receivers_file))
    programs = pathlib.Path(sys.prefix).parent / "bin"  # of the folder that `install` filled
    environment = dict(os.environ, PATH=f"{programs}:{os.environ['PATH']}")
    octree = lamp.with_suffix(".oct")
    with open(octree, "wb") as out:
        subprocess.run(["oconv", lamp.name], cwd=lamp.parent, env=environment, stdout=out, check=True)
    # Radiance halves a source until its side is at most ds times its distance, so that receivers of like distances, from
    # d to 2 d, are asked for together, with ds = side of a part / d.
    distances = np.linalg.norm(positions, axis=1)
    octave = np.floor(np.log2(distances / distances.min())).astype(int)
    groups = [np.flatnonzero(octave == k) for k in np.unique(octave)]
    asked = np.repeat(np.hstack([positions - BEFORE_M * normals, normals])[:, None], repeats, axis=1)
    part = 1.001 * cell_side(lamp) / side
    values = np.empty((len(positions), repeats))
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        runs = [pool.submit(traced, octree, environment, asked[group], part / distances[group].min()) for group in groups]
        for group, run in zip(groups, runs):
            values[group] = run.result().reshape(-1, repeats)
    version = subprocess.run(["rtrace", "-version"], env=environment, capture_output=True, text=True).stdout.split()
    receivers.write(answer, " ".join(version[:2]) or "Radiance", values.mean(axis=1),
                    values.std(axis=1, ddof=1) / repeats**0.5)


if __name__ == "__main__":
    main(*sys.argv[1:])
