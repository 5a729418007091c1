"""A simulated capture, its merge and the solve for C, against quadrature and closed forms of a
Lambertian square."""

import itertools
import unittest

import numpy as np

import model
from model import Geometry, gauss
from program import Judgement

SEED = 20261125
SIDE, RADIANCE, DELTA, SPACING = 0.066, 1e5, 0.3, 0.033  # m, cd/m2, m, m

LAB = f"""
[lab]
driver = "sim"
name = "a Lambertian square before an ideal camera"
ideal = true
[rig]
kind = "lensless"
delta_m = {DELTA}
[filter]
kind = "basis"
basis = "{{basis}}"
spacing_m = {SPACING}
[lamp]
kind = "square"
side_m = {SIDE}
radiance = {RADIANCE}
[camera]
width = 92
height = 84
pitch_m = 0.0165
bits = 14
saturation_dn = 16000
responsivity_e_per_s_per_w_m2 = [10]
min_exposure_s = 1e-4
max_exposure_s = 10
[stage]
min_m = [-0.2, -0.2]
max_m = [0.2, 0.2]
[sampling]
u_per_cell = 6
"""
PLAN = f"""
[plan]
name = "judge"
unit = "lm"
[rig]
kind = "lensless"
delta_m = {DELTA}
[filter]
kind = "basis"
basis = "{{basis}}"
spacing_m = {SPACING}
[grid]
width = {{grid}}
height = {{grid}}
[lattice]
width = 80
height = 72
ds_m = 0.0165
[exposure]
min_s = 0.001
max_s = 4
"""


def square_density(u, v, s, t):
    """L cos^4(theta) / delta^2 of the square."""
    inside = (np.abs(u) < SIDE / 2) & (np.abs(v) < SIDE / 2)
    return np.where(
        inside, RADIANCE * DELTA**2 / (DELTA**2 + (u - s) ** 2 + (v - t) ** 2) ** 2, 0.0
    )


def polygon_irradiance(corners, p, normal):
    """Lambert's formula: E = L / 2 sum over edges of the angle that an edge is seen under times
    n.(its plane's normal);
    the whole polygon lies before the receiver."""
    rays = [np.asarray(c, float) - p for c in corners]
    rays = [r / np.linalg.norm(r) for r in rays]
    total = 0.0
    for a, b in zip(rays, rays[1:] + rays[:1]):
        across = np.cross(a, b)
        total += (
            np.arctan2(np.linalg.norm(across), a @ b) * (across @ normal) / np.linalg.norm(across)
        )
    return RADIANCE / 2 * abs(total)


def grid(basis, size):
    """size x size positions about the axis, and a lattice that the sensor always covers."""
    n = model.SUPPORT_CELLS[basis]
    start = -(size + n - 1) / 2 * SPACING
    return Geometry(
        DELTA,
        basis,
        size,
        size,
        start,
        start,
        SPACING,
        -80 * 0.0165 / 2,
        72 * 0.0165 / 2,
        0.0165,
        0.0165,
        80,
        72,
    )


def flux_through_lattice(g):
    """Closed over u by quadrature of the smooth density over the square and the lattice's texels'
    centres."""
    x, w = gauss([-SIDE / 2, 0, SIDE / 2], 8)
    s, t = g.texel_centres()
    values = (
        RADIANCE
        * DELTA**2
        / (
            DELTA**2
            + (x[:, None, None, None] - s[None, None, :, None]) ** 2
            + (x[None, :, None, None] - t[None, None, None, :]) ** 2
        )
        ** 2
    )
    return np.einsum("a,b,abst->", w, w, values) * g.ds * g.dt


class Solve(Judgement):
    CASES = [("box", 4), ("bilinear", 5), ("bspline2", 6)]

    def test_recovers_any_field_in_the_span(self):
        """Light in the outermost cells: nothing but docs/theory.md 4 can be imposed, and C is
        what it was."""
        random = np.random.default_rng(SEED)
        for basis, a in [("box", 0), ("bilinear", 0), ("quadratic", -0.7), ("bspline2", 0)]:
            with self.subTest(basis=basis):
                g = Geometry(0.01, basis, 7, 5, -0.03, 0.01, 0.004, -0.2, 0.1, 0.01, 0.02, 6, 4, a)
                c = random.uniform(0, 1, (5, 7, 4, 6, 3))
                e = np.einsum("jn,im,nmrck->jirck", g.gram("v"), g.gram("u"), c)
                model.write_measurements(self.folder / "x.meas.exr", g, e, np.full_like(e, 1e-9))
                self.run_program("reconstruct", "x.meas.exr", "-o", "x.lf.exr", "--double")
                found = model.read_light_field(self.folder / "x.lf.exr")
                error = np.sqrt(((found.c - c) ** 2).mean()) / np.sqrt((c**2).mean())
                print(f"{basis}: relative RMSE of C {error:.2g}")
                self.assertLess(
                    error, 3e-6
                )  # E is stored as float32, which G^-1 multiplies by at most 56

    def test_sigma_is_the_spread(self):
        """Noise of known, uneven sigma in E of a lamp within the grid: errors of C over the stated
        sigma."""
        random = np.random.default_rng(SEED)
        g = grid("bspline2", 6)
        g.columns, g.rows = 24, 18
        e = model.measure(g, square_density, 4, [-SIDE / 2, SIDE / 2], [-SIDE / 2, SIDE / 2])
        sigma = e.max() * 0.01 * 10 ** random.uniform(-1, 0, e.shape)
        fields = []
        for noise in (0, 1):
            model.write_measurements(
                self.folder / "x.meas.exr",
                g,
                e + noise * sigma * random.normal(size=e.shape),
                sigma,
            )
            self.run_program(
                "reconstruct", "x.meas.exr", "-o", "x.lf.exr", "--sigma", "sigma.lf.exr", "--double"
            )
            fields.append(model.read_light_field(self.folder / "x.lf.exr").c)
        stated = model.read_light_field(self.folder / "sigma.lf.exr").c
        pulls = (fields[1] - fields[0]) / stated
        # Coefficients of one texel are correlated, texels are not: the mean pull^2 of each texel
        # is one draw.
        per_texel = (pulls**2).mean((0, 1, 4)).ravel()
        z = (per_texel.mean() - 1) / (per_texel.std(ddof=1) / np.sqrt(len(per_texel)))
        print(f"pull^2 {per_texel.mean():.3f}, z {z:.2f}")
        self.assertLess(abs(z), 4.5)

    def test_square_lamp_from_capture_to_illuminance(self):
        for basis, size in self.CASES:
            with self.subTest(basis=basis):
                self.write("lab.toml", LAB.format(basis=basis))
                self.write("plan.toml", PLAN.format(basis=basis, grid=size))
                self.run_program("capture", "plan.toml", basis, "--lab", "lab.toml")
                self.run_program("merge", basis, "-o", "x.meas.exr")
                g, e, _ = model.read_measurements(self.folder / "x.meas.exr")
                edges = [-SIDE / 2, SIDE / 2]
                truth = model.measure(g, square_density, 6, edges, edges)
                error = np.abs(e - truth).max() / truth.max()
                print(f"{basis}: E differs by {error:.2g} of its largest value at most")
                self.assertLess(error, 2e-5)  # float32 frames, merged

                self.run_program("reconstruct", "x.meas.exr", "-o", "x.lf.exr")
                field = model.read_light_field(self.folder / "x.lf.exr")
                flux = field.flux()[0] / flux_through_lattice(g) - 1
                corners = [
                    (x * SIDE / 2, y * SIDE / 2, 0) for x, y in [(-1, -1), (1, -1), (1, 1), (-1, 1)]
                ]
                errors = []
                for x, y, z in itertools.product((-0.2, 0, 0.3), (-0.1, 0.25), (0.7, 3.0)):
                    p = np.array([x * z, y * z, z])
                    normal = np.array([0.2, -0.3, -1.0])
                    normal /= np.linalg.norm(normal)
                    errors.append(
                        field.irradiance(p, normal)[0] / polygon_irradiance(corners, p, normal) - 1
                    )
                print(
                    f"{basis} {size} x {size}: flux {100 * flux:+.3f} %, irradiance "
                    f"{100 * np.sqrt(np.mean(np.square(errors))):.2f} % rms, {100 * np.abs(errors).max():.2f} % worst"
                )
                self.assertLess(abs(flux), 3e-4)
                # What is left is the image of the square smeared over I by texels and spacing: of
                # second order in s.
                self.assertLess(np.abs(errors).max(), 0.01)


if __name__ == "__main__":
    unittest.main()
