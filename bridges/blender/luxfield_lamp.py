"""A luxfield lamp in Blender's Cycles, of what `luxfield export --to blender -o lamp.json` writes.

As an add-on (Edit > Preferences > Add-ons > Install): File > Import > Luxfield lamp (.json). In a script:

    import luxfield_lamp
    lamp = luxfield_lamp.add_lamp("lamp.json")      # an empty, with the lamp's face as its child

The lamp shines towards +z of the empty (docs/axes.md); a unit of Blender is a metre. The material of the face emits

    L = delta^2 / cos^4 sum C_ij(s) Phi_ij(u)

(docs/theory.md 2), built of Blender's own nodes: C lies in an image of floats whose pixel (column W + i, row H + j) is
C_ij of that texel, so that the image's linear interpolation between neighbouring i and j, at a texel, makes the basis
functions (docs/bridges.md). Emission is in cd/m^2 of a light field in lm: a diffuse white surface at E lx shows E / pi.
"""

import json
import math
import pathlib

import bpy
import mathutils

bl_info = {
    "name": "Luxfield lamp",
    "description": "Measured lamps as light fields",
    "blender": (3, 4, 0),
    "category": "Import-Export",
    "location": "File > Import > Luxfield lamp (.json)",
}


class Nodes:
    """Arithmetic in a material's node tree. Values are sockets or numbers."""

    def __init__(self, tree):
        self.tree = tree

    def new(self, kind, **settings):
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    def put(self, value, socket):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def math(self, operation, *values):
        node = self.new("ShaderNodeMath", operation=operation)
        for value, socket in zip(values, node.inputs):
            self.put(value, socket)
        return node.outputs[0]

    def add(self, *values):
        total = values[0]
        for value in values[1:]:
            total = self.math("ADD", total, value)
        return total

    def sub(self, a, b):
        return self.math("SUBTRACT", a, b)

    def mul(self, *values):
        total = values[0]
        for value in values[1:]:
            total = self.math("MULTIPLY", total, value)
        return total

    def div(self, a, b):
        return self.math("DIVIDE", a, b)

    def bound(self, low, value, high):
        return self.math("MINIMUM", self.math("MAXIMUM", value, low), high)

    def split(self, vector):
        node = self.new("ShaderNodeSeparateXYZ")
        self.tree.links.new(vector, node.inputs[0])
        return node.outputs

    def join(self, x, y):
        node = self.new("ShaderNodeCombineXYZ")
        self.put(x, node.inputs[0])
        self.put(y, node.inputs[1])
        return node.outputs[0]


def lookups(nodes, basis, cell, way):
    """Places in units of basis functions at which C is interpolated linearly, and their weights: docs/bridges.md."""
    name = basis["name"]
    if name == "box":
        return [(cell, 1.0)]
    if name == "bspline2":
        half = nodes.mul(way, 0.5)
        return [(nodes.add(cell, -1.5, half), nodes.sub(1.0, way)), (nodes.add(cell, -1.0, half), way)]
    # Two functions on a cell, first the one that ends there.
    (begins, ends) = basis["cells"]
    values = [nodes.add(c[0], nodes.mul(way, nodes.add(c[1], nodes.mul(way, c[2])))) for c in (ends, begins)]
    total = nodes.add(*values)
    return [(nodes.add(cell, -1.0, nodes.div(values[1], total)), total)]


def along(nodes, place, origin, spacing, count, basis):
    """Along an axis of the face: (place of the image within a texel, weight) of each lookup."""
    x = nodes.div(nodes.sub(place, origin), spacing)
    cell = nodes.bound(0.0, nodes.math("FLOOR", x), float(count + len(basis["cells"]) - 2))
    way = nodes.bound(0.0, nodes.sub(x, cell), 1.0)
    found = []
    for y, weight in lookups(nodes, basis, cell, way):
        # What linear interpolation between C at 0 .. count - 1, and 0 beyond, leaves of the nearest place within.
        ramp = nodes.mul(nodes.bound(0.0, nodes.add(1.0, y), 1.0), nodes.bound(0.0, nodes.sub(float(count), y), 1.0))
        found.append((nodes.bound(0.0, y, count - 1.0), nodes.mul(weight, ramp)))
    return found


def texel(nodes, start, slope, place, first, size, count):
    """Number of a texel on I, and 1 where there is one, else 0."""
    number = nodes.math("FLOOR", nodes.div(nodes.sub(nodes.add(place, nodes.mul(slope, start)), first), size))
    inside = nodes.mul(nodes.math("GREATER_THAN", number, -0.5), nodes.math("LESS_THAN", number, count - 0.5))
    return nodes.bound(0.0, number, count - 1.0), inside


def material_of(field, image, name):
    """The material that emits a field from its face, whose own coordinates are metres of the field's frame."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    nodes = Nodes(tree)
    grid, images, basis, delta = field["grid"], field["images"], field["basis"], field["delta_m"]

    u, v, _ = nodes.split(nodes.new("ShaderNodeTexCoord").outputs["Object"])
    turned = nodes.new("ShaderNodeVectorTransform", vector_type="VECTOR", convert_from="WORLD", convert_to="OBJECT")
    tree.links.new(nodes.new("ShaderNodeNewGeometry").outputs["Incoming"], turned.inputs[0])
    normalized = nodes.new("ShaderNodeVectorMath", operation="NORMALIZE")
    tree.links.new(turned.outputs[0], normalized.inputs[0])
    x, y, z = nodes.split(normalized.outputs[0])
    before = nodes.math("GREATER_THAN", z, 1e-4)
    cosine = nodes.math("MAXIMUM", z, 1e-4)

    column, lit_column = texel(nodes, delta, nodes.div(x, cosine), u, images["s0_m"], images["ds_m"], images["columns"])
    row, lit_row = texel(nodes, -delta, nodes.div(y, cosine), nodes.mul(v, -1.0), -images["t1_m"], images["dt_m"],
                         images["rows"])
    width, height = images["columns"] * grid["width"], images["rows"] * grid["height"]
    total = None
    for j, weight_v in along(nodes, v, grid["v0_m"], grid["spacing_m"], grid["height"], basis):
        image_v = nodes.sub(1.0, nodes.div(nodes.add(nodes.mul(row, float(grid["height"])), j, 0.5), float(height)))
        for i, weight_u in along(nodes, u, grid["u0_m"], grid["spacing_m"], grid["width"], basis):
            image_u = nodes.div(nodes.add(nodes.mul(column, float(grid["width"])), i, 0.5), float(width))
            picture = nodes.new("ShaderNodeTexImage", image=image, interpolation="Linear", extension="EXTEND")
            tree.links.new(nodes.join(image_u, image_v), picture.inputs[0])
            scaled = nodes.new("ShaderNodeVectorMath", operation="SCALE")
            tree.links.new(picture.outputs["Color"], scaled.inputs[0])
            nodes.put(nodes.mul(weight_u, weight_v), scaled.inputs["Scale"])
            if total is None:
                total = scaled.outputs[0]
            else:
                sum_node = nodes.new("ShaderNodeVectorMath", operation="ADD")
                tree.links.new(total, sum_node.inputs[0])
                tree.links.new(scaled.outputs[0], sum_node.inputs[1])
                total = sum_node.outputs[0]

    emission = nodes.new("ShaderNodeEmission")
    tree.links.new(total, emission.inputs["Color"])
    level = nodes.div(delta * delta, nodes.math("POWER", cosine, 4.0))
    tree.links.new(nodes.mul(level, before, lit_column, lit_row), emission.inputs["Strength"])
    output = nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    if hasattr(material, "cycles") and hasattr(material.cycles, "emission_sampling"):  # Blender 3.5 on
        material.cycles.emission_sampling = "FRONT"
    return material


def face_of(field, name):
    """A quad for each knot cell: lights of a mesh are chosen quad by quad."""
    grid, n = field["grid"], len(field["basis"]["cells"])
    columns, rows, h = grid["width"] + n - 1, grid["height"] + n - 1, grid["spacing_m"]
    corners = [(grid["u0_m"] + a * h, grid["v0_m"] + b * h, 0.0) for b in range(rows + 1) for a in range(columns + 1)]
    at = lambda a, b: b * (columns + 1) + a
    quads = [(at(a, b), at(a + 1, b), at(a + 1, b + 1), at(a, b + 1)) for b in range(rows) for a in range(columns)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], quads)
    return mesh


def add_lamp(filename, collection=None):
    """Adds the lamp of a JSON file to a collection (the scene's, by default); returns its empty."""
    path = pathlib.Path(filename)
    facts = json.loads(path.read_text())
    if facts.get("format") != "luxfield lamp atlas" or facts.get("version") != 1:
        raise ValueError(f"{path}: is no lamp of `luxfield export --to blender` that this add-on knows")
    collection = collection or bpy.context.scene.collection
    lamp = bpy.data.objects.new(path.stem, None)
    lamp.empty_display_type = "SINGLE_ARROW"
    collection.objects.link(lamp)
    for number, field in enumerate(facts["fields"]):
        name = f"{path.stem}.{number}"
        image = bpy.data.images.load(str(path.parent / field["atlas"]), check_existing=True)
        image.colorspace_settings.name = "Non-Color"
        face = bpy.data.objects.new(name, face_of(field, name))
        face.data.materials.append(material_of(field, image, name))
        pose = [field["luminaire_from_field"][4 * row:4 * row + 4] for row in range(3)] + [[0, 0, 0, 1]]
        face.parent = lamp
        face.matrix_local = mathutils.Matrix(pose)
        collection.objects.link(face)
    return lamp


class ImportLuxfieldLamp(bpy.types.Operator):
    """Adds a measured lamp, as exported by luxfield"""

    bl_idname = "import_scene.luxfield_lamp"
    bl_label = "Luxfield lamp (.json)"
    bl_options = {"UNDO"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(default="*.json", options={"HIDDEN"})

    def execute(self, context):
        try:
            lamp = add_lamp(self.filepath, context.collection)
        except (OSError, ValueError, KeyError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        lamp.location = context.scene.cursor.location
        lamp.rotation_euler = (math.pi, 0.0, 0.0)  # it hangs, and shines down
        return {"FINISHED"}

    def invoke(self, context, _):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


def menu_entry(self, _):
    self.layout.operator(ImportLuxfieldLamp.bl_idname)


def register():
    bpy.utils.register_class(ImportLuxfieldLamp)
    bpy.types.TOPBAR_MT_file_import.append(menu_entry)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(menu_entry)
    bpy.utils.unregister_class(ImportLuxfieldLamp)


if __name__ == "__main__":
    register()
