"""Square pictures of equal solid angle a pixel, as pbrt-v4 takes light by direction, and its picture files.

A point (u, v) of the square, 0 to 1, is a direction (Clarberg 2008): with a = 2 u - 1, b = 2 v - 1,

    r = |a| + |b|, mirrored at 1: r = 1 - |1 - |a| - |b||,   phi = pi / 4 ((|b| - |a|) / r + 1)
    z = +-(1 - r^2), positive where |a| + |b| < 1
    (x, y) = r sqrt(2 - r^2) (cos phi, sin phi), with the signs of a and b.
"""

import pathlib

import numpy as np


def directions(u, v):
    """Unit vectors, [..., 3]."""
    a, b = 2 * u - 1, 2 * v - 1
    inside = 1 - (np.abs(a) + np.abs(b))
    r = 1 - np.abs(inside)
    phi = np.pi / 4 * (np.divide(np.abs(b) - np.abs(a), r, out=np.zeros_like(r), where=r > 0) + 1)
    across = r * np.sqrt(np.maximum(0, 2 - r * r))
    return np.stack([np.copysign(across * np.cos(phi), a), np.copysign(across * np.sin(phi), b),
                     np.copysign(1 - r * r, inside)], axis=-1)


def pixels(d, size):
    """(row, column) of the pixel of the square that each unit vector lies in: the inverse of `directions`."""
    r = np.sqrt(np.maximum(0, 1 - np.abs(d[..., 2])))
    b = r * 2 / np.pi * np.arctan2(np.abs(d[..., 1]), np.abs(d[..., 0]))
    below = d[..., 2] < 0
    a, b = np.where(below, 1 - b, r - b), np.where(below, 1 - (r - b), b)
    return tuple(np.clip(((np.copysign(t, axis) + 1) / 2 * size).astype(np.int64), 0, size - 1)
                 for t, axis in ((b, d[..., 1]), (a, d[..., 0])))


def _points(size, rows, samples):
    """Middles of samples x samples parts of the pixels of some rows: [row, part, column, part]."""
    steps = (np.arange(samples) + 0.5) / samples
    v = (np.arange(*rows)[:, None] + steps)[:, :, None, None] / size
    u = (np.arange(size)[:, None] + steps)[None, None] / size
    return np.broadcast_arrays(u, v)


def _source_pixels(d, height):
    """Of a latitude-longitude picture, 2 height pixels wide, whose column u is the azimuth 2 pi u."""
    width = 2 * height
    row = np.minimum(height - 1, (np.arccos(np.clip(d[..., 2], -1, 1)) * height / np.pi).astype(np.int64))
    column = np.floor(np.arctan2(d[..., 1], d[..., 0]) % (2 * np.pi) * width / (2 * np.pi)).astype(np.int64)
    return row * width + np.minimum(column, width - 1)


def of_latlong(picture, size, samples=3):
    """An environment of constant pixels in equal areas. Each pixel's light goes where it came from, all of it:

        square pixel  L = sum over its points of L_p Omega_p / (points that fell into p), over its own solid angle.

    The light of a pixel that no point fell into, beside a pole, goes where its middle lies.
    """
    height = picture.shape[0]
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    solid = np.repeat((edges[:-1] - edges[1:]) * np.pi / height, 2 * height)
    chunk = max(1, (1 << 21) // (size * samples * samples))
    pieces = [(first, min(size, first + chunk)) for first in range(0, size, chunk)]
    points = np.zeros(solid.size, np.int64)
    for rows in pieces:
        source = _source_pixels(directions(*_points(size, rows, samples)), height)
        points += np.bincount(source.ravel(), minlength=solid.size)
    weight = np.divide(solid, points, out=np.zeros_like(solid), where=points > 0) * size * size / (4 * np.pi)
    light = picture.reshape(-1, 3) * weight[:, None]
    square = np.empty((size, size, 3), np.float32)
    for first, last in pieces:
        source = _source_pixels(directions(*_points(size, (first, last), samples)), height)
        square[first:last] = light[source].sum(axis=(1, 3))
    missed = np.flatnonzero(points == 0)
    polar, azimuth = (missed // (2 * height) + 0.5) * np.pi / height, (missed % (2 * height) + 0.5) * np.pi / height
    middles = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    np.add.at(square, pixels(middles, size),
              picture.reshape(-1, 3)[missed] * (solid[missed] * size * size / (4 * np.pi))[:, None])
    return square


def of_intensity(intensity, size):
    """[size, size] of intensity(polar, azimuth), in degrees, at the pixels' middles. pbrt exchanges the y and z
    axes of goniometric lights; angles are about the z axis of the lamp, which is the picture's y axis."""
    d = directions(*(p.reshape(size, size) for p in _points(size, (0, size), 1)))[..., [0, 2, 1]]
    polar = np.degrees(np.arccos(np.clip(d[..., 2], -1, 1))).ravel()
    azimuth = np.degrees(np.arctan2(d[..., 1], d[..., 0])).ravel()
    return np.array([intensity(p, a) for p, a in zip(polar, azimuth)], np.float32).reshape(size, size)


def read_pfm(path):
    """[row, column, channel] from the top."""
    kind, size, scale, data = pathlib.Path(path).read_bytes().split(b"\n", 3)
    width, height = (int(word) for word in size.split())
    channels = {b"PF": 3, b"Pf": 1}[kind]
    values = np.frombuffer(data, "<f4" if float(scale) < 0 else ">f4", width * height * channels)
    return values.reshape(height, width, channels)[::-1].astype(np.float32)


def write_pfm(path, picture):
    """[row, column] or [row, column, 3], from the top."""
    kind = "PF" if picture.ndim == 3 else "Pf"
    head = f"{kind}\n{picture.shape[1]} {picture.shape[0]}\n-1.0\n"
    pathlib.Path(path).write_bytes(head.encode() + np.ascontiguousarray(picture[::-1], "<f4").tobytes())
