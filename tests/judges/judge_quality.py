"""Quality of a measurement and the budget of a certificate (docs/photometry.md): spectral indices, the bound
on light beyond the planes, and expanded uncertainties of a session."""

import json
import unittest

import numpy as np

import judge_photometry
import judge_solve
from model import gauss
from program import Judgement

SEED = 20261127

# V(lambda), CIE 018:2019, each 5 nm from 380 to 780, times 1e6.
V = [39, 64, 120, 217, 396, 640, 1210, 2180, 4000, 7300, 11600, 16840, 23000, 29800, 38000, 48000, 60000,
     73900, 90980, 112600, 139020, 169300, 208020, 258600, 323000, 407300, 503000, 608200, 710000, 793200,
     862000, 914850, 954000, 980300, 994950, 1e6, 995000, 978600, 952000, 915400, 870000, 816300, 757000,
     694900, 631000, 566800, 503000, 441200, 381000, 321000, 265000, 217000, 175000, 138200, 107000, 81600,
     61000, 44580, 32000, 23200, 17000, 11920, 8210, 5723, 4102, 2929, 2091, 1484, 1047, 740, 520, 361, 249,
     172, 120, 84.8, 60, 42.4, 30, 21.2, 15]  # fmt: skip


def efficiency(nm):
    return 1e-6 * np.interp(nm, np.arange(380, 781, 5), V, left=0, right=0)


def illuminant_a(nm):
    """ISO/CIE 11664-2:2022: Planck's law at 2848 K, c_2 = 0.01435 m K."""
    return (560 / nm) ** 5 * np.expm1(1.435e7 / (2848 * 560)) / np.expm1(1.435e7 / (2848 * nm))


def integral(*curves):
    """Of the product of functions of nm."""
    nm = np.arange(300, 1100, 0.05) + 0.025
    return 0.05 * np.prod([one(nm) for one in curves], axis=0).sum()


def projected_solid_angle(g, u, v):
    """Of I from (u, v) on F: the integral of cos^4(theta) / delta^2 over it."""
    s, ws = gauss(np.linspace(g.s0, g.s0 + g.columns * g.ds, 9), 8)
    t, wt = gauss(np.linspace(g.t1 - g.rows * g.dt, g.t1, 9), 8)
    distance2 = g.delta**2 + (s - u)[:, None] ** 2 + (t - v)[None, :] ** 2
    return ws @ (g.delta**2 / distance2**2) @ wt


def beyond_planes(field):
    """Over the cells of F: the brightest of the border's texels, from the middle of the cell, times the
    projected solid angle that is not I's."""
    g = field.geometry
    s, t = g.texel_centres()
    border = [(a, b) for b in t for a in s if a in (s[0], s[-1]) or b in (t[0], t[-1])]
    sb, tb = np.array(border).T
    total = 0.0
    for v in (g.knots_v()[1:] + g.knots_v()[:-1]) / 2:
        for u in (g.knots_u()[1:] + g.knots_u()[:-1]) / 2:
            at = lambda x: np.full_like(sb, x)
            brightest = max(0.0, field.radiance(at(u), at(v), sb, tb).max())
            total += g.h**2 * brightest * (np.pi - projected_solid_angle(g, u, v))
    return total


class Quality(Judgement):
    def close(self, found, expected, relative, what):
        self.assertLess(abs(found - expected), relative * abs(expected), what)

    def spectrum(self, name, random, low, high):
        """A file of random values, linear between them; as a function of nm."""
        nm, value = np.linspace(low, high, 12), random.uniform(0.1, 1, 12)
        self.write(name, "\n".join(f"{a:.9g},{b:.9g}" for a, b in zip(nm, value)) + "\n")
        return lambda x: np.interp(x, nm, value, left=0, right=0)

    def test_indices_of_two_lamps(self):
        random = np.random.default_rng(SEED)
        for basis, channels in (("bspline2", 1), ("quadratic", 3)):
            field = judge_photometry.lamp(basis, channels, random)
            field.write(self.folder / "x.lf.exr")
            camera = self.spectrum("camera.csv", random, 350, 950)
            lamp = self.spectrum("lamp.csv", random, 410, 720)
            source = self.spectrum("source.csv", random, 390, 760)
            ask = '[quality]\nresponsivity = "camera.csv"\nlamp_spectrum = "lamp.csv"\n'
            for text, calibration in ((ask, illuminant_a),
                                      (ask + 'calibration_spectrum = "source.csv"\n', source)):  # fmt: skip
                self.write("ask.toml", text)
                told = self.figures("photometry", "x.lf.exr", "--ask", "ask.toml", "--c-step", 90,
                                    "--gamma-step", 30)["quality"]  # fmt: skip
                factor = (integral(lamp, efficiency) / integral(lamp, camera)
                          * integral(calibration, camera) / integral(calibration, efficiency))  # fmt: skip
                self.close(told["spectral_mismatch_factor"], factor, 1e-5, "F")
                stated = told["spectral_mismatch_u_relative"]
                self.assertAlmostEqual(stated, abs(factor - 1) / np.sqrt(3), delta=1e-5)
            scale = integral(illuminant_a, efficiency) / integral(illuminant_a, camera)
            index = integral(lambda nm: np.abs(scale * camera(nm) - efficiency(nm))) / integral(efficiency)
            self.close(told["f1"], index, 1e-4, "f1'")
            self.close(told["beyond_planes_bound_flux_lm"],
                       beyond_planes(judge_photometry.luminance(field)), 1e-4, "bound")  # fmt: skip

    def test_sensor(self):
        """The largest of the channels."""
        judge_photometry.lamp("box", 1, np.random.default_rng(SEED)).write(self.folder / "x.lf.exr")
        channels = [{"linearity": {"largest_deviation": d, "repeatability": r}, "prnu": p}
                    for d, r, p in ((0.002, 1e-4, 0.011), (-0.005, 3e-4, 0.008))]  # fmt: skip
        self.write("s.cal.json", json.dumps({"format": "luxfield sensor calibration", "channels": channels}))
        self.write("ask.toml", '[quality]\nsensor_calibration = "s.cal.json"\n')
        told = self.figures("photometry", "x.lf.exr", "--ask", "ask.toml")["quality"]
        self.assertEqual((told["f3"], told["repeatability"], told["prnu"]), (0.005, 3e-4, 0.011))

    def test_budget_of_a_session(self):
        """A print that is too dense by a stated share makes all light so much too bright; what is
        proportional to the light has the budget's sources but photon and read noise in common."""
        density, mismatch_camera = 0.012, "350,1\n950,1\n"
        self.write("lab.toml", judge_solve.LAB.format(basis="box"))
        self.write("plan.toml", judge_solve.PLAN.format(basis="box", grid=4))
        self.run_program("capture", "plan.toml", "s", "--lab", "lab.toml")
        self.run_program("merge", "s", "-o", "x.meas.exr")
        self.run_program("reconstruct", "x.meas.exr", "-o", "x.lf.exr", "--sigma", "x.sigma.lf.exr")
        self.write("camera.csv", mismatch_camera)
        self.write("lamp.csv", "400,1\n700,2\n")
        self.write("ask.toml", '[[point]]\nposition_m = [0.1, 0, 1]\n[quality]\nresponsivity = "camera.csv"\n'
                               'lamp_spectrum = "lamp.csv"\n')  # fmt: skip
        self.write("b.toml", f"[uncertainty]\ndensity = {density}\nestimate_basis = false\n")
        self.run_program("photometry", "x.lf.exr", "--sigma", "x.sigma.lf.exr", "--ask", "ask.toml",
                         "--session", "s", "--uncertainty", "b.toml", "-o", "x.cert.json")  # fmt: skip
        told = json.loads((self.folder / "x.cert.json").read_text())
        mismatch = told["photometry"]["quality"]["spectral_mismatch_u_relative"]
        self.assertGreater(mismatch, 0.01)
        common = 0.0
        for quantity in told["budget"]["quantities"]:
            sources, value = quantity["sources"], abs(quantity["value"])
            self.close(sources["density"], density * value, 1e-3, "density")
            self.close(sources["spectral mismatch"], mismatch * value, 1e-9, "mismatch")
            squares = {name: sigma**2 for name, sigma in sources.items() if sigma is not None}
            self.close(quantity["sigma"], np.sqrt(sum(squares.values())), 1e-9, "total")
            self.close(quantity["relative"], quantity["sigma"] / value, 1e-9, "relative")
            if quantity["name"] == "flux":
                flux = quantity
                shared = [square for name, square in squares.items()
                          if name not in ("photon noise", "read noise")]  # fmt: skip
                common = np.sqrt(sum(shared)) / value
        proportional = ("lm", "cd", "lx", "cd/m²")
        for result in told["results"]:
            if result["quantity"] == "Luminous flux":
                expected = 2 * flux["relative"] * abs(result["value"])
            elif result["unit"] in proportional:
                expected = 2 * np.hypot(result["u_noise"], common * result["value"])
            else:
                expected = 2 * result["u_noise"]
            self.close(result["U"], expected, 1e-6, result["quantity"])


if __name__ == "__main__":
    unittest.main()
