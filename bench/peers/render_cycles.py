#!/usr/bin/env python3
"""A scene of export.py through Blender's Cycles: direct light, a ray through the middle of each pixel, radiance as it is.

    python3 render_cycles.py SCENE.json -o cycles.exr --spp 64        # with Blender as the module bpy
    blender --background --factory-startup --python render_cycles.py -- SCENE.json -o cycles.exr --spp 64
"""

import json
import math
import pathlib
import sys

import bpy
from mathutils import Matrix, Vector

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import arguments

# Candela that Cycles makes of 1 in a photometric file, for a lamp of 1 W: a lamp of 4 pi W has 1 W/sr, and Cycles takes
# lumens for watts of D65 at 177.83 lm/W (its ies.cpp).
WATTS_OF_A_LAMP = 177.83


def matrix_of(columns, position):
    return Matrix.Translation(position) @ Matrix(columns).to_4x4()


def link(name, data, matrix=None):
    thing = bpy.data.objects.new(name, data)
    if matrix:
        thing.matrix_world = matrix
    bpy.context.scene.collection.objects.link(thing)
    return thing


def set_up(scene, samples, seed, threads, output):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    target = bpy.context.scene
    target.render.engine = "CYCLES"
    cycles = target.cycles
    cycles.device = "CPU"
    cycles.samples, cycles.seed = samples, seed
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01
    render, camera = target.render, scene["camera"]
    if threads:
        render.threads_mode, render.threads = "FIXED", threads
    render.resolution_x, render.resolution_y = camera["width"], camera["height"]
    render.resolution_percentage = 100
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.filepath = str(output.resolve())


def add_camera(camera):
    position, target, up = (Vector(camera[k]) for k in ("position", "look_at", "up"))
    forward = (target - position).normalized()
    right = forward.cross(up).normalized()
    axes = Matrix((right, right.cross(forward), -forward)).transposed()
    thing = link("camera", bpy.data.cameras.new("camera"), matrix_of(axes, position))
    thing.data.sensor_fit = "VERTICAL"
    thing.data.angle = math.radians(camera["vertical_fov_deg"])
    bpy.context.scene.camera = thing


def diffuse(albedo):
    material = bpy.data.materials.new("diffuse")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    surface, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    surface.inputs["Color"].default_value = (*albedo, 1)
    material.node_tree.links.new(surface.outputs[0], output.inputs["Surface"])
    return material


def add_surfaces(scene):
    for quad in scene["quads"]:
        mesh = bpy.data.meshes.new("quad")
        mesh.from_pydata(quad["corners"], [], [(0, 1, 2, 3)])
        mesh.materials.append(diffuse(quad["albedo"]))
        link("quad", mesh)
    for entry in scene["meshes"]:
        bpy.ops.wm.ply_import(filepath=entry["file"], forward_axis="Y", up_axis="Z")
        thing = bpy.context.selected_objects[0]
        thing.matrix_world = Matrix((*entry["world_from_mesh"], (0, 0, 0, 1)))
        thing.data.shade_flat()
        thing.data.materials.clear()
        thing.data.materials.append(diffuse(entry["albedo"]))


def add_rectangles(rectangles):
    """Area lights of W watts and area A have the radiance W / (pi A), and shine along their -z axis."""
    for rectangle in rectangles:
        light = bpy.data.lights.new("rectangle", "AREA")
        light.shape = "RECTANGLE"
        light.size, light.size_y = rectangle["size"]
        strongest = max(rectangle["radiance"]) or 1
        light.energy = math.pi * light.size * light.size_y * strongest
        light.color = [r / strongest for r in rectangle["radiance"]]
        turned = [[row[0], -row[1], -row[2]] for row in rectangle["frame"]]
        link("rectangle", light, matrix_of(turned, rectangle["position"])).visible_camera = False


def add_lamps(lamps, distributions):
    """Points of a photometric file, whose nadir is the lamp's -z axis, its C0 plane towards -y."""
    lights = []
    for distribution in distributions:
        light = bpy.data.lights.new("lamp", "POINT")
        light.shadow_soft_size = 0
        light.energy = WATTS_OF_A_LAMP
        light.use_nodes = True
        nodes = light.node_tree.nodes
        texture = nodes.new("ShaderNodeTexIES")
        texture.mode, texture.filepath = "EXTERNAL", distribution["dense"]
        light.node_tree.links.new(texture.outputs["Fac"], nodes["Emission"].inputs["Strength"])
        lights.append(light)
    for lamp in lamps:
        light = lights[lamp["distribution"]]
        if lamp["scale"] != 1:
            light = light.copy()
            light.energy *= lamp["scale"]
        turned = [[-row[1], -row[0], -row[2]] for row in lamp["frame"]]
        link("lamp", light, matrix_of(turned, lamp["position"]))


def add_world(environment):
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = nodes["Background"]
    background.inputs["Color"].default_value = (0, 0, 0, 1)
    if not environment:
        return
    background.inputs["Strength"].default_value = environment["scale"]
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.interpolation = "Closest"
    texture.image = bpy.data.images.load(environment["file"])
    texture.image.colorspace_settings.name = "Non-Color"
    # Cycles takes column u for the azimuth atan2(y, x) = pi - 2 pi u, our pictures for pi / 2 - 2 pi u: a quarter turn
    # about z. Rows of the matrix that turns a direction of the world into the texture's.
    quarter = Matrix(((0, -1, 0), (1, 0, 0), (0, 0, 1)))
    coordinates, combine = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeCombineXYZ")
    for k, row in enumerate(quarter @ Matrix(environment["rotation"]).transposed()):
        dot = nodes.new("ShaderNodeVectorMath")
        dot.operation = "DOT_PRODUCT"
        links.new(coordinates.outputs["Generated"], dot.inputs[0])
        dot.inputs[1].default_value = row
        links.new(dot.outputs["Value"], combine.inputs[k])
    links.new(combine.outputs[0], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], background.inputs["Color"])


def main():
    how = arguments.parse(__doc__.splitlines()[0])
    if how.version:
        print(f"Blender {bpy.app.version_string}")
        return
    scene = json.loads(how.scene.read_text())
    set_up(scene, how.spp, how.seed, how.threads, how.output)
    add_camera(scene["camera"])
    add_surfaces(scene)
    add_rectangles(scene["rectangles"])
    add_lamps(scene["lamps"], scene["distributions"])
    add_world(scene["environment"])
    bpy.ops.render.render(write_still=True)


main()
