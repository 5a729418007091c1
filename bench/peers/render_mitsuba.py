#!/usr/bin/env python3
"""A scene of export.py through Mitsuba 3: direct light, a ray through the middle of each pixel, radiance as it is.

    python3 render_mitsuba.py SCENE.json -o mitsuba.exr --spp 64
"""

import json
import pathlib
import sys

import drjit as dr
import mitsuba as mi
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import arguments
import ies

RAYS_AT_ONCE = 1 << 21


def transform(rows):
    return mi.ScalarTransform4f(np.array([*rows, [0, 0, 0, 1]]))


def frame_at(thing):
    return transform([row + [p] for row, p in zip(thing["frame"], thing["position"])])


def diffuse(albedo):
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": albedo}}}


def quad(entry):
    a, b, _, d = (np.array(c) for c in entry["corners"])
    u, v = (b - a) / 2, (d - a) / 2  # of Mitsuba's square from -1 to 1
    columns = [u, v, np.cross(u, v), a + u + v]
    return {"type": "rectangle", "to_world": transform(np.array(columns).T.tolist()), "bsdf": diffuse(entry["albedo"])}


def rectangle(light):
    w, h = (s / 2 for s in light["size"])
    return {"type": "rectangle", "to_world": frame_at(light) @ mi.ScalarTransform4f().scale([w, h, 1]),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": light["radiance"]}}}


def spot(lamp, distribution):
    candela, beam_deg, cutoff_deg = ies.spot(distribution)
    return {"type": "spot", "to_world": frame_at(lamp), "beam_width": beam_deg, "cutoff_angle": cutoff_deg,
            "intensity": {"type": "rgb", "value": candela * lamp["scale"]}}


def environment(entry):
    """Mitsuba interpolates pixels that lie at the middles of columns but from pole to pole along columns: with every
    pixel twice, and 2 h + 1 rows of which every other one is the mean of two, that keeps the light of each."""
    pixels = np.array(mi.Bitmap(entry["file"]).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
    twice = np.repeat(np.repeat(pixels, 2, axis=0), 2, axis=1)
    rows = np.concatenate([twice[:1], (twice[:-1] + twice[1:]) / 2, twice[-1:]])
    # Column u is the azimuth atan2(x, -z) = 2 pi u to Mitsuba, atan2(y, x) = pi / 2 - 2 pi u to us.
    turn = np.array(entry["rotation"]) @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    return {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(rows, np.float32)), "scale": entry["scale"],
            "to_world": transform(np.c_[turn, np.zeros(3)].tolist())}


def sensor(camera):
    return {"type": "perspective", "fov": camera["vertical_fov_deg"], "fov_axis": "y",
            "to_world": mi.ScalarTransform4f().look_at(camera["position"], camera["look_at"], camera["up"]),
            "film": {"type": "hdrfilm", "width": camera["width"], "height": camera["height"]}}


def load(scene):
    things = {"type": "scene", "sensor": sensor(scene["camera"])}
    for k, entry in enumerate(scene["quads"]):
        things[f"quad_{k}"] = quad(entry)
    for k, entry in enumerate(scene["meshes"]):
        things[f"mesh_{k}"] = {"type": "ply", "filename": entry["file"], "face_normals": True,
                               "to_world": transform(entry["world_from_mesh"]), "bsdf": diffuse(entry["albedo"])}
    for k, light in enumerate(scene["rectangles"]):
        things[f"rectangle_{k}"] = rectangle(light)
    for k, lamp in enumerate(scene["lamps"]):
        things[f"lamp_{k}"] = spot(lamp, scene["distributions"][lamp["distribution"]])
    if scene["environment"]:
        things["environment"] = environment(scene["environment"])
    return mi.load_dict(things)


def render(scene, samples, seed):
    """Radiance of each pixel, by rows; some rows at once."""
    width, height = scene.sensors()[0].film().size()
    integrator = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 1, "hide_emitters": False})
    picture = np.empty((height, width, 3), np.float32)
    rows = max(1, RAYS_AT_ONCE // (width * samples))
    for first in range(0, height, rows):
        count = min(rows, height - first)
        pixel = dr.repeat(dr.arange(mi.UInt32, width * count), samples)
        middle = mi.Point2f((pixel % width + 0.5) / width, (pixel // width + first + 0.5) / height)
        sampler = mi.load_dict({"type": "multijitter", "sample_count": samples})
        sampler.set_samples_per_wavefront(samples)
        sampler.seed(seed * height + first, dr.width(pixel))
        ray, _ = scene.sensors()[0].sample_ray_differential(0, 0.5, middle, mi.Point2f(0.5))
        light, _, _ = integrator.sample(scene, sampler, ray)
        for channel in range(3):
            mean = dr.block_sum(light[channel], samples) / samples
            picture[first:first + count, :, channel] = np.array(mean).reshape(count, width)
    return picture


def main():
    how = arguments.parse(__doc__.splitlines()[0])
    if how.version:
        print(f"Mitsuba {mi.__version__}")
        return
    mi.set_variant("llvm_ad_rgb")
    if how.threads:
        dr.set_thread_count(how.threads)
    scene = load(json.loads(how.scene.read_text()))
    mi.Bitmap(render(scene, how.spp, how.seed)).write(str(how.output))


main()
