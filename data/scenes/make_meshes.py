#!/usr/bin/env python3
"""Writes the meshes of our scenes, data/scenes/meshes/*.glb: python3 data/scenes/make_meshes.py

Everything is built here from boxes, lathed profiles, tubes and spheres; the standard library suffices. Metres.
Built with z up and the origin on the ground; stored as glTF wants it, y up (`rotate_deg = [90, 0, 0]` in a scene).
"""
import json
import math
import pathlib
import struct

HERE = pathlib.Path(__file__).resolve().parent

# Base colour (linear Rec. 709), metallic, roughness.
MATERIALS = {
    "paint_red": ((0.46, 0.035, 0.03), 0, 0.22),
    "paint_green": ((0.04, 0.20, 0.12), 0, 0.25),
    "chrome": ((0.72, 0.72, 0.73), 1, 0.38),
    "steel": ((0.48, 0.48, 0.50), 1, 0.50),
    "rubber": ((0.03, 0.03, 0.03), 0, 0.75),
    "leather": ((0.10, 0.06, 0.04), 0, 0.50),
    "glass": ((0.03, 0.035, 0.04), 0, 0.06),
    "lamp_red": ((0.35, 0.02, 0.02), 0, 0.15),
    "lamp_clear": ((0.70, 0.70, 0.70), 0, 0.15),
    "plate": ((0.75, 0.74, 0.68), 0, 0.50),
    "marble": ((0.74, 0.72, 0.68), 0, 0.30),
    "stone": ((0.58, 0.54, 0.47), 0, 0.85),
    "bronze": ((0.52, 0.33, 0.16), 1, 0.32),
    "plaster": ((0.62, 0.55, 0.45), 0, 0.95),
    "wood": ((0.26, 0.14, 0.07), 0, 0.55),
    "sign_white": ((0.80, 0.80, 0.80), 0, 0.35),
    "sign_blue": ((0.03, 0.10, 0.45), 0, 0.35),
}


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2) or 1.0
    return (a[0] / length, a[1] / length, a[2] / length)


def axis(ring):
    """Unit normal of a closed polygon (Newell)."""
    total = (0.0, 0.0, 0.0)
    for a, b in zip(ring, ring[1:] + ring[:1]):
        n = cross(sub(a, ring[0]), sub(b, ring[0]))
        total = (total[0] + n[0], total[1] + n[1], total[2] + n[2])
    return unit(total)


class Mesh:
    """Parts by material: positions, normals, triangles."""

    def __init__(self):
        self.parts = {}

    def grid(self, material, rows, closed, flip=False):
        """A smooth surface through rows of points; `closed` joins the last column with the first."""
        positions, normals, triangles = self.parts.setdefault(material, ([], [], []))
        first, height, width = len(positions), len(rows), len(rows[0])
        for r in range(height):
            for c in range(width):
                left = rows[r][(c - 1) % width] if closed or c > 0 else rows[r][c]
                right = rows[r][(c + 1) % width] if closed or c < width - 1 else rows[r][c]
                below, above = rows[max(r - 1, 0)][c], rows[min(r + 1, height - 1)][c]
                normal = unit(cross(sub(right, left), sub(above, below)))
                if max(map(abs, sub(right, left))) < 1e-9:  # a pole: along the axis of the next row
                    normal = axis(rows[r - 1]) if r else tuple(-x for x in axis(rows[1]))
                positions.append(rows[r][c])
                normals.append(tuple(-x for x in normal) if flip else normal)
        for r in range(height - 1):
            for c in range(width if closed else width - 1):
                a, b = first + r * width + c, first + r * width + (c + 1) % width
                triangles += [(a, b, a + width), (b, b + width, a + width)]

    def lathe(self, material, profile, segments=24, place=lambda p: p, radius=lambda angle, z: 1.0):
        """The profile [(r, z) from below] about the z axis; sharp where a point stands twice."""
        start = 0
        for k in range(1, len(profile) + 1):
            if k == len(profile) or profile[k] == profile[k - 1]:
                rows = []
                for r, z in profile[start:k]:
                    ring = []
                    for i in range(segments):
                        angle = 2 * math.pi * i / segments
                        s = r * radius(angle, z)
                        ring.append(place((s * math.cos(angle), s * math.sin(angle), z)))
                    rows.append(ring)
                if len(rows) > 1:
                    self.grid(material, rows, True)
                start = k

    def sphere(self, material, centre, radii, segments=20):
        rows = []
        for k in range(segments // 2 + 1):
            polar = math.pi * (k / (segments // 2) - 0.5)
            rows.append([(centre[0] + radii[0] * math.cos(polar) * math.cos(2 * math.pi * i / segments),
                          centre[1] + radii[1] * math.cos(polar) * math.sin(2 * math.pi * i / segments),
                          centre[2] + radii[2] * math.sin(polar)) for i in range(segments)])
        self.grid(material, rows, True)

    def tube(self, material, path, radius, segments=10, closed=False):
        """Round bar along a path; capped unless the path is closed."""
        rows, count = [], len(path)
        side = None
        for k in range(count):
            before = path[(k - 1) % count] if closed or k > 0 else path[k]
            after = path[(k + 1) % count] if closed or k < count - 1 else path[k]
            ahead = unit(sub(after, before))
            if side is None:
                side = unit(cross(ahead, (0, 0, 1) if abs(ahead[2]) < 0.9 else (1, 0, 0)))
            side = unit(cross(cross(ahead, side), ahead))
            up = cross(side, ahead)
            r = radius[k] if isinstance(radius, (list, tuple)) else radius
            rows.append([tuple(path[k][x] + r * (math.cos(t) * side[x] - math.sin(t) * up[x]) for x in range(3))
                         for t in (2 * math.pi * i / segments for i in range(segments))])
        if closed:
            rows.append(rows[0])
        self.grid(material, rows, True)
        if not closed:
            for ring, end in ((rows[0], False), (rows[-1], True)):
                middle = tuple(sum(p[x] for p in ring) / segments for x in range(3))
                fan = [[middle] * segments, ring]
                self.grid(material, fan[::-1] if end else fan, True)

    def box(self, material, low, high):
        (x0, y0, z0), (x1, y1, z1) = low, high
        for quad in (((x0, y0, z0), (x0, y1, z0), (x1, y1, z0), (x1, y0, z0)),
                     ((x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)),
                     ((x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)),
                     ((x0, y1, z0), (x0, y1, z1), (x1, y1, z1), (x1, y1, z0)),
                     ((x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)),
                     ((x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1))):
            self.quad(material, quad)

    def quad(self, material, corners):
        positions, normals, triangles = self.parts.setdefault(material, ([], [], []))
        first = len(positions)
        positions += corners
        normals += [unit(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0])))] * 4
        triangles += [(first, first + 1, first + 2), (first, first + 2, first + 3)]

    def write(self, name):
        accessors, views, primitives, materials = [], [], [], []
        data = b""

        def add(values, fmt, kind, component, bounds=None):
            nonlocal data
            packed = b"".join(struct.pack(fmt, *v) for v in values)
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(packed)})
            accessor = {"bufferView": len(views) - 1, "componentType": component, "type": kind,
                        "count": len(values) * (3 if kind == "SCALAR" else 1)}
            if bounds:
                accessor["min"], accessor["max"] = bounds
            accessors.append(accessor)
            data += packed + b"\0" * (-len(packed) % 4)
            return len(accessors) - 1

        for material, (positions, normals, triangles) in sorted(self.parts.items()):
            assert len(positions) < 65536
            # Single precision before the bounds are taken: they must be the stored numbers'.
            swap = [struct.unpack("<3f", struct.pack("<3f", p[0], p[2], -p[1])) for p in positions]
            bounds = ([min(p[x] for p in swap) for x in range(3)], [max(p[x] for p in swap) for x in range(3)])
            primitives.append({
                "attributes": {"POSITION": add(swap, "<3f", "VEC3", 5126, bounds),
                               "NORMAL": add([(n[0], n[2], -n[1]) for n in normals], "<3f", "VEC3", 5126)},
                "indices": add(triangles, "<3H", "SCALAR", 5123), "material": len(materials)})
            colour, metallic, roughness = MATERIALS[material]
            materials.append({"name": material, "doubleSided": True,
                              "pbrMetallicRoughness": {"baseColorFactor": [*colour, 1], "metallicFactor": metallic,
                                                       "roughnessFactor": roughness}})
        document = {"asset": {"version": "2.0", "generator": "luxfield data/scenes/make_meshes.py"}, "scene": 0,
                    "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": primitives}],
                    "materials": materials, "accessors": accessors, "bufferViews": views,
                    "buffers": [{"byteLength": len(data)}]}
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        blob = (struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data)
        path = HERE / "meshes" / f"{name}.glb"
        path.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(blob)) + blob)
        print(f"{path.name}: {sum(len(t) for _, _, t in self.parts.values())} triangles, {path.stat().st_size} bytes")


def arc(centre, radius, start_deg, end_deg, steps, x=0.0):
    """Points in the plane x = const, angle from +y towards +z."""
    angles = [math.radians(start_deg + (end_deg - start_deg) * k / steps) for k in range(steps + 1)]
    return [(x, centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in angles]


def motorbike():
    """A naked motorcycle, 2.1 m long; forward is +y."""
    m = Mesh()
    for y in (-0.72, 0.74):
        wheel = (y, 0.32)
        m.tube("rubber", arc(wheel, 0.265, 0, 360, 32)[:-1], 0.055, 10, closed=True)
        m.tube("chrome", arc(wheel, 0.21, 0, 360, 32)[:-1], 0.012, 5, closed=True)
        m.tube("steel", arc(wheel, 0.13, 0, 360, 24)[:-1], 0.012, 4, closed=True)
        m.tube("steel", [(-0.09, *wheel), (0.09, *wheel)], 0.035, 12)
        for k in range(14):
            a, b = math.radians(360 * k / 14), math.radians(360 * k / 14 + 35)
            side = 0.03 if k % 2 else -0.03
            m.tube("chrome", [(side, y + 0.03 * math.cos(b), 0.32 + 0.03 * math.sin(b)),
                              (0, y + 0.21 * math.cos(a), 0.32 + 0.21 * math.sin(a))], 0.004, 5)
    for y, start, end in ((0.74, 35, 170), (-0.72, 20, 130)):  # mudguards
        for x in (-0.045, -0.015, 0.015, 0.045):
            m.tube("paint_red", arc((y, 0.32), 0.345, start, end, 10, x), 0.018, 6)
    for x in (-0.1, 0.1):
        m.tube("chrome", [(x, 0.74, 0.32), (x, 0.48, 0.98)], 0.024, 10)  # fork
        m.tube("steel", [(x, -0.72, 0.32), (x, -0.22, 0.40)], 0.022, 8)  # swing arm
        m.tube("chrome", [(x, -0.62, 0.36), (x, -0.46, 0.74)], [0.022, 0.03], 8)
        m.tube("steel", [(x * 0.6, 0.44, 0.92), (x, 0.2, 0.34), (x, -0.22, 0.34), (x, -0.30, 0.72)], 0.018, 8)
    m.tube("steel", [(0, 0.46, 0.95), (0, 0.0, 0.80), (0, -0.55, 0.74)], 0.024, 10)
    m.box("steel", (-0.14, -0.20, 0.26), (0.14, 0.14, 0.50))  # crankcase
    for k in range(8):  # cylinder with fins
        z = 0.50 + 0.03 * k
        m.lathe("steel", [(0.115, z), (0.115, z + 0.012)], 20, lambda p: (p[0], p[1] + 0.05, p[2]))
        m.lathe("steel", [(0.0, z + 0.012), (0.115, z + 0.012)], 20, lambda p: (p[0], p[1] + 0.05, p[2]))
    m.tube("steel", [(0, 0.05, 0.48), (0, 0.05, 0.74)], 0.085, 16)
    m.sphere("paint_red", (0, 0.14, 0.88), (0.15, 0.30, 0.13), 24)  # tank
    m.tube("chrome", [(0, 0.20, 0.99), (0, 0.20, 1.02)], 0.035, 14)
    m.sphere("leather", (0, -0.36, 0.82), (0.14, 0.34, 0.07), 24)  # saddle
    m.tube("lamp_red", [(0, -0.80, 0.76), (0, -0.84, 0.76)], 0.05, 14)
    shell = [(0.0, -0.10), (0.06, -0.085), (0.09, -0.03), (0.10, 0.04), (0.10, 0.04), (0.0, 0.045)]
    m.lathe("chrome", shell[:4], 24, lambda p: (p[0], 0.60 + p[2], 0.92 - p[1]))
    m.lathe("lamp_clear", shell[4:], 24, lambda p: (p[0], 0.60 + p[2], 0.92 - p[1]))
    bar = [(-0.38, 0.34, 1.06), (-0.2, 0.42, 1.10), (-0.1, 0.47, 1.02), (0.1, 0.47, 1.02), (0.2, 0.42, 1.10),
           (0.38, 0.34, 1.06)]
    m.tube("chrome", bar, 0.013, 8)
    for x in (-1, 1):
        m.tube("rubber", [(0.27 * x, 0.387, 1.083), (0.39 * x, 0.335, 1.057)], 0.019, 8)
        m.tube("chrome", [(0.24 * x, 0.40, 1.09), (0.30 * x, 0.36, 1.24)], 0.006, 5)
        m.sphere("chrome", (0.31 * x, 0.35, 1.27), (0.075, 0.02, 0.045), 14)
    for x in (-0.17, 0.17):  # exhausts
        m.tube("chrome", [(x * 0.6, 0.14, 0.56), (x, 0.30, 0.44), (x, 0.24, 0.26), (x, -0.2, 0.24), (x, -0.3, 0.26),
                          (x, -0.95, 0.36)], [0.022, 0.022, 0.022, 0.026, 0.045, 0.05], 12)
    m.tube("steel", [(-0.13, -0.1, 0.28), (-0.22, -0.22, 0.01)], 0.012, 6)  # stand
    m.write("motorbike")


def column():
    """A fluted column with base and capital: 4 m tall, shaft of 0.56 m."""
    m = Mesh()
    m.box("marble", (-0.42, -0.42, 0), (0.42, 0.42, 0.14))
    base = [(0.36, 0.14), (0.40, 0.17), (0.41, 0.20), (0.40, 0.23), (0.35, 0.26), (0.33, 0.29), (0.34, 0.32),
            (0.36, 0.34), (0.34, 0.37), (0.30, 0.39)]
    m.lathe("marble", base, 40)
    flutes = lambda angle, z: 1 - 0.055 * abs(math.sin(10 * angle)) ** 0.8
    shaft = [(0.285, 0.39), (0.282, 1.2), (0.274, 2.0), (0.262, 2.8), (0.246, 3.5)]
    m.lathe("marble", shaft, 120, radius=flutes)
    capital = [(0.25, 3.5), (0.27, 3.52), (0.27, 3.56), (0.25, 3.58), (0.25, 3.64), (0.30, 3.72), (0.37, 3.78),
               (0.38, 3.82)]
    m.lathe("marble", capital, 40)
    m.box("marble", (-0.42, -0.42, 3.82), (0.42, 0.42, 4.0))
    m.write("column")


def statue():
    """A draped figure on a plinth, 2.5 m tall in all; faces -y."""
    m = Mesh()
    m.box("stone", (-0.42, -0.42, 0), (0.42, 0.42, 0.12))
    m.box("stone", (-0.34, -0.34, 0.12), (0.34, 0.34, 0.72))
    m.box("stone", (-0.40, -0.40, 0.72), (0.40, 0.40, 0.82))
    folds = lambda angle, z: 1 + (0.07 if z < 1.75 else 0.02) * math.sin(9 * angle + 3 * z) * min(1, (2.25 - z))
    body = [(0.30, 0.82), (0.29, 0.95), (0.25, 1.20), (0.21, 1.45), (0.19, 1.60), (0.155, 1.74), (0.175, 1.90),
            (0.20, 2.02), (0.185, 2.10), (0.12, 2.16), (0.062, 2.19), (0.058, 2.26)]
    m.lathe("bronze", body, 54, lambda p: (p[0] * 1.1, p[1] * 0.8, p[2]), folds)
    m.sphere("bronze", (0, -0.01, 2.36), (0.092, 0.11, 0.125), 22)
    m.sphere("bronze", (0, 0.08, 2.40), (0.085, 0.075, 0.085), 16)
    m.tube("bronze", [(-0.19, 0, 2.06), (-0.29, -0.02, 1.86), (-0.20, -0.17, 1.68), (-0.04, -0.22, 1.72)],
           [0.065, 0.055, 0.045, 0.035], 12)
    m.tube("bronze", [(0.19, 0, 2.06), (0.32, -0.06, 2.10), (0.38, -0.12, 2.36), (0.36, -0.16, 2.52)],
           [0.065, 0.055, 0.045, 0.032], 12)
    m.write("statue")


def house():
    """A house front, 8 m wide and 6.5 m tall, in the plane y = 0; the street is on its -y side."""
    m = Mesh()
    openings = []  # x0, x1, z0, z1, material
    for x in (-2.9, -0.5, 1.9):
        openings.append((x, x + 1.1, 4.0, 5.5, "glass"))
    openings += [(-2.9, -1.8, 1.0, 2.6, "glass"), (-0.45, 0.55, 0.15, 2.4, "wood"), (1.7, 3.2, 1.0, 2.6, "glass")]
    xs = sorted({-4.0, 4.0, *(o[0] for o in openings), *(o[1] for o in openings)})
    zs = sorted({0.0, 6.5, *(o[2] for o in openings), *(o[3] for o in openings)})
    for x0, x1 in zip(xs, xs[1:]):
        for z0, z1 in zip(zs, zs[1:]):
            if not any(o[0] <= x0 and x1 <= o[1] and o[2] <= z0 and z1 <= o[3] for o in openings):
                m.quad("plaster", ((x0, 0, z0), (x1, 0, z0), (x1, 0, z1), (x0, 0, z1)))
    for x0, x1, z0, z1, material in openings:
        back = 0.18
        m.quad(material, ((x0, back, z0), (x1, back, z0), (x1, back, z1), (x0, back, z1)))
        m.quad("plaster", ((x0, 0, z0), (x0, back, z0), (x0, back, z1), (x0, 0, z1)))
        m.quad("plaster", ((x1, 0, z0), (x1, 0, z1), (x1, back, z1), (x1, back, z0)))
        m.quad("plaster", ((x0, 0, z1), (x0, back, z1), (x1, back, z1), (x1, 0, z1)))
        m.quad("stone", ((x0, 0, z0), (x1, 0, z0), (x1, back, z0), (x0, back, z0)))
        if material == "glass":
            m.box("stone", (x0 - 0.1, -0.12, z0 - 0.1), (x1 + 0.1, 0.02, z0))
            middle = (x0 + x1) / 2
            m.box("wood", (middle - 0.03, back - 0.05, z0), (middle + 0.03, back, z1))
            m.box("wood", (x0, back - 0.05, (z0 + z1) / 2 - 0.03), (x1, back, (z0 + z1) / 2 + 0.03))
        else:
            m.box("stone", (x0 - 0.2, -0.45, 0), (x1 + 0.2, 0.0, 0.15))
            m.sphere("chrome", (x1 - 0.12, back - 0.04, 1.15), (0.035, 0.035, 0.035), 12)
        m.box("stone", (x0 - 0.12, -0.06, z1), (x1 + 0.12, 0.0, z1 + 0.18))
    m.box("stone", (-4.0, -0.10, 3.15), (4.0, 0.0, 3.35))
    m.box("stone", (-4.0, -0.06, 0.0), (-0.65, 0.0, 0.55))
    m.box("stone", (0.75, -0.06, 0.0), (4.0, 0.0, 0.55))
    m.box("stone", (-4.05, -0.30, 6.3), (4.05, 0.0, 6.5))
    m.tube("steel", [(3.8, -0.08, 0.1), (3.8, -0.08, 6.3)], 0.045, 10)
    m.write("house")


def sign():
    """A round road sign, 2.5 m tall, facing -y."""
    m = Mesh()
    m.tube("steel", [(0, 0, 0), (0, 0, 2.5)], 0.03, 12)
    lie = lambda p: (p[0], -0.035 - p[2], 2.2 + p[1])
    m.lathe("sign_white", [(0.30, 0.0), (0.30, 0.012), (0.30, 0.012), (0.27, 0.0121)][::1], 36, lie)
    m.lathe("sign_blue", [(0.27, 0.013), (0.0, 0.013)][::1], 36, lie)
    m.lathe("steel", [(0.0, 0.0), (0.30, 0.0)], 36, lie)
    m.quad("sign_white", ((-0.05, -0.052, 2.05), (0.05, -0.052, 2.05), (0.05, -0.052, 2.28), (-0.05, -0.052, 2.28)))
    m.quad("sign_white", ((-0.12, -0.052, 2.28), (0.12, -0.052, 2.28), (0.0, -0.052, 2.40), (0.0, -0.052, 2.40)))
    m.write("sign")


def small_things():
    """Tyres, drum, a ball of 1 m, a helmet on a stool."""
    tyres = Mesh()
    for k in range(3):
        ring = [(0.24 * math.cos(a) + 0.02 * (k % 2), 0.24 * math.sin(a), 0.075 + 0.14 * k)
                for a in (2 * math.pi * i / 36 for i in range(36))]
        tyres.tube("rubber", ring, 0.072, 12, closed=True)
    tyres.write("tyres")
    drum = Mesh()
    profile = [(0.28, 0.0), (0.28, 0.27), (0.295, 0.28), (0.295, 0.30), (0.28, 0.31), (0.28, 0.57), (0.295, 0.58),
               (0.295, 0.60), (0.28, 0.61), (0.28, 0.87), (0.295, 0.875), (0.295, 0.89), (0.275, 0.89)]
    drum.lathe("paint_green", profile, 40)
    drum.lathe("paint_green", [(0.275, 0.87), (0.0, 0.87)], 40)
    drum.write("drum")
    ball = Mesh()
    ball.sphere("marble", (0, 0, 0.5), (0.5, 0.5, 0.5), 40)
    ball.write("ball")
    stool = Mesh()
    stool.tube("wood", [(0, 0, 0.46), (0, 0, 0.50)], 0.18, 28)
    for k in range(4):
        a = math.radians(45 + 90 * k)
        stool.tube("wood", [(0.13 * math.cos(a), 0.13 * math.sin(a), 0.46), (0.19 * math.cos(a), 0.19 * math.sin(a), 0)],
                   0.018, 8)
    stool.sphere("paint_red", (0, 0, 0.63), (0.125, 0.15, 0.13), 28)
    stool.sphere("glass", (0, -0.035, 0.635), (0.115, 0.127, 0.055), 24)
    stool.write("stool")


def car():
    """data/scenes/car.obj with the gloss of its paint, glass and rims."""
    m = Mesh()
    names = {"paint": "paint_red", "trim": "rubber", "tyre": "rubber", "rim": "chrome"}
    vertices, normals, material = [], [], None
    for line in (HERE / "car.obj").read_text().splitlines():
        words = line.split()
        if not words or words[0] == "#":
            continue
        if words[0] in ("v", "vn"):
            (vertices if words[0] == "v" else normals).append(tuple(float(w) for w in words[1:4]))
        elif words[0] == "usemtl":
            material = names.get(words[1], words[1])
            seen = {}
        elif words[0] == "f":
            part = m.parts.setdefault(material, ([], [], []))
            corners = []
            for word in words[1:]:
                if word not in seen:
                    vertex, normal = (int(w) - 1 for w in word.split("//"))
                    seen[word] = len(part[0])
                    part[0].append(vertices[vertex])
                    part[1].append(normals[normal])
                corners.append(seen[word])
            part[2].extend((corners[0], corners[k], corners[k + 1]) for k in range(1, len(corners) - 1))
    m.write("car")


def serpent():
    """A coiled serpent with a crest, 1.3 m wide and 0.9 m tall: surfaces of all directions, folds that hide each other."""
    m = Mesh()
    path, radius = [], []
    for k in range(73):
        t = k / 72
        turn, lift = 4.2 * math.pi * t, 0.11 + 0.62 * t ** 1.5
        reach = 0.52 - 0.34 * t
        path.append((reach * math.cos(turn), reach * math.sin(turn), lift + 0.03 * math.sin(9 * turn)))
        radius.append(0.015 + 0.095 * math.sin(math.pi * min(1, 0.06 + t * 1.02)) ** 0.5)
    m.tube("bronze", path, radius, 12)
    for k in range(4, 68, 3):  # crest
        x, y, z = path[k]
        r = radius[k]
        m.tube("bronze", [(x, y, z + 0.8 * r), (x, y, z + r + 0.05)], [0.025, 0.004], 5)
    x, y, z = path[-1]
    m.sphere("bronze", (x, y, z + 0.03), (0.09, 0.12, 0.08), 18)
    m.write("serpent")


if __name__ == "__main__":
    serpent()
    motorbike()
    column()
    statue()
    house()
    sign()
    small_things()
    car()
