"""A scene (scene.py) as one of pbrt-v4: direct light only; a ray through the middle of each pixel; radiance as it is."""

import math

from scene import product


def numbers(values):
    return "[ " + " ".join(f"{v:.9g}" for v in values) + " ]"


def matrix(rows):
    """A 4 x 4 matrix of 3 rows of 4, by columns as pbrt's Transform takes it."""
    return numbers([value for j in range(4) for value in (*(row[j] for row in rows), float(j == 3))])


def pbrt_scene(scene, samples):
    camera, environment = scene["camera"], scene["environment"]
    w, h = camera["width"], camera["height"]
    half = math.tan(math.radians(camera["vertical_fov_deg"]) / 2)
    shorter = 2 * math.degrees(math.atan(half * min(1, w / h)))  # pbrt's fov is that of the shorter side
    lines = [
        "Scale -1 1 1",  # pbrt's camera is left-handed
        "LookAt " + " ".join(f"{v:.9g}" for v in camera["position"] + camera["look_at"] + camera["up"]),
        f'Camera "perspective" "float fov" [ {shorter:.9g} ]',
        f'Film "rgb" "integer xresolution" [ {w} ] "integer yresolution" [ {h} ] "string filename" "pbrt.exr"',
        'PixelFilter "box" "float xradius" [ 0.005 ] "float yradius" [ 0.005 ]',
        f'Sampler "zsobol" "integer pixelsamples" [ {samples} ]',
        'Integrator "path" "integer maxdepth" [ 1 ]',
        "WorldBegin",
    ]
    if environment:
        # environment.pfm takes column u for the azimuth atan2(y, x) = 2 pi u, our pictures for pi / 2 - 2 pi u:
        # x and y change places.
        turn = product(environment["rotation"], [[0, 1, 0], [1, 0, 0], [0, 0, 1]])
        lines += ["AttributeBegin", "Transform " + matrix([row + [0] for row in turn]),
                  f'LightSource "infinite" "string filename" "environment.pfm" "float scale" [ {environment["scale"]:.9g} ]',
                  "AttributeEnd"]
    indices = '"integer indices" [ 0 1 2 0 2 3 ]'
    for quad in scene["quads"]:
        lines += [f'Material "diffuse" "rgb reflectance" {numbers(quad["albedo"])}',
                  f'Shape "trianglemesh" {indices} "point3 P" {numbers(sum(quad["corners"], []))}']
    for mesh in scene["meshes"]:
        lines += ["AttributeBegin", "Transform " + matrix(mesh["world_from_mesh"]),
                  f'Material "diffuse" "rgb reflectance" {numbers(mesh["albedo"])}',
                  f'Shape "plymesh" "string filename" "{mesh["file"]}"', "AttributeEnd"]
    for light in scene["rectangles"]:
        lines += ["AttributeBegin", f'AreaLightSource "diffuse" "rgb L" {numbers(light["radiance"])}',
                  # Of opacity 0: lit by, but not seen, like our lights and the other peers'.
                  f'Shape "trianglemesh" {indices} "point3 P" {numbers(sum(light["corners"], []))} "float alpha" [ 0 ]',
                  "AttributeEnd"]
    for lamp in scene["lamps"]:
        rows = [row + [p] for row, p in zip(lamp["frame"], lamp["position"])]
        lines += ["AttributeBegin", "Transform " + matrix(rows),
                  f'LightSource "goniometric" "string filename" "distribution_{lamp["distribution"]}.pfm" '
                  f'"float scale" [ {lamp["scale"]:.9g} ]', "AttributeEnd"]
    return "\n".join(lines) + "\n"
