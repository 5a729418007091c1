"""Lamps of glTF's extension LUXFIELD_light_field, of binary files: written from docs/formats/gltf-light-field.md and
docs/web.md, of numpy and Python's own libraries.

    import luxfield_gltf
    lamp = luxfield_gltf.Light("lamp.glb")
    lamp.illuminance((0.1, 0, 2), (0, 0, -1))      # lx, at a place of the luminaire's frame
"""

import json
import pathlib
import struct
import zlib

import numpy as np

NAME = "LUXFIELD_light_field"
LUMINANCE = np.array((0.2126, 0.7152, 0.0722))  # of linear Rec. 709


def chunks(path):
    """The JSON and the bytes of a binary glTF file."""
    data = pathlib.Path(path).read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert magic == b"glTF" and version == 2 and length == len(data)
    json_length, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    return json.loads(data[20:20 + json_length]), data[20 + json_length + 8:]


def coefficients(table, packed, channels):
    """[channel][component][w][y][x]"""
    x, y, w = (n + 2 for n in table["nodes"])
    size = 2 * 3 * channels * x * y * w
    assert size <= 2 << 23, "a table of more codes than docs/web.md allows"
    data = zlib.decompressobj().decompress(packed, size + 1)
    assert len(data) == size, "the codes are no stream of the size that 'nodes' states"
    low, high = np.frombuffer(data, np.uint8).reshape(2, -1).astype(np.int64)
    numbers = low + 256 * high
    differences = np.where(numbers % 2 == 0, numbers // 2, -(numbers + 1) // 2).reshape(channels, 3, w, y, x)
    codes = differences.cumsum(axis=-1).cumsum(axis=-2)  # what left + below - both adds up to
    knees, steps = (np.array(table[key]).reshape(channels, 3, 1, 1, 1) for key in ("knees", "steps"))
    return knees * np.sinh(steps * codes)


def spline_weights(x, nodes):
    i = int(min(max(np.floor(x), 0), nodes - 2))
    f = x - i
    return i, np.array([(1 - f)**3 / 6, 2 / 3 - f**2 * (1 - f / 2), 2 / 3 - (1 - f)**2 * (1 + f) / 2, f**3 / 6])


class Light:
    def __init__(self, path):
        self.json, binary = chunks(path)
        self.extension = self.json["extensions"][NAME]
        self.light = self.extension["lights"][0]
        views = self.json["bufferViews"]

        def bytes_of(number):
            at = views[number].get("byteOffset", 0)
            return binary[at:at + views[number]["byteLength"]]

        self.tables = [(table, coefficients(table, bytes_of(table["bufferView"]), self.light["channels"]))
                       for table in self.light["tables"]]

    def illuminance(self, p, n):
        """In lx, at a place of the luminaire's frame on a surface with unit normal n."""
        middle_x, middle_y, half_x, half_y = self.light["on_f"]
        before = [np.dot(n, (middle_x + x * half_x - p[0], middle_y + y * half_y - p[1], -p[2])) >= 0
                  for x in (-1, 1) for y in (-1, 1)]
        if not any(before):
            return 0.0
        weights = LUMINANCE if self.light["channels"] == 3 else np.ones(1)
        e = float(weights @ self.light_vector(p) @ np.array(n))
        return e if all(before) else max(0.0, e)

    def light_vector(self, p):
        """J of each channel: rows of three numbers."""
        delta, nothing = self.light["delta_m"], np.zeros((self.light["channels"], 3))
        if p[2] <= 0:
            return nothing
        side, w = ("front", delta / p[2]) if p[2] >= delta else ("between", p[2] / delta)
        found = [(t, c) for t, c in self.tables if t["side"] == side and t["first"] <= w <= t["last"]]
        if not found:
            return nothing
        table, values = found[0]
        on_f, on_i = np.array(self.light["on_f"]), np.array(self.light["on_i"])
        place = np.array(p[:2])
        if side == "front":
            q = (w * place - on_i[:2] + (1 - w) * on_f[:2]) / (on_i[2:] + (1 - w) * on_f[2:])
        else:
            q = (place - w * on_i[:2] - (1 - w) * on_f[:2]) / (w * on_i[2:] + (1 - w) * on_f[2:])
        if np.any(np.abs(q) > 1):
            return nothing
        nodes = table["nodes"]
        ix, weights_x = spline_weights((q[0] + 1) / 2 * (nodes[0] - 1), nodes[0])
        iy, weights_y = spline_weights((q[1] + 1) / 2 * (nodes[1] - 1), nodes[1])
        iw, weights_w = spline_weights((w - table["first"]) / (table["last"] - table["first"]) * (nodes[2] - 1), nodes[2])
        part = values[:, :, iw:iw + 4, iy:iy + 4, ix:ix + 4]
        k = np.einsum("abwyx,w,y,x->ab", part, weights_w, weights_y, weights_x)
        return k * (w**2 if side == "front" else 1)
