"""Irradiance of a light field, horizons that cut the lamp and receivers between the planes among
it."""

import os
import unittest

import numpy as np

import exr
from model import Geometry, LightField
from program import Judgement

SEED = 20261124
MORE = int(os.environ.get("LUXFIELD_RECEIVERS", "1"))
ROTATION_DEG = (20, -35, 70)
POSITION = np.array([0.3, -0.2, 1.1])
SCALE = 2.5

SCENE = """
[camera]
position = [{camera}]
look_at = [{target}]
up = [0.1, 0.2, 1]
vertical_fov_deg = 60
width = 24
height = 18
[[material]]
name = "grey"
albedo = [0.5, 0.5, 0.5]
{geometry}
[[luminaire]]
file = "lamp.lf.exr"
position = [{position}]
rotate_deg = [{rotation}]
scale = {scale}
"""


def rotation(degrees):
    """World from luminaire: about the world's x axis, then y, then z."""
    x, y, z = np.radians(degrees)
    rx = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    ry = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    rz = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    return rz @ ry @ rx


def lamp(basis, columns, rows, random, channels=3):
    """Coefficients between -0.2 and 1 on an off-centre grid with texels that are not square."""
    g = Geometry(
        delta=0.3,
        basis=basis,
        width=4,
        height=3,
        u0=-0.11,
        v0=-0.06,
        h=0.04,
        s0=-0.45,
        t1=0.36,
        ds=0.9 / columns,
        dt=0.7 / rows,
        columns=columns,
        rows=rows,
    )
    return LightField(
        g,
        random.uniform(-0.2, 1, (3, 4, rows, columns, channels)).astype(np.float32).astype(float)
        * 1e4,
    )


def listed(values):
    return ", ".join(f"{v:.9g}" for v in values)


class Irradiance(Judgement):
    def render(self, field, quads, *options):
        """Position and normal in the luminaire's frame and irradiance of every pixel that hit
        something."""
        field.write(self.folder / "lamp.lf.exr")
        turn = rotation(ROTATION_DEG)
        world = lambda p: turn @ np.asarray(p, float) + POSITION
        geometry = "".join(
            f"[[quad]]\ncorner = [{listed(world(corner))}]\nedge_u = [{listed(turn @ np.asarray(u, float))}]\n"
            f'edge_v = [{listed(turn @ np.asarray(v, float))}]\nmaterial = "grey"\n'
            for corner, u, v in quads
        )
        self.write(
            "scene.toml",
            SCENE.format(
                camera=listed(world((0.9, -1.4, 0.9))),
                target=listed(world((0, 0, 0.6))),
                geometry=geometry,
                position=listed(POSITION),
                rotation=listed(ROTATION_DEG),
                scale=SCALE,
            ),
        )
        self.run_program("render", "scene.toml", "-o", "x.exr", "--shadows", "none", *options)
        picture = exr.read(self.folder / "x.exr")[0]
        planes = {name: plane.astype(float) for name, plane in picture.channels.items()}
        stack = lambda name, axes: np.stack([planes[f"{name}.{a}"].ravel() for a in axes], -1)
        hit = planes["coverage.Y"].ravel() > 0
        positions = (stack("position", "XYZ")[hit] - POSITION) @ turn
        return (
            positions,
            stack("normal", "XYZ")[hit] @ turn,
            stack("irradiance", "RGB")[hit],
            picture,
        )

    # Before the lamp, far off, steeply inclined, and between the planes: corner and edges in the
    # luminaire's frame.
    QUADS = [
        ((-0.8, -0.8, 1.4), (1.6, 0, 0.2), (0, 1.6, 0.3)),
        ((0.03, -0.3, 0.02), (0, 0.6, 0), (0.02, 0, 0.9)),  # its plane passes through the lamp
        ((-0.5, 0.05, 0.01), (1.0, 0, 0.1), (0, 0.03, 0.8)),  # likewise, across v
        ((-0.2, -0.2, 0.16), (0.15, 0, 0.02), (0, 0.4, 0.05)),
    ]  # between the planes

    def judge(self, basis, columns, rows, estimator, receivers, tolerance):
        random = np.random.default_rng(SEED)
        field = lamp(basis, columns, rows, random)
        positions, normals, seen, _ = self.render(field, self.QUADS, "--estimator", estimator)
        chosen = random.choice(len(positions), min(MORE * receivers, len(positions)), replace=False)
        truth = SCALE * np.array([field.irradiance(positions[k], normals[k]) for k in chosen])
        size = np.abs(truth).mean()
        cut = 0
        corners = [
            (u, v)
            for u in field.geometry.knots_u()[[0, -1]]
            for v in field.geometry.knots_v()[[0, -1]]
        ]
        for k in chosen:
            sides = [normals[k] @ (np.array([u, v, 0]) - positions[k]) > 0 for u, v in corners]
            cut += any(sides) and not all(sides)
        self.assertGreater(cut, 5, "horizons that cut the lamp are what this is about")
        error = np.abs(seen[chosen] - truth)
        relative = np.sqrt((error**2).mean()) / size
        print(
            f"{estimator} {basis} {columns}x{rows}: {len(chosen)} receivers, {cut} with cut horizons, "
            f"relative RMSE {relative:.2g}, worst {error.max() / size:.2g} of the mean"
        )
        self.assertLess(relative, tolerance)
        self.assertLess(error.max() / size, 20 * tolerance)

    # Tolerance: positions, normals and sums in float32, whose rounding a horizon through a bright
    # texel multiplies.
    def test_exact(self):
        for basis, columns, rows in [
            ("bspline2", 7, 5),
            ("quadratic", 1, 1),
            ("bilinear", 6, 4),
            ("box", 5, 5),
        ]:
            with self.subTest(basis=basis):
                self.judge(basis, columns, rows, "exact", 25, 1e-4)

    def test_gloss_on_lambert(self):
        self.judge("bspline2", 7, 5, "gloss", 15, 1e-4)

    def test_volume_with_one_texel(self):
        self.judge("bspline2", 1, 1, "volume", 80, 0.004)

    def test_volume(self):
        self.judge("bspline2", 24, 19, "volume", 25, 0.004)

    def test_nothing_behind_the_lamp(self):
        field = lamp("bspline2", 6, 4, np.random.default_rng(SEED))
        quads = [((-0.5, -0.5, -0.3), (1, 0, 0), (0, 1, 0.1))]
        _, _, seen, _ = self.render(field, quads, "--estimator", "exact")
        self.assertEqual(np.abs(seen).max(), 0)

    def test_cells_is_unbiased(self):
        """z-test over seeds: the mean of all receivers' irradiance, and chi-squared of each
        receiver's mean."""
        random = np.random.default_rng(SEED)
        field = lamp("bspline2", 7, 5, random)
        field.c = np.abs(field.c)
        seeds = 16
        pictures = [
            self.render(
                field, self.QUADS, "--estimator", "cells", "--spp", "64", "--seed", str(seed)
            )
            for seed in range(1, seeds + 1)
        ]
        positions, normals, _, _ = pictures[0]
        chosen = random.choice(len(positions), 60, replace=False)
        truth = SCALE * np.array([field.irradiance(positions[k], normals[k]) for k in chosen])[:, 1]
        seen = np.array([picture[2][chosen, 1] for picture in pictures])
        lit = truth > 1e-3 * truth.mean()
        means, errors = seen.mean(0)[lit], seen.std(0, ddof=1)[lit] / np.sqrt(seeds)
        t2 = ((means - truth[lit]) / np.maximum(errors, 1e-5 * truth.mean())) ** 2
        totals = seen[:, lit].sum(1)
        z = (totals.mean() - truth[lit].sum()) / (totals.std(ddof=1) / np.sqrt(seeds))
        print(
            f"cells: z of the sum {z:.2f}, mean t^2 {t2.mean():.2f} ({(seeds - 1) / (seeds - 3):.2f} expected)"
        )
        self.assertLess(abs(z), 4.5)
        self.assertLess(t2.mean(), 3)
        self.assertLess(np.abs(seen[:, truth == 0]).max(initial=0), 1e-6 * truth.mean())


if __name__ == "__main__":
    unittest.main()
