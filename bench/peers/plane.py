#!/usr/bin/env python3
"""Two scenes whose mean radiance is known: a lit plane, seen from straight above.

    bench/peers/plane.py -o FOLDER

writes FOLDER/plane_sky.toml (a sky of radiance 1 + b . w in the direction w), FOLDER/plane_light.toml
(a tilted rectangle), the sky's picture, and FOLDER/closed_form.json with the mean radiance of each.

Closed forms: under that sky E(n) = pi (1 + 2/3 b . n) on an open plane; of a rectangle Lambert's
formula (1760), E = L/2 sum_k theta_k n . g_k over its edges, its mean over the picture by the
midpoint rule.
"""

import argparse
import json
import math
import pathlib
import struct

ALBEDO = 0.5
SKY_GRADIENT = (0.35, -0.2, 0.45)
WIDTH, HEIGHT = 64, 48  # of the picture
FOV_DEG, EYE_M = 40, 2.0
LIGHT = {"position": (0.5, 0.3, 1.2), "look_at": (0.1, 0.0, 0.0), "size": (0.6, 0.4), "radiance": 3.0}
UP = (0.0, 1.0, 0.0)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def normalized(a):
    length = math.sqrt(dot(a, a))
    return tuple(x / length for x in a)


def light_corners():
    """As docs/formats/scene.md frames a light: +z to look_at, +x = up x z; counter-clockwise about z."""
    z = normalized(tuple(q - p for p, q in zip(LIGHT["position"], LIGHT["look_at"])))
    x = normalized(cross((0, 0, 1), z))
    y = cross(z, x)
    w, h = (s / 2 for s in LIGHT["size"])
    return [tuple(p + a * w * i + b * h * j for p, i, j in zip(LIGHT["position"], x, y))
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]


def rectangle_irradiance(point, corners):
    """On a plane that faces +z, all corners above it and the point on the lit side."""
    to = [normalized(tuple(c - p for c, p in zip(corner, point))) for corner in corners]
    total = 0.0
    for a, b in zip(to, to[1:] + to[:1]):
        normal = cross(a, b)
        size = math.sqrt(dot(normal, normal))
        total += math.atan2(size, dot(a, b)) * normal[2] / size
    return LIGHT["radiance"] / 2 * abs(total)


def mean_over_picture(irradiance, parts):
    """Points of the plane z = 0, parts^2 to a pixel."""
    half = EYE_M * math.tan(math.radians(FOV_DEG) / 2)
    columns, rows = WIDTH * parts, HEIGHT * parts
    total = 0.0
    for row in range(rows):
        for column in range(columns):
            x = half * WIDTH / HEIGHT * (2 * (column + 0.5) / columns - 1)
            y = half * (1 - 2 * (row + 0.5) / rows)
            total += irradiance((x, y, 0.0))
    return total / (rows * columns)


def write_exr(path, width, height, rows):
    """One FLOAT channel Y, no compression; rows(row) gives its pixels (openexr.com, "file layout")."""

    def attribute(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value

    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    # name, pixel type 2 = FLOAT, pLinear and padding, sampling 1 x 1
    channels = b"".join(name + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    header = struct.pack("<ii", 20000630, 2)
    header += attribute("channels", "chlist", channels)
    header += attribute("compression", "compression", b"\0")
    header += attribute("dataWindow", "box2i", window)
    header += attribute("displayWindow", "box2i", window)
    header += attribute("lineOrder", "lineOrder", b"\0")
    header += attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    header += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    header += attribute("screenWindowWidth", "float", struct.pack("<f", 1))
    header += b"\0"
    size = 3 * 4 * width
    first = len(header) + 8 * height
    with open(path, "wb") as file:
        file.write(header)
        file.write(struct.pack(f"<{height}Q", *(first + row * (8 + size) for row in range(height))))
        for row in range(height):
            pixels = struct.pack(f"<{width}f", *rows(row))
            file.write(struct.pack("<ii", row, size) + 3 * pixels)


def write_sky(path, width):
    """The mean of 1 + b . w over each pixel, in closed form: docs/formats/environment.md, latitude-longitude."""
    height = width // 2
    bx, by, bz = SKY_GRADIENT

    def rows(row):
        t0, t1 = math.pi * row / height, math.pi * (row + 1) / height
        area = math.cos(t0) - math.cos(t1)
        sine = ((t1 - t0) / 2 - (math.sin(2 * t1) - math.sin(2 * t0)) / 4) / area  # mean of sin theta
        cosine = (math.sin(t1) ** 2 - math.sin(t0) ** 2) / 2 / area
        for column in range(width):
            p0, p1 = (math.pi * (1 - 2 * c / width) for c in (column, column + 1))
            sin_phi, cos_phi = (math.cos(p1) - math.cos(p0)) / (p0 - p1), (math.sin(p0) - math.sin(p1)) / (p0 - p1)
            yield 1 + sine * (bx * sin_phi - by * cos_phi) + bz * cosine

    write_exr(path, width, height, rows)


SCENE = f"""[camera]
position = [0, 0, {EYE_M}]
look_at = [0, 0, 0]
up = [{UP[0]}, {UP[1]}, {UP[2]}]
vertical_fov_deg = {FOV_DEG}
width = {WIDTH}
height = {HEIGHT}

[[material]]
name = "grey"
albedo = [{ALBEDO}, {ALBEDO}, {ALBEDO}]

[[quad]]
corner = [-4, -4, 0]
edge_u = [8, 0, 0]
edge_v = [0, 8, 0]
material = "grey"
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="folder")
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    write_sky(folder / "plane_sky.exr", 256)
    (folder / "plane_sky.toml").write_text(SCENE + '\n[environment]\nfile = "plane_sky.exr"\n')
    triple = [LIGHT["radiance"]] * 3
    (folder / "plane_light.toml").write_text(
        SCENE + "\n[[light]]\n" + 'kind = "rectangle"\n' + f"radiance = {triple}\n"
        + "".join(f"{key} = {list(LIGHT[key])}\n" for key in ("position", "look_at", "size")))
    corners = light_corners()
    sky = ALBEDO * (1 + 2 / 3 * SKY_GRADIENT[2])
    light = ALBEDO / math.pi * mean_over_picture(lambda p: rectangle_irradiance(p, corners), 4)
    coarse = ALBEDO / math.pi * mean_over_picture(lambda p: rectangle_irradiance(p, corners), 1)
    values = {"plane_sky": sky, "plane_light": light, "plane_light_at_pixel_centres": coarse}
    (folder / "closed_form.json").write_text(json.dumps(values, indent=2) + "\n")
    for name, value in values.items():
        print(f"{name}: mean radiance {value:.9g}")


if __name__ == "__main__":
    main()
