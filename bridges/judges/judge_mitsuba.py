"""Illuminance that Mitsuba 3 finds of an exported lamp: its direct integrator looks at a small white square at each
receiver.

    python judge_mitsuba.py lamp.xml|lamp.json receivers.json answer.json [SAMPLES] [REPEATS]
"""

import math
import pathlib
import sys

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
sys.path.insert(0, str(pathlib.Path(__file__).parent))
import receivers  # noqa: E402

sys.path[:0] = [str(receivers.BRIDGES / "mitsuba"), str(receivers.BRIDGES)]
import luxfield_mitsuba  # noqa: F401  registers the emitter

# Half sides in shares of the distance from the lamp: squares that take no light from each other. Float32's steps would
# turn them, and so they are given normals.
HALF_SIDE = 2e-5
RAYS_AT_ONCE = 1 << 20


def squares(positions, normals):
    vertices, faces = [], []
    for k, (p, n) in enumerate(zip(positions, normals)):
        a, b = np.array(receivers.frame(n))
        half = HALF_SIDE * np.linalg.norm(p)
        vertices += [p + half * (x * a + y * b) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        faces += [(4 * k, 4 * k + 1, 4 * k + 2), (4 * k, 4 * k + 2, 4 * k + 3)]
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}})
    mesh = mi.Mesh("receivers", len(vertices), len(faces), properties, has_vertex_normals=True)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(np.array(vertices, np.float32).ravel())
    parameters["vertex_normals"] = mi.Float(np.repeat(normals, 4, axis=0).astype(np.float32).ravel())
    parameters["faces"] = mi.UInt32(np.array(faces, np.uint32).ravel())
    parameters.update()
    return mesh


def vectors(rows, index, kind):
    return kind(*(dr.gather(mi.Float, mi.Float(np.ascontiguousarray(rows[:, k], np.float32)), index) for k in range(3)))


def look(scene, integrator, positions, normals, samples, seed):
    """Illuminance at each receiver by so many stratified samples."""
    index = dr.repeat(dr.arange(mi.UInt32, len(positions)), samples)
    lengths = np.linalg.norm(positions, axis=1, keepdims=True)
    ray = mi.Ray3f(vectors(positions + 1e-3 * lengths * normals, index, mi.Point3f),
                   vectors(-normals, index, mi.Vector3f))
    sampler = mi.load_dict({"type": "multijitter", "sample_count": samples})
    sampler.set_samples_per_wavefront(samples)
    sampler.seed(seed, dr.width(index))
    light, _, _ = integrator.sample(scene, sampler, mi.RayDifferential3f(ray))
    value = sum(math.pi * w * light[c] for c, w in enumerate(receivers.LUMINANCE))
    return np.array(value, np.float64).reshape(-1, samples).mean(axis=1)


def main(lamp, receivers_file, answer, samples=1024, repeats=16):
    positions, normals = (np.array(rows) for rows in receivers.read(receivers_file))
    samples, repeats = int(samples), int(repeats)
    lamps = mi.load_file(lamp).shapes() if lamp.endswith(".xml") else luxfield_mitsuba.lamp(lamp).values()
    scene = mi.load_dict({"type": "scene", "squares": squares(positions, normals),
                          **{f"lamp_{k}": shape for k, shape in enumerate(lamps)}})
    integrator = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 1})
    parts = np.array_split(np.arange(len(positions)), -(-len(positions) * samples // RAYS_AT_ONCE))
    found = np.array([np.concatenate([look(scene, integrator, positions[part], normals[part], samples,
                                           len(parts) * repeat + k) for k, part in enumerate(parts)])
                      for repeat in range(repeats)])
    receivers.write(answer, f"Mitsuba {mi.__version__}", found.mean(axis=0),
                    found.std(axis=0, ddof=1) / math.sqrt(repeats))


if __name__ == "__main__":
    main(*sys.argv[1:])
