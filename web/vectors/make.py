"""Makes the vectors that readers of LUXFIELD_light_field are tried with, of the formulas of docs/web.md and
docs/formats/gltf-light-field.md in plain Python:

    python make.py            writes lamp.glb, a lamp of random tables, and vectors.json

vectors.json has some codes of each table, [channel][component][w][y][x] flattened, and receivers in the luminaire's
frame: position p, unit normal n, the light vector of each channel in turn, and illuminance in lx.
"""

import json
import math
import pathlib
import random
import struct
import zlib

FOLDER = pathlib.Path(__file__).parent
CHANNELS, DELTA = 3, 0.25
ON_F, ON_I = (0.011, -0.007, 0.05, 0.04), (0.03, 0.02, 0.12, 0.1)
LUMINANCE = (0.2126, 0.7152, 0.0722)
TABLES = [("between", 0.1, 0.8, (6, 5, 4)), ("between", 0.8, 1, (5, 6, 5)), ("front", 0.5, 1, (7, 5, 4)),
          ("front", 0, 0.5, (5, 5, 6))]


class Table:
    def __init__(self, stated, rng):
        self.side, self.first, self.last, self.nodes = stated
        self.size = [n + 2 for n in self.nodes]
        self.knees = [rng.uniform(5, 20) for _ in range(3 * CHANNELS)]
        self.steps = [rng.uniform(0.0004, 0.0012) for _ in range(3 * CHANNELS)]
        x, y, w = self.size
        slices = 3 * CHANNELS * w
        # Codes of all sizes, the ends among them.
        self.codes = [rng.choice((rng.randint(-9, 9), rng.randint(-300, 300), rng.randint(-2047, 2047), -2047, 2047))
                      for _ in range(slices * y * x)]

    def packed(self):
        x, y, _ = self.size
        numbers = []
        for k, code in enumerate(self.codes):
            has_left, has_below = k % x > 0, k // x % y > 0
            left = self.codes[k - 1] if has_left else 0
            below = self.codes[k - x] if has_below else 0
            both = self.codes[k - x - 1] if has_left and has_below else 0
            d = code - left - below + both
            numbers.append(2 * d if d >= 0 else -2 * d - 1)
        return zlib.compress(bytes(n % 256 for n in numbers) + bytes(n // 256 for n in numbers), 9)

    def coefficient(self, component, w, y, x):
        code = self.codes[((component * self.size[2] + w) * self.size[1] + y) * self.size[0] + x]
        return self.knees[component] * math.sinh(self.steps[component] * code)

    def json(self, view):
        return {"side": self.side, "first": self.first, "last": self.last, "nodes": self.nodes, "knees": self.knees,
                "steps": self.steps, "bufferView": view}


def stencil(x, nodes):
    i = min(max(math.floor(x), 0), nodes - 2)
    f = x - i
    return i, ((1 - f)**3 / 6, 2 / 3 - f**2 * (1 - f / 2), 2 / 3 - (1 - f)**2 * (1 + f) / 2, f**3 / 6)


def light_vector(tables, p):
    """Three numbers for each channel."""
    dark, z = [0.0] * 3 * CHANNELS, p[2]
    if z <= 0:
        return dark
    side, w = ("front", DELTA / z) if z >= DELTA else ("between", z / DELTA)
    table = next((t for t in tables if t.side == side and t.first <= w <= t.last), None)
    if table is None:
        return dark
    q = []
    for a in range(2):
        m_f, h_f, m_i, h_i = ON_F[a], ON_F[2 + a], ON_I[a], ON_I[2 + a]
        q.append((w * p[a] - m_i + (1 - w) * m_f) / (h_i + (1 - w) * h_f) if side == "front" else
                 (p[a] - w * m_i - (1 - w) * m_f) / (w * h_i + (1 - w) * h_f))
    if max(abs(q[0]), abs(q[1])) > 1:
        return dark
    at = [(q[0] + 1) / 2 * (table.nodes[0] - 1), (q[1] + 1) / 2 * (table.nodes[1] - 1),
          (w - table.first) / (table.last - table.first) * (table.nodes[2] - 1)]
    (ix, wx), (iy, wy), (iw, ww) = (stencil(x, n) for x, n in zip(at, table.nodes))
    scale = w * w if side == "front" else 1
    return [scale * sum(ww[c] * wy[b] * wx[a] * table.coefficient(component, iw + c, iy + b, ix + a)
                        for a in range(4) for b in range(4) for c in range(4)) for component in range(3 * CHANNELS)]


def illuminance(j, p, n):
    corners = [n[0] * (ON_F[0] + x * ON_F[2] - p[0]) + n[1] * (ON_F[1] + y * ON_F[3] - p[1]) - n[2] * p[2]
               for x in (-1, 1) for y in (-1, 1)]
    if max(corners) < 0:
        return 0.0
    e = sum(LUMINANCE[c] * sum(n[k] * j[3 * c + k] for k in range(3)) for c in range(CHANNELS))
    return e if min(corners) >= 0 else max(0.0, e)


def receivers(rng):
    """Heights over all tables, at their ends, before them and behind the lamp; half of the places off the axis."""
    heights = [DELTA, 0.8 * DELTA, 2 * DELTA, 0.1 * DELTA, 0.05 * DELTA, -0.1, 1000.0]
    heights += [0.12 * DELTA * 500**rng.random() for _ in range(53)]
    for z in heights:
        share = z / DELTA
        spread = [(ON_I[2 + a] * share + ON_F[2 + a] * abs(1 - share)) * rng.uniform(-1.1, 1.1) for a in range(2)]
        p = [ON_F[a] + share * (ON_I[a] - ON_F[a]) + spread[a] for a in range(2)] + [z]
        tilt, around = rng.uniform(0, 2.2), rng.uniform(0, 2 * math.pi)
        yield p, [math.sin(tilt) * math.cos(around), math.sin(tilt) * math.sin(around), -math.cos(tilt)]


def glb(tables):
    buffer, views = b"", []
    for table in tables:
        packed = table.packed()
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(packed)})
        buffer += packed + bytes(-len(packed) % 4)
    light = {"format": "luxfield lamp volume", "version": 1, "delta_m": DELTA, "channels": CHANNELS, "unit": "lx",
             "on_f": ON_F, "on_i": ON_I, "floor_share": 0.1, "stated_error": 0,
             "zones": [{"z_first_m": 0.02, "z_last_m": 20, "about_image_plane": False, "stated_error": 0, "rel_rmse": 0,
                        "receivers": 0}],
             "tables": [table.json(k) for k, table in enumerate(tables)]}
    name = "LUXFIELD_light_field"
    text = json.dumps({"asset": {"version": "2.0", "generator": "luxfield web/vectors/make.py"}, "extensionsUsed": [name],
                       "extensions": {name: {"lights": [light]}}, "buffers": [{"byteLength": len(buffer)}],
                       "bufferViews": views, "nodes": [{"name": "lamp", "extensions": {name: {"light": 0}}}],
                       "scenes": [{"nodes": [0]}], "scene": 0}).encode()
    text += b" " * (-len(text) % 4)
    whole = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(whole)) + whole


def main():
    rng = random.Random(33)
    tables = [Table(stated, rng) for stated in TABLES]
    (FOLDER / "lamp.glb").write_bytes(glb(tables))
    answers = []
    for p, n in receivers(rng):
        j = light_vector(tables, p)
        answers.append({"p": p, "n": n, "light_vector": j, "illuminance": illuminance(j, p, n)})
    codes = [{"count": len(table.codes), "first": table.codes[:20], "last": table.codes[-20:]} for table in tables]
    lines = ",\n".join(json.dumps(answer) for answer in answers)
    (FOLDER / "vectors.json").write_text(f'{{"codes": {json.dumps(codes)},\n"receivers": [\n{lines}\n]}}\n')


main()
