"""Radiance, irradiance and flux that `budget` states of a session, against the same field
evaluated here."""

import unittest

import numpy as np

import model
from judge_solve import LAB, PLAN
from program import Judgement

SEED = 20261129


class Radiance(Judgement):
    def test_rays_receivers_and_flux(self):
        random = np.random.default_rng(SEED)
        self.write("lab.toml", LAB.format(basis="bspline2"))
        self.write("plan.toml", PLAN.format(basis="bspline2", grid=6))
        self.run_program("capture", "plan.toml", "s", "--lab", "lab.toml")
        self.run_program("merge", "s", "-o", "x.meas.exr")
        self.run_program("reconstruct", "x.meas.exr", "-o", "x.lf.exr", "--double")
        field = model.read_light_field(self.folder / "x.lf.exr")
        g = field.geometry
        s, t = g.texel_centres()
        rays = [
            (random.uniform(-0.03, 0.03, 2), (s[random.integers(80)], t[random.integers(72)]))
            for _ in range(8)
        ]
        points = [(x, y, z) for x, y, z in random.uniform((-0.5, -0.5, 0.5), (0.5, 0.5, 4), (5, 3))]
        normal = np.array([0.1, -0.2, -1.0])
        normal /= np.linalg.norm(normal)
        self.write(
            "ask.toml",
            "".join(
                f'[[radiance]]\nname = "r{k}"\nu_m = [{u[0]!r}, {u[1]!r}]\ns_m = [{float(x)!r}, {float(y)!r}]\n'
                for k, (u, (x, y)) in enumerate(rays)
            )
            + "".join(
                f'[[irradiance]]\nname = "e{k}"\np_m = {[float(c) for c in p]}\nnormal = {[float(c) for c in normal]}\n'
                for k, p in enumerate(points)
            ),
        )
        told = self.figures("budget", "s", "--uncertainty", "ask.toml")
        values = {q["name"]: q["value"] for q in told["quantities"]}
        errors = []
        for k, (u, (x, y)) in enumerate(rays):
            mine = field.radiance(np.array([u[0]]), np.array([u[1]]), np.array([x]), np.array([y]))[
                0, 0
            ]
            errors.append(values[f"r{k}"] / mine - 1)
        light = [
            values[f"e{k}"] / field.irradiance(np.array(p), normal)[0] - 1
            for k, p in enumerate(points)
        ]
        flux = values["flux"] / field.flux()[0] - 1
        print(
            f"radiance {np.abs(errors).max():.1e}, irradiance {np.abs(light).max():.1e}, flux {flux:.1e} apart"
        )
        self.assertLess(np.abs(errors).max(), 1e-6)
        self.assertLess(np.abs(light).max(), 2e-5)
        self.assertLess(abs(flux), 2e-6)


if __name__ == "__main__":
    unittest.main()
