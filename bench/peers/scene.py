"""Our scene.toml in the terms that other renderers share: surfaces, lights, camera, in world coordinates.

read_scene(path) gives a dictionary that JSON can hold, lengths in metres:

    camera       position, look_at, up, vertical_fov_deg, width, height
    quads        [{"corners": four points in order, "albedo"}]
    meshes       [{"file": binary PLY, "world_from_mesh": 3 rows of 4, "albedo"}]
    rectangles   [{"corners", "frame": columns x, y, z as rows, "position", "size", "radiance"}]; they shine along z
    lamps        [{"frame", "position", "scale", "distribution": index}], points of a photometric file
    distributions  as ies.read, with "file"
    environment  {"file", "scale", "rotation"} or null

What peers have no counterpart of is refused by name.
"""

import itertools
import math
import pathlib
import struct
import tomllib

import ies
from refused import Refused


# ---- vectors and rotations --------------------------------------------------------------------


def add(a, b):
    return [x + y for x, y in zip(a, b)]


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


# ---- what the scene holds ---------------------------------------------------------------------


def copies(entry):
    """The steps from an entry to each copy that its arrays make."""
    steps = [[[k * x for x in array["step"]] for k in range(array["count"])] for array in entry.get("array", [])]
    for combination in itertools.product(*steps):
        yield [sum(axis) for axis in zip([0, 0, 0], *combination)]


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
                corners.append(add(apply(turn, local), box["position"]))
            faces.append(corners)
    return faces


def quad_corners(quad):
    c, u, v = quad["corner"], quad["edge_u"], quad["edge_v"]
    return [c, add(c, u), add(add(c, u), v), add(c, v)]


def read_materials(toml, path):
    albedo = {}
    for material in toml.get("material", []):
        if material.get("kind", "lambert") != "lambert" or "texture" in material or "normal_texture" in material:
            raise Refused(f"{path}: material {material['name']}: plain lambert only")
        albedo[material["name"]] = material["albedo"]
    return albedo


def read_mesh(entry, albedo, path):
    file = pathlib.Path(path).parent / entry["file"]
    if "material" not in entry:
        raise Refused(f"{path}: [[mesh]] {entry['file']}: name a material; files' own are not read")
    with open(file, "rb") as stream:
        header = stream.read(4096).split(b"end_header")[0]
    if not header.startswith(b"ply") or b"binary_little_endian" not in header or b" nx" in header:
        raise Refused(f"{file}: binary little-endian PLY of flat facets only")
    turn = rotation(entry.get("rotate_deg", [0, 0, 0]))
    scale, position = entry.get("scale", [1, 1, 1]), entry.get("position", [0, 0, 0])
    rows = [[x * s for x, s in zip(row, scale)] + [p] for row, p in zip(turn, position)]
    return {"file": str(file.resolve()), "world_from_mesh": rows, "albedo": albedo[entry["material"]]}


def read_rectangles(light, path):
    if light["kind"] != "rectangle":
        raise Refused(f"{path}: lights of kind {light['kind']}: rectangles only")
    axes = frame(light)
    w, h = (s / 2 for s in light["size"])
    for step in copies(light):
        position = add(light["position"], step)
        corners = [add(apply(axes, [a * w, b * h, 0]), position) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        yield {"corners": corners, "frame": axes, "position": position, "size": light["size"],
               "radiance": light["radiance"]}


def read_lamps(entry, distributions, path):
    if entry.get("model") != "point":
        what = f"model {entry['model']}" if "model" in entry else "a light field"
        raise Refused(f"{path}: [[luminaire]] of {what}: peers have points of a photometric file only")
    file = str((pathlib.Path(path).parent / entry["distribution"]).resolve())
    index = next((k for k, d in enumerate(distributions) if d["file"] == file), len(distributions))
    if index == len(distributions):
        distributions.append({"file": file} | ies.read(file))
    for step in copies(entry):
        yield {"frame": frame(entry), "position": add(entry["position"], step), "scale": entry.get("scale", 1),
               "distribution": index}


def read_environment(entry, path):
    return {"file": latlong_picture(pathlib.Path(path).parent / entry["file"]), "scale": entry.get("scale", 1),
            "rotation": rotation(entry.get("rotate_deg", [0, 0, 0]))}


def read_scene(path):
    with open(path, "rb") as file:
        toml = tomllib.load(file)
    quads, lamps, distributions = [], [], []
    for entry in toml.get("luminaire", []):
        lamps += read_lamps(entry, distributions, path)
    albedo = read_materials(toml, path)
    for entry in toml.get("quad", []):
        quads += [{"corners": [add(c, step) for c in quad_corners(entry)], "albedo": albedo[entry["material"]]}
                  for step in copies(entry)]
    for entry in toml.get("box", []):
        quads += [{"corners": [add(c, step) for c in corners], "albedo": albedo[entry["material"]]}
                  for step in copies(entry) for corners in box_faces(entry)]
    rectangles = [r for light in toml.get("light", []) for r in read_rectangles(light, path)]
    if rectangles and "environment" in toml:
        raise Refused(f"{path}: the peers' rectangles hide the sky behind them: [[light]] or [environment], not both")
    return {
        "camera": {"up": [0, 0, 1], "vertical_fov_deg": 40, "width": 1024, "height": 768} | toml["camera"],
        "quads": quads,
        "meshes": [read_mesh(entry, albedo, path) for entry in toml.get("mesh", [])],
        "rectangles": rectangles,
        "lamps": lamps,
        "distributions": distributions,
        "environment": read_environment(toml["environment"], path) if "environment" in toml else None,
    }
