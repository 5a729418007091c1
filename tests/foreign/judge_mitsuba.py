"""Illuminance that Mitsuba 3 finds of an exported lamp: its direct integrator looks at a small white square at each
receiver.

    python judge_mitsuba.py lamp.xml|lamp.json receivers.json answer.json [SAMPLES] [SEED]
"""

import math
import pathlib
import sys

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
sys.path.insert(0, str(pathlib.Path(__file__).parent))
sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "bridges/mitsuba"))
import luxfield_mitsuba  # noqa: F401  registers the emitter
import receivers

RAYS_AT_ONCE = 1 << 22


def squares(positions, normals):
    vertices, faces = [], []
    for k, (p, n) in enumerate(zip(positions, normals)):
        a, b = np.array(receivers.frame(n))
        half = receivers.half_side(p)
        vertices += [p + half * (x * a + y * b) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        faces += [(4 * k, 4 * k + 1, 4 * k + 2), (4 * k, 4 * k + 2, 4 * k + 3)]
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}})
    mesh = mi.Mesh("receivers", len(vertices), len(faces), properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(np.array(vertices, np.float32).ravel())
    parameters["faces"] = mi.UInt32(np.array(faces, np.uint32).ravel())
    parameters.update()
    return mesh


def vectors(rows, index, kind):
    return kind(*(dr.gather(mi.Float, mi.Float(np.ascontiguousarray(rows[:, k], np.float32)), index) for k in range(3)))


def main(lamp, receivers_file, answer, samples=4096, seed=0):
    positions, normals = (np.array(rows) for rows in receivers.read(receivers_file))
    lamps = mi.load_file(lamp).shapes() if lamp.endswith(".xml") else luxfield_mitsuba.lamp(lamp).values()
    scene = mi.load_dict({"type": "scene", "squares": squares(positions, normals),
                          **{f"lamp_{k}": shape for k, shape in enumerate(lamps)}})
    integrator = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 1})
    count, samples = len(positions), int(samples)
    lengths = np.linalg.norm(positions, axis=1, keepdims=True)
    means, sigmas = [], []
    for first in range(0, count, max(1, RAYS_AT_ONCE // samples)):
        part = slice(first, min(count, first + max(1, RAYS_AT_ONCE // samples)))
        index = dr.repeat(dr.arange(mi.UInt32, part.stop - part.start), samples)
        ray = mi.Ray3f(vectors((positions + 1e-3 * lengths * normals)[part], index, mi.Point3f),
                       vectors(-normals[part], index, mi.Vector3f))
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(int(seed) + first, dr.width(index))
        light, _, _ = integrator.sample(scene, sampler, mi.RayDifferential3f(ray))
        value = np.array(sum(math.pi * w * light[c] for c, w in enumerate(receivers.LUMINANCE)), np.float64)
        value = value.reshape(-1, samples)
        means += list(value.mean(axis=1))
        sigmas += list(value.std(axis=1, ddof=1) / math.sqrt(samples))
    receivers.write(answer, f"Mitsuba {mi.__version__}", means, sigmas)


if __name__ == "__main__":
    main(*sys.argv[1:])
