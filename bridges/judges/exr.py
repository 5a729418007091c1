"""OpenEXR 2.0 files with numpy: scan lines, one part or several, uncompressed, ZIPS or ZIP.

The layout is that of "OpenEXR File Layout" and "Technical Introduction to OpenEXR" (openexr.com).
Written for the
judges, so that nothing of the program under judgement reads or writes the files that it is judged
by.

    parts = read("lamp.lf.exr")                 # [Part], in file order
    write("x.exr", [Part("C.00.00", {"Y": array}, {"luxfield:delta_m": 0.3})])
"""

import struct
import zlib
from dataclasses import dataclass, field

import numpy as np

MAGIC = 20000630
PIXEL_TYPES = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}
LINES_PER_CHUNK = {0: 1, 2: 1, 3: 16}  # none, ZIPS, ZIP


@dataclass
class Part:
    """One image of a file. channels: name -> (height, width) array of float32, float16 or
    uint32."""

    name: str
    channels: dict
    attributes: dict = field(default_factory=dict)


def _text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _attribute(kind, value):
    if kind == "string":
        return value.decode()
    if kind == "int":
        return struct.unpack("<i", value)[0]
    if kind == "float":
        return struct.unpack("<f", value)[0]
    if kind == "double":
        return struct.unpack("<d", value)[0]
    if kind == "box2i":
        return struct.unpack("<4i", value)
    return value


def _channel_list(value):
    channels, at = [], 0
    while value[at] != 0:
        name, at = _text(value, at)
        kind = struct.unpack_from("<i", value, at)[0]
        channels.append((name, PIXEL_TYPES[kind]))
        at += 16
    return channels


def _header(data, at):
    attributes = {}
    while data[at] != 0:
        name, at = _text(data, at)
        kind, at = _text(data, at)
        size = struct.unpack_from("<i", data, at)[0]
        value = data[at + 4 : at + 4 + size]
        at += 4 + size
        attributes[name] = (
            _channel_list(value)
            if kind == "chlist"
            else value[0] if kind == "compression" else _attribute(kind, value)
        )
    return attributes, at + 1


def _unpack(block, size):
    """Undoes ZIP: deflate, then differences of neighbouring bytes, then two interleaved halves."""
    raw = np.frombuffer(zlib.decompress(block), np.uint8)
    steps = raw.astype(np.int64)
    steps[1:] -= 128
    planes = (np.cumsum(steps) & 255).astype(np.uint8)
    half = (size + 1) // 2
    out = np.empty(size, np.uint8)
    out[0::2], out[1::2] = planes[:half], planes[half:]
    return out.tobytes()


def read(path):
    """All parts of a scan-line file."""
    with open(path, "rb") as file:
        data = file.read()
    magic, version = struct.unpack_from("<II", data)
    assert magic == MAGIC, f"{path} is no OpenEXR file"
    several = bool(version & 0x1000)
    headers, at = [], 8
    while True:
        attributes, at = _header(data, at)
        headers.append(attributes)
        if not several:
            break
        if data[at] == 0:
            at += 1
            break
    parts, chunks = [], []
    for header in headers:
        x0, y0, x1, y1 = header["dataWindow"]
        width, height = x1 - x0 + 1, y1 - y0 + 1
        lines = LINES_PER_CHUNK[header["compression"]]
        chunks.append((width, height, lines, -(-height // lines)))
        channels = {name: np.empty((height, width), kind) for name, kind in header["channels"]}
        own = {k: v for k, v in header.items() if k not in ("channels", "compression")}
        parts.append(Part(header.get("name", ""), channels, own))
    for part, (width, height, lines, count) in zip(parts, chunks):
        offsets = np.frombuffer(data, "<u8", count, at)
        at += 8 * count
        row_bytes = sum(width * plane.dtype.itemsize for plane in part.channels.values())
        for offset in offsets:
            offset = int(offset) + (4 if several else 0)
            y, size = struct.unpack_from("<ii", data, offset)
            y -= part.attributes["dataWindow"][1]
            rows = min(lines, height - y)
            block = data[offset + 8 : offset + 8 + size]
            if size < rows * row_bytes:
                block = _unpack(block, rows * row_bytes)
            start = 0
            for row in range(y, y + rows):
                for plane in part.channels.values():
                    plane[row] = np.frombuffer(block, plane.dtype, width, start)
                    start += width * plane.dtype.itemsize
    return parts


def _attribute_bytes(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def _own_attribute(name, value):
    if isinstance(value, str):
        return _attribute_bytes(name, "string", value.encode())
    if isinstance(value, int):
        return _attribute_bytes(name, "int", struct.pack("<i", value))
    return _attribute_bytes(name, "double", struct.pack("<d", value))


def write(path, parts):
    """Writes parts uncompressed. Channels are stored as float32 or uint32, in the order of their
    names."""
    several = len(parts) > 1
    header = bytearray(struct.pack("<II", MAGIC, 2 | (0x1000 if several else 0)))
    for part in parts:
        height, width = next(iter(part.channels.values())).shape
        window = struct.pack("<4i", 0, 0, width - 1, height - 1)
        listed = (
            b"".join(
                name.encode()
                + b"\0"
                + struct.pack("<iiii", 0 if plane.dtype.kind == "u" else 2, 0, 1, 1)
                for name, plane in sorted(part.channels.items())
            )
            + b"\0"
        )
        header += _attribute_bytes("channels", "chlist", listed)
        header += _attribute_bytes("compression", "compression", b"\0")
        header += _attribute_bytes("dataWindow", "box2i", window) + _attribute_bytes(
            "displayWindow", "box2i", window
        )
        header += _attribute_bytes("lineOrder", "lineOrder", b"\0")
        header += _attribute_bytes("pixelAspectRatio", "float", struct.pack("<f", 1))
        header += _attribute_bytes("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0))
        header += _attribute_bytes("screenWindowWidth", "float", struct.pack("<f", 1))
        if several:
            header += _attribute_bytes("chunkCount", "int", struct.pack("<i", height))
            header += _attribute_bytes("type", "string", b"scanlineimage")
            header += _attribute_bytes("name", "string", part.name.encode())
        for name, value in part.attributes.items():
            header += _own_attribute(name, value)
        header += b"\0"
    if several:
        header += b"\0"
    tables, body = bytearray(), bytearray()
    rows_in_all = sum(next(iter(p.channels.values())).shape[0] for p in parts)
    start = len(header) + 8 * rows_in_all
    for number, part in enumerate(parts):
        planes = [
            np.ascontiguousarray(plane, "<u4" if plane.dtype.kind == "u" else "<f4")
            for _, plane in sorted(part.channels.items())
        ]
        for y in range(planes[0].shape[0]):
            row = b"".join(plane[y].tobytes() for plane in planes)
            tables += struct.pack("<Q", start + len(body))
            body += (
                (struct.pack("<i", number) if several else b"")
                + struct.pack("<ii", y, len(row))
                + row
            )
    with open(path, "wb") as out:
        out.write(header + tables + body)
