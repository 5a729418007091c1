#!/usr/bin/env python3
"""A scene.toml as a pbrt-v4 scene and as a script for Blender (Cycles): same geometry, camera, light.

    bench/peers/export.py SCENE.toml -o FOLDER

writes FOLDER/scene.pbrt and FOLDER/scene_cycles.py. README.md beside this file says how they are run
and compared. What the three renderers do not share is refused by name: luminaires (light fields),
meshes, textures, materials other than lambert, environment maps that are not latitude-longitude
pictures of 2 : 1.
"""

import argparse
import json
import math
import pathlib
import struct
import sys
import tomllib


class Refused(Exception):
    pass


# ---- vectors and rotations --------------------------------------------------------------------


def subtract(a, b):
    return [x - y for x, y in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def normalized(a):
    length = math.sqrt(sum(x * x for x in a))
    if length == 0:
        raise Refused("a direction of length 0")
    return [x / length for x in a]


def apply(m, v):
    return [sum(x * y for x, y in zip(row, v)) for row in m]


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def transposed(m):
    return [list(column) for column in zip(*m)]


def rotation(degrees):
    """About the world's x axis, then y, then z."""
    (cx, cy, cz), (sx, sy, sz) = zip(*[(math.cos(math.radians(d)), math.sin(math.radians(d))) for d in degrees])
    about_x = [[1, 0, 0], [0, cx, -sx], [0, sx, cx]]
    about_y = [[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]
    about_z = [[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]
    return product(about_z, product(about_y, about_x))


def frame(entry):
    """Columns x, y, z of a luminaire's or a light's frame (docs/formats/scene.md)."""
    if "look_at" not in entry:
        return rotation(entry.get("rotate_deg", [0, 0, 0]))
    z = normalized(subtract(entry["look_at"], entry["position"]))
    x = normalized(cross(entry.get("up", [0, 0, 1]), z))
    return transposed([x, cross(z, x), z])


# ---- the scene --------------------------------------------------------------------------------


def latlong_picture(path):
    """The picture's absolute path, if it is a latitude-longitude one of whole pixels."""
    data = path.read_bytes()
    if data[:4] == bytes([0x76, 0x2F, 0x31, 0x01]):
        header = data[:65536]
        if b"envmap\0" in header:
            raise Refused(f"{path}: its envmap attribute counts pixels from the borders; no peer does")
        at = header.find(b"dataWindow\0box2i\0")
        x0, y0, x1, y1 = struct.unpack_from("<4i", header, at + 21)
        width, height = x1 - x0 + 1, y1 - y0 + 1
    else:
        line = next((l for l in data[:65536].split(b"\n") if l.startswith(b"-Y ")), None)
        if line is None:
            raise Refused(f"{path}: its rows do not run from top to bottom (-Y ... +X ...)")
        height, width = int(line.split()[1]), int(line.split()[3])
    if width != 2 * height:
        raise Refused(f"{path}: {width} x {height} pixels; the peers take latitude-longitude, 2 : 1")
    return str(path.resolve())


def box_faces(box):
    turn = rotation(box.get("rotate_deg", [0, 0, 0]))
    half = [s / 2 for s in box["size"]]
    faces = []
    for axis in range(3):
        for sign in (-1, 1):
            u, v, w = [0, 0, 0], [0, 0, 0], [0, 0, 0]
            w[axis], u[(axis + 1) % 3], v[(axis + 2) % 3] = sign, 1, sign  # u x v points outwards
            corners = []
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                local = [(w[k] + a * u[k] + b * v[k]) * half[k] for k in range(3)]
                corners.append([p + q for p, q in zip(apply(turn, local), box["position"])])
            faces.append(corners)
    return faces


def read_scene(path):
    """Camera, quadrilaterals (corners in order, albedo), rectangular lights, environment."""
    with open(path, "rb") as file:
        toml = tomllib.load(file)
    for name in ("luminaire", "mesh"):
        if name in toml:
            raise Refused(f"{path}: [[{name}]] has no counterpart in all three renderers")
    albedo = {}
    for material in toml.get("material", []):
        if material.get("kind", "lambert") != "lambert" or "texture" in material or "normal_texture" in material:
            raise Refused(f"{path}: material {material['name']}: plain lambert only")
        albedo[material["name"]] = material["albedo"]
    quads = []
    for quad in toml.get("quad", []):
        c, u, v = quad["corner"], quad["edge_u"], quad["edge_v"]
        corners = [c, [p + q for p, q in zip(c, u)], [p + q + r for p, q, r in zip(c, u, v)],
                   [p + q for p, q in zip(c, v)]]
        quads.append((corners, albedo[quad["material"]]))
    for box in toml.get("box", []):
        quads += [(corners, albedo[box["material"]]) for corners in box_faces(box)]
    lights = []
    for light in toml.get("light", []):
        if light["kind"] != "rectangle":
            raise Refused(f"{path}: lights of kind {light['kind']}: rectangles only")
        axes = frame(light)
        w, h = (s / 2 for s in light["size"])
        corners = [[p + q for p, q in zip(apply(axes, [a * w, b * h, 0]), light["position"])]
                   for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        lights.append((corners, light["radiance"]))
    environment = None
    if lights and "environment" in toml:
        raise Refused(f"{path}: the peers' rectangles hide the sky behind them: [[light]] or [environment], not both")
    if "environment" in toml:
        entry = toml["environment"]
        environment = {"file": latlong_picture(pathlib.Path(path).parent / entry["file"]),
                       "scale": entry.get("scale", 1),
                       "rotation": rotation(entry.get("rotate_deg", [0, 0, 0]))}
    camera = {"up": [0, 0, 1], "vertical_fov_deg": 40, "width": 1024, "height": 768} | toml["camera"]
    return camera, quads, lights, environment


# ---- pbrt-v4 ----------------------------------------------------------------------------------


def numbers(values):
    return "[ " + " ".join(f"{v:.9g}" for v in values) + " ]"


def pbrt_scene(camera, quads, lights, environment, samples):
    w, h = camera["width"], camera["height"]
    half = math.tan(math.radians(camera["vertical_fov_deg"]) / 2)
    shorter = 2 * math.degrees(math.atan(half * min(1, w / h)))  # pbrt's fov is that of the shorter side
    lines = [
        "# Direct light only; a box filter; radiance as it is.",
        "Scale -1 1 1",  # pbrt's camera is left-handed
        "LookAt " + " ".join(f"{v:.9g}" for v in camera["position"] + camera["look_at"] + camera["up"]),
        f'Camera "perspective" "float fov" [ {shorter:.9g} ]',
        f'Film "rgb" "integer xresolution" [ {w} ] "integer yresolution" [ {h} ] "string filename" "pbrt.exr"',
        'PixelFilter "box" "float xradius" [ 0.5 ] "float yradius" [ 0.5 ]',
        f'Sampler "independent" "integer pixelsamples" [ {samples} ]',
        'Integrator "path" "integer maxdepth" [ 1 ]',
        "WorldBegin",
    ]
    if environment:
        # imgtool takes column u for the azimuth atan2(y, x) = 2 pi u, our pictures for pi / 2 - 2 pi u:
        # x and y change places.
        m = product(environment["rotation"], [[0, 1, 0], [1, 0, 0], [0, 0, 1]])
        columns = [value for j in range(3) for value in (m[0][j], m[1][j], m[2][j], 0)] + [0, 0, 0, 1]
        lines += ["AttributeBegin", "Transform " + numbers(columns),
                  f'LightSource "infinite" "string filename" "environment.exr" "float scale" [ {environment["scale"]:.9g} ]',
                  "AttributeEnd"]
    indices = '"integer indices" [ 0 1 2 0 2 3 ]'
    for corners, albedo in quads:
        lines += [f'Material "diffuse" "rgb reflectance" {numbers(albedo)}',
                  f'Shape "trianglemesh" {indices} "point3 P" {numbers(sum(corners, []))}']
    for corners, radiance in lights:
        lines += ["AttributeBegin", f'AreaLightSource "diffuse" "rgb L" {numbers(radiance)}',
                  # Of opacity 0: lit by, but not seen, like our lights and Blender's light below.
                  f'Shape "trianglemesh" {indices} "point3 P" {numbers(sum(corners, []))} "float alpha" [ 0 ]',
                  "AttributeEnd"]
    return "\n".join(lines) + "\n"


# ---- Blender ----------------------------------------------------------------------------------

CYCLES = '''# blender --background --factory-startup --python scene_cycles.py
# Made by bench/peers/export.py: direct light only, a box filter, radiance as it is.
import json
import math
import os

import bpy
from mathutils import Matrix, Vector

scene_data = json.loads("""@SCENE@""")
camera_data, samples = scene_data["camera"], scene_data["samples"]

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.samples = samples
scene.cycles.use_adaptive_sampling = False
scene.cycles.use_denoising = False
scene.cycles.max_bounces = 0
scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0
scene.cycles.pixel_filter_type = "BOX"
scene.render.resolution_x, scene.render.resolution_y = camera_data["width"], camera_data["height"]
scene.render.resolution_percentage = 100
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = os.path.abspath("cycles.exr")

position, target, up = (Vector(camera_data[k]) for k in ("position", "look_at", "up"))
forward = (target - position).normalized()
right = forward.cross(up).normalized()
axes = Matrix((right, right.cross(forward), -forward)).transposed().to_4x4()
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.matrix_world = Matrix.Translation(position) @ axes
camera.data.sensor_fit = "VERTICAL"
camera.data.angle = math.radians(camera_data["vertical_fov_deg"])
scene.collection.objects.link(camera)
scene.camera = camera


def add_quad(name, corners, shader, inputs, one_sided):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output, surface = nodes.new("ShaderNodeOutputMaterial"), nodes.new(shader)
    for key, value in inputs.items():
        surface.inputs[key].default_value = value
    if one_sided:  # light on the side that the normal points to
        mix, geometry = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeNewGeometry")
        links.new(geometry.outputs["Backfacing"], mix.inputs[0])
        links.new(surface.outputs[0], mix.inputs[1])
        links.new(mix.outputs[0], output.inputs["Surface"])
    else:
        links.new(surface.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    quad = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(quad)
    return quad


for k, (corners, albedo) in enumerate(scene_data["quads"]):
    add_quad(f"quad {k}", corners, "ShaderNodeBsdfDiffuse", {"Color": (*albedo, 1)}, False)
for k, (corners, radiance) in enumerate(scene_data["lights"]):
    light = add_quad(f"light {k}", corners, "ShaderNodeEmission", {"Color": (*radiance, 1), "Strength": 1}, True)
    light.visible_camera = False

world = bpy.data.worlds.new("world")
scene.world = world
world.use_nodes = True
nodes, links = world.node_tree.nodes, world.node_tree.links
background = nodes["Background"]
environment = scene_data["environment"]
background.inputs["Color"].default_value = (0, 0, 0, 1)
if environment:
    background.inputs["Strength"].default_value = environment["scale"]
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.interpolation = "Closest"
    texture.image = bpy.data.images.load(environment["file"])
    texture.image.colorspace_settings.name = "Non-Color"
    # Rows of the matrix that turns a direction of the world into the texture's.
    coordinates, combine = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeCombineXYZ")
    for k, row in enumerate(environment["texture_from_world"]):
        dot = nodes.new("ShaderNodeVectorMath")
        dot.operation = "DOT_PRODUCT"
        links.new(coordinates.outputs["Generated"], dot.inputs[0])
        dot.inputs[1].default_value = row
        links.new(dot.outputs["Value"], combine.inputs[k])
    links.new(combine.outputs[0], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], background.inputs["Color"])

bpy.ops.render.render(write_still=True)
'''


def cycles_script(camera, quads, lights, environment, samples):
    data = {"camera": camera, "quads": quads, "lights": lights, "environment": None, "samples": samples}
    if environment:
        # Cycles takes column u for the azimuth atan2(y, x) = pi - 2 pi u, our pictures for
        # pi / 2 - 2 pi u: a quarter turn about z.
        quarter = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
        data["environment"] = {"file": environment["file"], "scale": environment["scale"],
                               "texture_from_world": product(quarter, transposed(environment["rotation"]))}
    return CYCLES.replace("@SCENE@", json.dumps(data, indent=1).replace("\\", "\\\\"))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="folder")
    parser.add_argument("--spp", type=int, default=256)
    arguments = parser.parse_args()
    try:
        scene = read_scene(arguments.scene)
    except (Refused, OSError, tomllib.TOMLDecodeError, KeyError) as error:
        print(f"export.py: {error}", file=sys.stderr)
        return 2
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "scene.pbrt").write_text(pbrt_scene(*scene, arguments.spp))
    (arguments.output / "scene_cycles.py").write_text(cycles_script(*scene, arguments.spp))
    environment = scene[3]
    if environment:
        print(f"imgtool makeequiarea --outfile {arguments.output}/environment.exr {environment['file']}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
