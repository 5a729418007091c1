"""What `luxfield photometry` says of a headlamp, recomputed from docs/formats/regulation.md: by the
illuminance of every receiver, its own aim and its own search."""

import unittest

import numpy as np

from model import Geometry, LightField, gauss
from program import Judgement

DISTANCE, SIDE, SMALL_SIDE = 25.0, 0.065, 0.03

REGULATION = """
name = "of the judge"
source = "made up"
[receiver]
distance_m = 25
side_m = 0.065
[aim]
by = "cut-off"
[aim.level]
from_deg = [-2.5, -2]
to_deg = [-2.5, 1]
v_deg = -0.57
[cut_off]
receiver_side_m = 0.03
min_gradient = 0.01
[[point]]
name = "75R"
at_deg = [1.15, -0.57]
min_cd = 100
max_share = 1.5
max_share_of = "both"
[[line]]
name = "line"
from_deg = [-4, -0.86]
to_deg = [4, -0.3]
min_cd = 100
max_cd = 1e6
[[zone]]
name = "zone"
corners_deg = [-3, 1, 3, 1, 3, -1, 0, -2]
max_cd = 1
[[sum]]
name = "both"
at_deg = [-4, -1, 4, -1]
min_cd = 1
[[peak]]
name = "Imax"
max_cd = 1e7
[[flux]]
name = "flux"
from_deg = [-6, -4]
to_deg = [6, 3]
min_lm = 1
"""


def frame_vectors(h, v):
    """Forward, right and up of the lamp whose H = V = 0 lies at (h, v), degrees; the driver's right is -u."""
    h, v = np.radians(h), np.radians(v)
    forward, right, up = np.array([0, 0, 1.0]), np.array([-1.0, 0, 0]), np.array([0, 1.0, 0])
    ahead = np.cos(v) * (np.cos(h) * forward + np.sin(h) * right) + np.sin(v) * up
    side = np.cos(h) * right - np.sin(h) * forward
    return ahead, side, np.cross(side, ahead)


class Beam:
    """A lamp's beam about an axis, as receivers at a distance see it."""

    def __init__(self, field, aim=(0.0, 0.0)):
        self.field = field
        self.forward, self.right, self.up = frame_vectors(*aim)

    def direction(self, h, v):
        h, v = np.radians(h), np.radians(v)
        return np.cos(v) * (np.cos(h) * self.forward + np.sin(h) * self.right) + np.sin(v) * self.up

    def value(self, h, v, side=SIDE, nodes=3):
        """r^2 times the mean of illuminance over a square that faces the lamp, by Gauss' rule."""
        d = self.direction(h, v)
        across = np.cos(np.radians(h)) * self.right - np.sin(np.radians(h)) * self.forward
        upwards = np.cross(across, d)
        x, w = np.polynomial.legendre.leggauss(nodes)
        mean = 0
        for a, wa in zip(x, w):
            for b, wb in zip(x, w):
                p = DISTANCE * d + side / 2 * (a * across + b * upwards)
                mean += wa * wb / 4 * self.field.irradiance(p, -d)[0]
        return DISTANCE**2 * mean

    def cut_off(self, h, low, high):
        """V of the cut-off on the scan upwards from `low`, and the largest gradient."""
        known = {}

        def one(v):
            key = round(v, 9)
            if key not in known:
                known[key] = self.value(h, v, SMALL_SIDE, nodes=2)
            return known[key]

        at = lambda v: np.log10(one(v) / one(v + 0.1))
        scan = low + 0.05 * np.arange(int(round((high - low) / 0.05)) - 1)
        middle = max(scan, key=at)
        tilt = lambda x: sum(k * at(x + 0.05 * k) for k in range(-2, 3))
        left, right = middle - 0.1, middle + 0.1
        for _ in range(9):
            x = (left + right) / 2
            left, right = (x, right) if tilt(x) > 0 else (left, x)
        fine = [at(v) for v in np.arange(middle - 0.05, middle + 0.051, 0.01)]
        return x + 0.05, max(fine)


def lamp():
    """Smooth, with a cut-off that is 0.6 degrees too low; brighter to the right."""
    g = Geometry(delta=0.4, basis="bilinear", width=2, height=2, u0=-0.0015, v0=-0.0015, h=0.001, s0=-0.06,
                 t1=0.04, ds=0.12 / 60, dt=0.08 / 100, columns=60, rows=100)  # fmt: skip
    s, t = g.texel_centres()
    h, v = np.degrees(np.arctan2(-s, g.delta)), np.degrees(np.arctan2(t, g.delta))
    shape = (300 + 20000 / (1 + np.exp((v + 1.2) / 0.25)))[:, None] * (1 + 0.03 * h)[None, :]
    weights = np.array([[1.0, 1.1], [0.9, 1.05]])
    c = weights[:, :, None, None, None] * shape[None, None, :, :, None] / (g.delta * 2 * g.h) ** 2
    return LightField(g, c.astype(np.float32).astype(float))


class Headlamp(Judgement):
    def close(self, found, expected, relative, what):
        self.assertLess(abs(found - expected), relative * abs(expected), f"{what}: {found} {expected}")

    def test_requirements(self):
        field = lamp()
        field.write(self.folder / "x.lf.exr")
        self.write("own.toml", REGULATION)
        self.write("ask.toml", '[[headlamp]]\nregulation = "own.toml"\n')
        found = self.figures("photometry", "x.lf.exr", "--ask", "ask.toml")["headlamps"][0]
        # Aimed upwards alone, by the cut-off at H = -2.5.
        v = 0.0
        for _ in range(2):
            v += Beam(field, (0, v)).cut_off(-2.5, -2, 1)[0] + 0.57
        self.assertLess(abs(found["aim_deg"][1] - v), 0.005)
        self.assertEqual(found["aim_deg"][0], 0)
        beam = Beam(field, found["aim_deg"])
        place, gradient = beam.cut_off(-2.5, -2, 1)
        self.assertLess(abs(found["cut_off"]["at_deg"][1] - place), 0.005)
        self.close(found["cut_off"]["gradient"], gradient, 0.01, "gradient")
        by = {(one["name"], one["limit"]): one for one in found["requirements"]}
        self.close(by["75R", "min"]["value_cd"], beam.value(1.15, -0.57), 2e-3, "75R")
        both = beam.value(-4, -1) + beam.value(4, -1)
        self.close(by["both", "min"]["value_cd"], both, 2e-3, "sum")
        self.close(by["75R", "max"]["limit_cd"], 1.5 * both, 2e-3, "share")
        share = np.linspace(0, 1, 21)
        line = [beam.value(-4 + 8 * x, -0.86 + 0.56 * x) for x in share]
        self.close(by["line", "min"]["value_cd"], min(line), 5e-3, "line, smallest")
        self.close(by["line", "max"]["value_cd"], max(line), 5e-3, "line, largest")
        # The brightest of a zone below the cut-off lies at its lowest corners.
        zone = [beam.value(h, v) for h, v in ((3, -1), (0, -2), (1.5, -1.5), (2.25, -1.25))]
        self.close(by["zone", "max"]["value_cd"], max(zone), 5e-3, "zone")
        self.assertEqual(by["zone", "max"]["verdict"], "fail")
        self.assertEqual(by["75R", "min"]["verdict"], "pass")
        self.judge_flux(field, beam, by["flux", "min"]["value_lm"])
        peak = by["Imax", "max"]
        self.close(peak["value_cd"], beam.value(*peak["at_deg"]), 2e-3, "peak")

    def judge_flux(self, field, beam, told):
        """The flux through the rectangle, by far-field intensity at the nodes of a rule."""
        total = 0
        h, wh = gauss(np.linspace(-6, 6, 5), 3)
        v, wv = gauss(np.linspace(-4, 3, 15), 3)
        for one_h, weight_h in zip(h, wh):
            for one_v, weight_v in zip(v, wv):
                d = beam.direction(one_h, one_v)
                p = 1e4 * d
                intensity = 1e8 * field.irradiance(p, -d)[0]
                total += weight_h * weight_v * np.cos(np.radians(one_v)) * intensity
        self.close(told, total * np.radians(1) ** 2, 5e-3, "flux")


if __name__ == "__main__":
    unittest.main()
