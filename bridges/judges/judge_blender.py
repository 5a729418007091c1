"""Illuminance that Blender's Cycles finds of an exported lamp, baked onto a small white square at each receiver.

    python judge_blender.py lamp.json receivers.json answer.json [SAMPLES] [REPEATS]

run by a Python that has Blender as a module (bpy), or by `blender --background --factory-startup --python ... --`.
"""

import math
import pathlib
import statistics
import sys

import bpy

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import receivers  # noqa: E402

sys.path[:0] = [str(receivers.BRIDGES / "blender"), str(receivers.BRIDGES)]
import luxfield_lamp


def squares(positions, normals):
    """One mesh of squares, each of which covers one pixel of a square image."""
    columns = math.ceil(math.sqrt(len(positions)))
    corners, faces, places = [], [], []
    for k, (p, n) in enumerate(zip(positions, normals)):
        a, b = receivers.frame(n)
        half = receivers.half_side(p)
        faces.append(tuple(range(4 * k, 4 * k + 4)))
        for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            corners.append([p[i] + half * (x * a[i] + y * b[i]) for i in range(3)])
            places.append(((k % columns + 0.5 + 0.5 * x) / columns, (k // columns + 0.5 + 0.5 * y) / columns))
    mesh = bpy.data.meshes.new("receivers")
    mesh.from_pydata(corners, [], faces)
    layer = mesh.uv_layers.new()
    for loop in mesh.loops:
        layer.data[loop.index].uv = places[loop.vertex_index]
    return mesh, columns


def main(lamp, receivers_file, answer, samples=1024, repeats=8):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    positions, normals = receivers.read(receivers_file)
    luxfield_lamp.add_lamp(lamp)
    mesh, columns = squares(positions, normals)
    target = bpy.data.objects.new("receivers", mesh)
    target.visible_shadow = target.visible_diffuse = False  # no receiver takes another's light
    bpy.context.scene.collection.objects.link(target)

    white = bpy.data.materials.new("white")
    white.use_nodes = True
    tree = white.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    tree.links.new(diffuse.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    baked = bpy.data.images.new("baked", columns, columns, float_buffer=True)
    baked.colorspace_settings.name = "Non-Color"
    picture = tree.nodes.new("ShaderNodeTexImage")
    picture.image = baked
    tree.nodes.active = picture
    mesh.materials.append(white)

    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = int(samples)
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.sample_clamp_direct = 0
    scene.cycles.max_bounces = 0
    scene.cycles.light_sampling_threshold = 0
    scene.render.bake.margin = 0
    scene.render.bake.use_pass_direct, scene.render.bake.use_pass_indirect = True, False
    scene.render.bake.use_pass_color = False
    bpy.context.view_layer.objects.active = target
    target.select_set(True)

    found = []
    for seed in range(int(repeats)):
        scene.cycles.seed = seed
        bpy.ops.object.bake(type="DIFFUSE")
        pixels = list(baked.pixels)
        found.append([math.pi * sum(w * pixels[4 * k + c] for c, w in enumerate(receivers.LUMINANCE))
                      for k in range(len(positions))])
    means = [statistics.fmean(values) for values in zip(*found)]
    sigmas = [statistics.stdev(values) / math.sqrt(len(values)) for values in zip(*found)]
    receivers.write(answer, f"Blender {bpy.app.version_string}", means, sigmas)


if __name__ == "__main__":
    main(*(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]))
