"""What the judges of our bridges share: receivers, and how far a program's illuminances are from exact ones.

A file of receivers is JSON, metres in the luminaire's frame:

    {"position_m": [[x, y, z], ...], "normal": [[x, y, z], ...], "exact": [lx, ...]}

A judge writes {"program": ..., "illuminance": [...], "sigma": [...]}, sigma the standard error of its sampling.
"""

import json
import pathlib

BRIDGES = pathlib.Path(__file__).resolve().parents[1]  # holds the add-ons; installed, beside the judges' folder
LUMINANCE = (0.2126, 0.7152, 0.0722)  # of linear Rec. 709


def read(path):
    facts = json.loads(pathlib.Path(path).read_text())
    return facts["position_m"], facts["normal"]


def write(path, program, illuminance, sigma):
    pathlib.Path(path).write_text(json.dumps({"program": program, "illuminance": [float(e) for e in illuminance],
                                              "sigma": [float(s) for s in sigma]}))


def half_side(position):
    """Of the square that stands for a receiver: small beside what illuminance changes over, and large beside float32's
    steps, which would turn its normal."""
    return 2e-4 * sum(x * x for x in position) ** 0.5


def frame(normal):
    """Two unit vectors across a unit normal, right-handed with it."""
    other = (1.0, 0.0, 0.0) if abs(normal[0]) < 0.7 else (0.0, 1.0, 0.0)
    a = cross(other, normal)
    length = sum(x * x for x in a) ** 0.5
    a = tuple(x / length for x in a)
    return a, cross(normal, a)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
