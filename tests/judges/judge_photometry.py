"""What `luxfield photometry` says of a lamp, recomputed from the definitions of docs/photometry.md."""

import unittest

import numpy as np

import model
from model import Geometry, LightField, gauss
from program import Judgement

SEED = 20261125
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

ASK = """
[[point]]
position_m = [0.21, -0.13, 0.9]
normal = [-0.2, 0.1, -1]
axis = [0.1, 1, 0.2]
facing = [0.3, 0, -1]
[[point]]
position_m = [-0.02, 0.01, 0.17]
[[plane]]
centre_m = [0.1, -0.2, 1.5]
width_m = 1.2
height_m = 0.8
columns = 4
rows = 3
[[eye]]
eye_m = [0.2, -0.1, 1.1]
fields_of_view_mrad = [11, 60]
threshold_cd_per_m2 = 3000
background_cd_per_m2 = 30
road_luminance_cd_per_m2 = 2
age_years = 50
line_of_sight = [-0.3, 0.25, -1]
up = [0, 1, 0]
opening_m = [0.1, 0.08]
[[glare]]
below_m = 1.2
distances_m = [0.2, 0.3]
c_deg = [20, 250]
background_cd_per_m2 = 30
opening_m = [0.1, 0.08]
"""


WEIGHED = """
[[weighting]]
name = "photons"
unit = "umol/(m2 s)"
factors = [{}]
[[plane]]
centre_m = [0.1, -0.2, 1.5]
width_m = 0.6
height_m = 0.9
columns = 2
rows = 3
receiver = "semicylinder"
axis = [0, 1, 0]
facing = [0.6, 0, -0.8]
weighting = "photons"
[[line]]
from_m = [-0.3, 0.1, 0.5]
to_m = [0.2, 0.3, 2]
points = 3
weighting = "photons"
[[volume]]
centre_m = [0.1, -0.2, 1.5]
width_m = 0.6
height_m = 0.9
depth_m = 1
columns = 2
rows = 1
layers = 2
weighting = "photons"
[[path]]
weighting = "photons"
[[path.key]]
t_s = -1
position_m = [-0.3, 0.1, 0.5]
normal = [0, 0, -1]
[[path.key]]
t_s = 2
position_m = [0.2, 0.3, 1]
normal = [0, 0.6, -0.8]
"""


def lamp(basis, channels, random, columns=14, rows=11):
    """Smooth but for noise, brightest off the axis; no two lengths alike, texels not square."""
    g = Geometry(
        delta=0.29,
        basis=basis,
        width=4,
        height=3,
        u0=-0.055,
        v0=-0.04,
        h=0.023,
        s0=-0.36,
        t1=0.31,
        ds=0.71 / columns,
        dt=0.6 / rows,
        columns=columns,
        rows=rows,
    )
    s, t = g.texel_centres()
    shape = np.exp(-0.5 * (((s - 0.05) / 0.11)[None, :] ** 2 + ((t + 0.06) / 0.08)[:, None] ** 2))
    c = 1e5 * shape[None, None, :, :, None] * random.uniform(0.8, 1.2, (3, 4, rows, columns, channels))
    return LightField(g, c.astype(np.float32).astype(float))


def luminance(field):
    c = field.c if field.c.shape[-1] == 1 else field.c @ LUMINANCE[:, None]
    return LightField(field.geometry, c)


def breaks(knots, borders):
    return LightField._breaks(knots, borders)


def intensity(field, direction, nodes=4):
    """The integral over F of L(u -> s) cos(theta) du along parallel rays, one channel."""
    g = field.geometry
    x, y, z = direction
    if z <= 0:
        return 0.0
    shift_u, shift_v = g.delta * x / z, g.delta * y / z
    u, wu = gauss(breaks(g.knots_u(), g.s0 + g.ds * np.arange(g.columns + 1) - shift_u), nodes)
    v, wv = gauss(breaks(g.knots_v(), g.t1 - g.dt * np.arange(g.rows + 1) - shift_v), nodes)
    column, row = g.column(u + shift_u), g.row(v + shift_v)
    in_u, in_v = column >= 0, row >= 0
    pu, pv = g.phi_u(u[in_u]) * wu[in_u], g.phi_v(v[in_v]) * wv[in_v]
    seen = field.c[:, :, row[in_v]][:, :, :, column[in_u], 0]  # (H, W, v, u)
    cosine = z / np.sqrt(x * x + y * y + z * z)
    return np.einsum("jiab,ja,ib->", seen, pv, pu) * g.delta**2 / cosine**3


def over_directions(field, p, kernel, nodes=4):
    """The integral of L(w) kernel(w) dw over the directions in which F is seen from p."""
    g = field.geometry
    z = p[2]
    back = lambda border, at: (border - at * g.delta / z) / (1 - g.delta / z)
    u, wu = gauss(breaks(g.knots_u(), back(g.s0 + g.ds * np.arange(g.columns + 1), p[0])), nodes)
    v, wv = gauss(breaks(g.knots_v(), back(g.t1 - g.dt * np.arange(g.rows + 1), p[1])), nodes)
    total = 0
    for one_v, weight in zip(v, wv):
        vs = np.full_like(u, one_v)
        d = np.stack([u - p[0], vs - p[1], np.full_like(u, -z)])
        r = np.sqrt((d**2).sum(0))
        s, t = u + (p[0] - u) * g.delta / z, vs + (p[1] - vs) * g.delta / z
        radiance = field.radiance(u, vs, s, t)[:, 0]
        total = total + weight * ((wu * radiance * z / r**3) * kernel(d / r)).sum(-1)
    return total


def radiance_towards(field, p, w):
    """L seen from p along unit vectors w, (3, n)."""
    g = field.geometry
    to_f, to_i = -p[2] / w[2], (g.delta - p[2]) / w[2]
    at = lambda k, to: p[k] + to * w[k]
    return field.radiance(at(0, to_f), at(1, to_f), at(0, to_i), at(1, to_i))[:, 0]


def cone(w, full_angle, rings=60, around=180):
    """Directions of equal solid angle about w."""
    w = w / np.linalg.norm(w)
    x = np.cross(w, [0.3, 1, 0.2])
    x /= np.linalg.norm(x)
    y = np.cross(w, x)
    versine = (np.arange(rings) + 0.5) / rings * (1 - np.cos(full_angle / 2))
    cosine, sine = (1 - versine)[:, None], np.sqrt(versine * (2 - versine))[:, None]
    angle = 2 * np.pi * (np.arange(around) + 0.3)[None, :] / around
    parts = (cosine + 0 * angle, sine * np.cos(angle), sine * np.sin(angle))
    return sum(v[:, None] * part.ravel()[None, :] for v, part in zip((w, x, y), parts))


def area_above(field, p, threshold, steps=1200):
    """Solid angle and projected area of what is as bright as the threshold, its mean luminance and
    middle."""
    g = field.geometry
    ku, kv = g.knots_u(), g.knots_v()
    u = ku[0] + (ku[-1] - ku[0]) * (np.arange(steps) + 0.5) / steps
    cell = (ku[-1] - ku[0]) * (kv[-1] - kv[0]) / steps**2
    omega, projected, light, middle = 0.0, 0.0, 0.0, np.zeros(3)
    for v in kv[0] + (kv[-1] - kv[0]) * (np.arange(steps) + 0.5) / steps:
        d = np.stack([u - p[0], np.full_like(u, v - p[1]), np.full_like(u, -p[2])])
        r = np.sqrt((d**2).sum(0))
        luminance = radiance_towards(field, p, d / r)
        bright = luminance >= threshold
        part = cell * p[2] / r**3 * bright
        omega += part.sum()
        projected += (part * r**2).sum()
        light += (part * luminance).sum()
        middle += ((part * luminance) * d / r).sum(1)
    return omega, projected, light / omega if omega else 0.0, middle


def solid_angle(p, width, height):
    """Of a rectangle on F about the origin, by its corners' arc tangents."""
    corner = lambda x, y: np.arctan2(x * y, p[2] * np.sqrt(x * x + y * y + p[2] ** 2))
    x0, x1, y0, y1 = -width / 2 - p[0], width / 2 - p[0], -height / 2 - p[1], height / 2 - p[1]
    return corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)


def position_index(sight, up, w):
    """Guth's, CIE 117-1995."""
    sight, w = sight / np.linalg.norm(sight), w / np.linalg.norm(w)
    up = up - (up @ sight) * sight
    up /= np.linalg.norm(up)
    beta = np.degrees(np.arccos(sight @ w))
    aside = w - (w @ sight) * sight
    alpha = np.degrees(np.arccos(np.clip(aside @ up / np.linalg.norm(aside), -1, 1)))
    return np.exp((35.2 - 0.31889 * alpha - 1.22 * np.exp(-2 * alpha / 9)) * 1e-3 * beta
                  + (21 + 0.26667 * alpha - 0.002963 * alpha**2) * 1e-5 * beta**2)  # fmt: skip


def rating(luminance, omega, p, background):
    return 8 * np.log10(0.25 / background * luminance**2 * omega / p**2)


# IEC 61966-2-1: XYZ of linear Rec. 709, white D65.
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def chromaticity(rgb):
    x, y, z = XYZ @ np.asarray(rgb)
    return x / (x + y + z), y / (x + y + z), 4 * x / (x + 15 * y + 3 * z), 9 * y / (x + 15 * y + 3 * z)


def colour_temperature(x, y):
    """McCamy's, Color Research and Application 17 (1992): within some kelvin near the locus."""
    n = (x - 0.3320) / (0.1858 - y)
    return 449 * n**3 + 3525 * n**2 + 6823.3 * n + 5520.33


def distance_from_locus(x, y):
    """Duv by Ohno's polynomial, LEUKOS 10 (2014): within 1e-4 of the locus."""
    u, v = 4 * x / (-2 * x + 12 * y + 3) - 0.292, 6 * y / (-2 * x + 12 * y + 3) - 0.24
    length = np.hypot(u, v)
    k = [-0.00616793, 0.0893944, -0.5179722, 1.5317403, -2.4243787, 1.925865, -0.471106]
    return length - np.polyval(k, np.arccos(u / length))


def vector(c_deg, gamma_deg):
    """docs/axes.md."""
    c, gamma = np.radians(c_deg), np.radians(gamma_deg)
    return np.array([np.sin(gamma) * np.cos(c), -np.sin(gamma) * np.sin(c), np.cos(gamma)])


def find_peak(field):
    """On a lattice of slopes, then on finer ones about the best."""
    g = field.geometry
    x0, y0, half = 0.0, 0.0, 0.6
    steps = 20
    while half > 1e-6:
        grid = np.linspace(-half, half, steps + 1)
        best = max(
            (intensity(field, (x0 + x, y0 + y, 1)), x0 + x, y0 + y) for x in grid for y in grid
        )
        _, x0, y0 = best
        half, steps = half / 5, 10
    d = np.array([x0, y0, 1])
    return best[0], d / np.linalg.norm(d)


def edge(field, peak, side, level):
    """Degrees from the peak towards `side` to where intensity first falls to the level."""
    at = lambda a: intensity(field, np.cos(a) * peak + np.sin(a) * side)
    step, a = np.radians(1), 0.0
    while at(a + step) >= level:
        a += step
    low, high = a, a + step
    for _ in range(25):
        middle = (low + high) / 2
        low, high = (middle, high) if at(middle) >= level else (low, middle)
    return np.degrees(low)


def full_angles(field, peak, d, share):
    along_u = np.array([1.0, 0, 0]) - d[0] * d
    along_u /= np.linalg.norm(along_u)
    across = np.cross(d, along_u)
    return [
        sum(edge(field, d, sign * side, share * peak) for sign in (-1, 1))
        for side in (along_u, across)
    ]


def inverse_square(field, i, tolerance):
    """The last distance on the axis, coming from far away, within the tolerance."""
    away = lambda r: abs(over_directions(field, (0, 0, r), lambda w: -w[2]) * r * r / i - 1)
    r = 50.0
    if away(r) > tolerance:
        raise AssertionError("no inverse square at 50 m")
    while away(r / 1.2) <= tolerance:
        r /= 1.2
    low, high = r / 1.2, r
    for _ in range(25):
        middle = (low + high) / 2
        low, high = (low, middle) if away(middle) <= tolerance else (middle, high)
    return high


class Photometry(Judgement):
    def close(self, found, expected, relative, what):
        self.assertLess(abs(found - expected), relative * abs(expected) + 1e-9, what)

    def judge(self, basis, channels):
        field = lamp(basis, channels, np.random.default_rng(SEED))
        field.write(self.folder / "x.lf.exr")
        factors = [4.6, 4.1, 3.7][:channels]
        self.write("ask.toml", ASK + WEIGHED.format(", ".join(map(str, factors))))
        found = self.figures("photometry", "x.lf.exr", "--ask", "ask.toml", "--c-step", 60,
                             "--gamma-step", 15)  # fmt: skip
        y = luminance(field)
        self.close(found["flux_lm"], y.flux()[0], 1e-5, "flux")
        axis = intensity(y, (0, 0, 1))
        self.close(found["intensity_axis_cd"], axis, 1e-5, "axis")
        for c, row in zip(found["intensity"]["c_deg"], found["intensity"]["cd"]):
            for gamma, value in zip(found["intensity"]["gamma_deg"], row):
                self.close(value, intensity(y, vector(c, gamma)) if gamma < 90 else 0, 1e-5,
                           f"C {c} gamma {gamma}")  # fmt: skip
        peak, d = find_peak(y)
        self.close(found["intensity_peak_cd"], peak, 1e-5, "peak")
        told = vector(found["peak_c_deg"], found["peak_gamma_deg"])
        self.assertLess(np.linalg.norm(told - d), 1e-3)
        for name, share in (("beam", 0.5), ("field", 0.1)):
            angles = full_angles(y, peak, d, share)
            self.close(found[f"{name}_angle_c0_deg"], angles[0], 1e-3, name)
            self.close(found[f"{name}_angle_c90_deg"], angles[1], 1e-3, name)
            self.close(found[f"{name}_angle_deg"], np.mean(angles), 1e-3, name)
        for percent in (1, 5, 10):
            self.close(found["inverse_square_distance_m"][str(percent)],
                       inverse_square(y, axis, percent / 100), 1e-3, f"{percent} %")  # fmt: skip
        self.judge_symmetry(y, found)
        self.judge_points(y, found)
        self.judge_eye(y, found["eyes"][0])
        self.judge_glare(y, found["glare"][0])
        self.judge_weighed(LightField(field.geometry, field.c @ np.array(factors)[:, None]),
                           found)  # fmt: skip
        self.judge_colour(field, found["colour"], vector(found["peak_c_deg"], found["peak_gamma_deg"]))
        plane = found["planes"][0]
        values = np.array(plane["illuminance_lx"])
        for row in range(3):
            for column in range(4):
                p = (0.1 - 0.6 + 0.3 * (column + 0.5), -0.2 + 0.4 - 0.8 / 3 * (row + 0.5), 1.5)
                self.close(values[row, column], y.irradiance(p, (0, 0, -1))[0], 1e-5, "plane")
        self.close(plane["illuminance_mean_lx"], values.mean(), 1e-9, "mean")
        self.close(plane["uniformity_min_mean"], values.min() / values.mean(), 1e-9, "uniformity")

    def judge_symmetry(self, field, found, steps=48):
        """Over slopes x, y of directions in which there is light, d omega = cos^3 dx dy."""
        g = field.geometry
        ku, kv = g.knots_u(), g.knots_v()
        s1, t0 = g.s0 + g.ds * g.columns, g.t1 - g.dt * g.rows
        x0, x1 = (g.s0 - ku[-1]) / g.delta, (s1 - ku[0]) / g.delta
        y0, y1 = (t0 - kv[-1]) / g.delta, (g.t1 - kv[0]) / g.delta
        all_x = x0 + (x1 - x0) * (np.arange(steps) + 0.5) / steps
        all_y = y0 + (y1 - y0) * (np.arange(steps) + 0.5) / steps
        apart, light = np.zeros(2), 0.0
        for x in all_x:
            for y in all_y:
                omega = (1 + x * x + y * y) ** -1.5
                own = intensity(field, (x, y, 1), 2)
                light += omega * own
                for k, mirrored in enumerate(((x, -y, 1), (-x, y, 1))):
                    apart[k] += omega * abs(own - intensity(field, mirrored, 2))
        self.close(found["asymmetry_c0_c180"], apart[0] / 2 / light, 1e-2, "C0-C180")
        self.close(found["asymmetry_c90_c270"], apart[1] / 2 / light, 1e-2, "C90-C270")
        # Slopes that all of F is seen along.
        least = min(-(g.s0 - ku[0]), s1 - ku[-1], -(t0 - kv[0]), g.t1 - kv[-1]) / g.delta
        self.close(found["covered_gamma_deg"], np.degrees(np.arctan(max(least, 0))), 1e-9, "covered")

    def judge_points(self, field, found):
        unit = lambda v: np.asarray(v, float) / np.linalg.norm(v)
        for point in found["points"]:
            p, n, axis = (np.array(point[key]) for key in ("position_m", "normal", "axis"))
            sine = lambda w: np.sqrt(1 - (axis @ w) ** 2)
            self.close(point["illuminance_lx"], field.irradiance(p, n)[0], 1e-5, "illuminance")
            self.close(point["illuminance_spherical_lx"],
                       over_directions(field, p, lambda w: 0.25), 1e-5, "spherical")  # fmt: skip
            self.close(point["illuminance_cylindrical_lx"],
                       over_directions(field, p, lambda w: sine(w) / np.pi), 1e-5, "cylindrical")  # fmt: skip
            j = over_directions(field, p, lambda w: w)
            for told, expected in zip(point["light_vector_lx"], j):
                self.assertLess(abs(told - expected), 1e-5 * np.linalg.norm(j))
            if point["facing"] is None:
                self.assertIsNone(point["illuminance_semicylindrical_lx"])
                continue
            facing = np.array(point["facing"])
            asked = np.array([0.3, 0, -1])
            self.assertLess(np.linalg.norm(facing - unit(asked - (asked @ axis) * axis)), 1e-9)
            self.close(point["illuminance_semicylindrical_lx"],
                       over_directions(field, p, lambda w: (sine(w) + facing @ w) / np.pi),
                       1e-5, "semicylindrical")  # fmt: skip

    def judge_weighed(self, field, found):
        told = found["planes"][1]
        axis, facing = np.array([0.0, 1, 0]), np.array([0.6, 0, -0.8])
        kernel = lambda w: (np.sqrt(1 - (axis @ w) ** 2) + facing @ w) / np.pi
        values = np.array(told["irradiance_semicylindrical_weighted"])
        for row in range(3):
            for column in range(2):
                p = np.array([0.1 - 0.3 + 0.3 * (column + 0.5), -0.2 + 0.45 - 0.3 * (row + 0.5), 1.5])
                self.close(values[row, column], over_directions(field, p, kernel), 1e-5, "weighed")
        fluence = lambda p: over_directions(field, np.array(p), lambda w: 0.25)
        line = found["lines"][0]["irradiance_spherical_weighted"]
        for told_there, p in zip(line, ([-0.3, 0.1, 0.5], [-0.05, 0.2, 1.25], [0.2, 0.3, 2])):
            self.close(told_there, fluence(p), 1e-5, "line")
        volume = np.array(found["volumes"][0]["irradiance_spherical_weighted"])
        for layer, z in enumerate((1.25, 1.75)):
            for column, x in enumerate((-0.05, 0.25)):
                self.close(volume[layer, 0, column], fluence([x, -0.2, z]), 1e-5, "volume")
        dose, steps = 0.0, 300
        for share in (np.arange(steps) + 0.5) / steps:
            n = np.array([0, 0.6 * share, share * -0.8 - (1 - share)])
            p = np.array([-0.3, 0.1, 0.5]) + share * np.array([0.5, 0.2, 0.5])
            dose += 3 / steps * field.irradiance(p, n / np.linalg.norm(n))[0]
        self.close(found["paths"][0]["dose_weighted_s"], dose, 1e-4, "dose")
        self.close(told["irradiance_semicylindrical_mean_weighted"], values.mean(), 1e-9, "mean")

    def judge_eye(self, field, told):
        p, sight, up = np.array([0.2, -0.1, 1.1]), np.array([-0.3, 0.25, -1.0]), np.array([0, 1.0, 0])
        sight /= np.linalg.norm(sight)
        random = np.random.default_rng(SEED)
        for one in told["fields_of_view"]:
            angle, w = one["field_of_view_mrad"] / 1000, np.array(one["direction"])
            mean = lambda d: radiance_towards(field, p, cone(d, angle)).mean()
            self.close(one["luminance_largest_mean_cd_per_m2"], mean(w), 2e-3, "field of view")
            # Of single rays within it, at a thousandth of its width from each other.
            rays = radiance_towards(field, p, cone(w, angle, 400, 1000))
            peak = np.array(one["peak_direction"])
            self.close(one["luminance_peak_cd_per_m2"], radiance_towards(field, p, peak[:, None])[0],
                       1e-5, "peak")  # fmt: skip
            self.assertLess(rays.max(), (1 + 1e-5) * one["luminance_peak_cd_per_m2"])
            self.assertGreaterEqual(peak @ w, np.cos(angle / 2) - 1e-12)
            # Nowhere else is it brighter.
            for _ in range(40):
                other = np.array([*random.uniform(-0.06, 0.06, 2), 0]) - p
                self.assertLess(mean(other), 1.002 * mean(w))
        omega, projected, luminance, middle = area_above(field, p, 3000)
        self.close(told["luminous_solid_angle_sr"], omega, 1e-3, "solid angle of the luminous area")
        self.close(told["luminous_area_m2"], projected, 1e-3, "projected luminous area")
        self.close(told["luminance_of_luminous_area_cd_per_m2"], luminance, 1e-3, "its luminance")
        index = position_index(sight, up, middle)
        self.assertLess(abs(told["ugr"] - rating(luminance, omega, index, 30)), 0.01)
        opening = solid_angle(p, 0.1, 0.08)
        mean = over_directions(field, p, lambda w: 1.0) / opening
        index = position_index(sight, up, -p)
        self.assertLess(abs(told["ugr_plain"] - rating(mean, opening, index, 30)), 1e-3)

        def veil(w):
            degrees = np.degrees(np.arccos(np.clip(np.einsum("i,in->n", sight, w), -1, 1)))
            inside = (degrees >= 1.5) & (degrees <= 60)
            return inside * np.cos(np.radians(degrees)) / np.where(inside, degrees, 1) ** 2

        veiling = 9.86 * (1 + (50 / 66.4) ** 4) * over_directions(field, p, veil)
        self.close(told["veiling_luminance_cd_per_m2"], veiling, 1e-3, "veiling luminance")
        self.close(told["threshold_increment_percent"], 65 * veiling / 2**0.8, 1e-3, "TI")

    def judge_glare(self, field, told):
        for c, plane, uneven in zip((20, 250), told["ugr_plain"], told["ugr"]):
            for distance, value, of_area in zip((0.2, 0.3), plane, uneven):
                aside = vector(c, 90)
                p = distance * aside + np.array([0, 0, 1.2])
                omega, _, luminance, middle = area_above(field, p, 500, 600)
                index = position_index(-aside, np.array([0, 0, -1.0]), middle)
                self.assertLess(abs(of_area - rating(luminance, omega, index, 30)), 0.02)
                omega = solid_angle(p, 0.1, 0.08)
                mean = over_directions(field, p, lambda w: 1.0) / omega
                index = position_index(-aside, np.array([0, 0, -1.0]), -p)
                self.assertLess(abs(value - rating(mean, omega, index, 30)), 1e-3)

    def judge_colour(self, field, told, peak):
        if field.c.shape[-1] == 1:
            return self.assertIsNone(told)
        of = lambda d: [intensity(LightField(field.geometry, field.c[..., k : k + 1]), d) for k in range(3)]
        self.judge_evenness(field, told, of)
        for name, rgb in (("mean", field.flux()), ("axis", of((0, 0, 1))), ("peak", of(peak))):
            for key, value in zip(("x", "y", "u_prime", "v_prime"), chromaticity(rgb)):
                self.assertLess(abs(told[name][key] - value), 2e-4, f"{name} {key}")
            x, y = chromaticity(rgb)[:2]
            self.close(told[name]["cct_k"], colour_temperature(x, y), 5e-3, f"{name} CCT")
            self.assertLess(abs(told[name]["duv"] - distance_from_locus(x, y)), 3e-4, f"{name} Duv")

    def judge_evenness(self, field, told, of):
        """Of the table's directions, each for the solid angle of its ring of gamma."""
        mean = np.array(chromaticity(field.flux())[2:])
        seen = []
        for c in told["c_deg"]:
            for gamma in told["gamma_deg"]:
                rgb = of(vector(c, gamma)) if gamma < 90 else [0, 0, 0]
                half = (told["gamma_deg"][1] - told["gamma_deg"][0]) / 2
                ring = np.cos(np.radians(max(gamma - half, 0))) - np.cos(np.radians(gamma + half))
                seen.append((LUMINANCE @ rgb, ring, rgb))
        most = max(one[0] for one in seen)
        bright = [(y * ring, chromaticity(rgb)[2:]) for y, ring, rgb in seen if y >= 0.1 * most]
        weights = np.array([weight for weight, _ in bright])
        away = np.array([np.linalg.norm(np.array(uv) - mean) for _, uv in bright])
        self.assertLess(abs(told["deviation_largest"] - away.max()), 1e-4)
        rms = np.sqrt((weights * away**2).sum() / weights.sum())
        self.assertLess(abs(told["deviation_rms"] - rms), 1e-4)

    def test_two_lamps(self):
        """`compare` says of both what `photometry` says of each."""
        random = np.random.default_rng(SEED + 1)
        told = []
        for name in ("a", "b"):
            lamp("bspline2", 1, random).write(self.folder / f"{name}.lf.exr")
            told.append(self.figures("photometry", f"{name}.lf.exr"))
        found = self.figures("compare", "a.lf.exr", "b.lf.exr")["photometry"]
        by = {one["name"]: one for one in found["quantities"]}
        for name, key in (("flux", "flux_lm"), ("intensity on the axis", "intensity_axis_cd"),
                          ("largest intensity", "intensity_peak_cd"), ("beam angle", "beam_angle_deg"),
                          ("field angle", "field_angle_deg")):  # fmt: skip
            one = by[name]
            self.close(one["a"], told[0][key], 1e-9, name)
            self.close(one["b"], told[1][key], 1e-9, name)
            self.assertAlmostEqual(one["difference"], told[0][key] - told[1][key], delta=1e-9 * abs(told[0][key]))

    def test_one_channel(self):
        self.judge("bspline2", 1)

    def test_luminance_of_three(self):
        self.judge("quadratic", 3)

    def test_uncertainties(self):
        """sigma of E through the inverse of the Gram matrices, in full, against what the program
        finds from sigma(C)."""
        random = np.random.default_rng(SEED)
        field = lamp("bspline2", 1, random, columns=5, rows=4)
        g = field.geometry
        gu, gv = g.gram("u"), g.gram("v")
        e = np.einsum("jk,il,klrcx->jircx", gv, gu, field.c)
        sigma = e.max() * random.uniform(0.001, 0.01, e.shape).astype(np.float32)
        model.write_measurements(self.folder / "x.meas.exr", g, e, sigma)
        self.run_program("reconstruct", "x.meas.exr", "-o", "x.lf.exr", "--sigma",
                         "x.sigma.lf.exr", "--keep", "none")  # fmt: skip
        self.write("ask.toml", ASK)
        found = self.figures("photometry", "x.lf.exr", "--sigma", "x.sigma.lf.exr", "--ask",
                             "ask.toml")  # fmt: skip
        ru, rv = np.linalg.inv(gu), np.linalg.inv(gv)

        def uncertainty(of):
            """Of a linear quantity of a light field, by its value for every coefficient alone."""
            q = np.zeros(field.c.shape)
            for index in np.ndindex(*field.c.shape):
                one = LightField(g, np.zeros(field.c.shape))
                one.c[index] = 1
                q[index] = of(one)
            w = np.einsum("jk,il,jircx->klrcx", rv, ru, q)
            return np.sqrt((w**2 * sigma**2).sum())

        self.close(found["flux_lm_u"], uncertainty(lambda f: f.flux()[0]), 1e-3, "flux")
        self.close(found["intensity_axis_cd_u"], uncertainty(lambda f: intensity(f, (0, 0, 1))),
                   1e-3, "axis")  # fmt: skip
        p = np.array([-0.02, 0.01, 0.17])
        self.close(found["points"][1]["illuminance_spherical_lx_u"],
                   uncertainty(lambda f: over_directions(f, p, lambda w: 0.25)),
                   1e-3, "spherical")  # fmt: skip


if __name__ == "__main__":
    unittest.main()
