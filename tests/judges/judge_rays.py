"""Ray files to light fields: where the flux goes, and the far field of what was made of it."""

import struct
import unittest

import numpy as np

import model
from model import gauss
from program import Judgement

SEED = 20261127


def write_tm25(path, positions_m, directions, flux_lm):
    """docs/formats/tm25.md: version 2013, luminous flux per ray, nothing else."""
    header = bytearray(256)
    struct.pack_into("<4siiffQ", header, 0, b"TM25", 2013, 0, flux_lm.sum(), np.nan, len(flux_lm))
    struct.pack_into("<ii3f3i", header, 56, 0, 0, np.nan, np.nan, np.nan, 0, 0, 0)
    flags = struct.pack("<8i", 1, 1, 0, 0, 1, 0, 0, 0)
    rows = np.column_stack([1e3 * positions_m, directions, flux_lm]).astype("<f4")
    path.write_bytes(bytes(header) + flags + bytes(9 * 4000) + rows.tobytes())


def disc_rays(count, radius, exponent, random, flux=100.0):
    """Rays of equal flux from a disc in z = 0 of intensity cos^exponent: cos^2 of the angle is a
    power of a uniform number."""
    r, phi = radius * np.sqrt(random.random(count)), 2 * np.pi * random.random(count)
    cosine, turn = random.random(count) ** (1 / (exponent + 1)), 2 * np.pi * random.random(count)
    sine = np.sqrt(1 - cosine**2)
    positions = np.stack([r * np.cos(phi), r * np.sin(phi), np.zeros(count)], -1)
    return (
        positions,
        np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], -1),
        np.full(count, flux / count),
    )


def flux_of_rings(fields, edges):
    """Flux of light fields between angles to the luminaire's z axis: E du ds integrated where the
    ray's angle is in the ring. Rays go from (u, v, 0) to (s, t, delta) in the field's frame."""
    total = np.zeros(len(edges) - 1)
    for field, pose in fields:
        g = field.geometry
        u, wu = gauss(g.knots_u(), 3)
        v, wv = gauss(g.knots_v(), 3)
        s, t = g.texel_centres()
        phi_u, phi_v = g.phi_u(u) * wu, g.phi_v(v) * wv
        axis = pose[2, :3]  # the luminaire's z axis in the field's frame
        for row in range(g.rows):
            e = np.einsum("jv,iu,jic->vuc", phi_v, phi_u, field.c[:, :, row, :, :].mean(-1))
            for part in (-0.25, 0.25):  # a texel is wide: four places in it
                for half in (-0.25, 0.25):
                    x = s[None, None, :] + half * g.ds - u[None, :, None]
                    y = t[row] + part * g.dt - v[:, None, None]
                    cosine = (axis[0] * x + axis[1] * y + axis[2] * g.delta) / np.sqrt(
                        x**2 + y**2 + g.delta**2
                    )
                    ring = np.digitize(np.degrees(np.arccos(cosine)), edges) - 1
                    for k in range(len(total)):
                        total[k] += e[ring == k].sum() / 4 * g.ds * g.dt
    return total


class Rays(Judgement):
    def test_beam_within_the_window(self):
        random = np.random.default_rng(SEED)
        exponent, count = 30, 60000
        rays = disc_rays(count, 0.01, exponent, random)
        write_tm25(self.folder / "lamp.tm25ray", *rays)
        told = self.figures(
            "import",
            "lamp.tm25ray",
            "-o",
            "x.lf.exr",
            "--coverage",
            "0.98",
            "--grid",
            "6",
            "6",
            "--lattice",
            "60",
            "60",
            "--delta",
            "0.3",
        )
        field = model.read_light_field(self.folder / "x.lf.exr")
        self.assertEqual(told["all"]["rays"], count)
        self.assertAlmostEqual(told["all"]["flux"], 100, places=4)
        lost = (
            told["backward"]["flux"]
            + told["missed_filter_plane"]["flux"]
            + told["missed_image_plane"]["flux"]
        )
        self.assertAlmostEqual(told["used"]["flux"] + lost, 100, places=3)
        self.assertGreater(told["used"]["flux"], 97)
        # Every texel keeps its rays' flux: C of the file integrates to what was used.
        self.assertLess(abs(field.flux()[0] / told["used"]["flux"] - 1), 1e-5)
        edges = np.array([0, 4, 8, 12, 16, 20, 25])
        found = flux_of_rings([(field, np.eye(4)[:3])], edges)
        # Closed form: flux within an angle is 1 - cos^(exponent + 1) of all.
        truth = 100 * -np.diff(np.cos(np.radians(edges)) ** (exponent + 1))
        sigma = np.sqrt(truth * 100 / count)
        blur = 0.02 * truth  # spacing and texels, one degree each, move rays by a share of a ring
        print("rings, found over true:", np.round(found / truth, 3))
        self.assertTrue(
            np.all(np.abs(found - truth) < 4.5 * sigma + blur), f"{found} {truth} {sigma}"
        )

    def judge_all_directions(self, rays, edges, truth, share):
        """Flux is kept; a ring is off by at most this share of the lamp's flux."""
        write_tm25(self.folder / "lamp.tm25ray", *rays)
        told = self.figures("import", "lamp.tm25ray", "-o", "x.lf.exr")
        fields = model.read_fields(self.folder / "x.lf.exr")
        flux = sum(field.flux()[0] for field, _ in fields)
        found = flux_of_rings(fields, edges)
        print(f"{len(fields)} fields, flux {flux:.4f} of 100, rings", np.round(found - truth, 2))
        self.assertLess(abs(flux - 100), 1e-3)
        self.assertAlmostEqual(told["used"]["flux"], 100, places=3)
        sigma = np.sqrt(truth * 100 / len(rays[2]))
        self.assertTrue(
            np.all(np.abs(found - truth) < share * 100 + 4.5 * sigma), f"{found} {truth}"
        )

    def test_lambertian_disc_to_the_horizon(self):
        """A disc's flux within an angle is sin^2 of it: all light counts, grazing light too."""
        random = np.random.default_rng(SEED)
        edges = np.array([0, 20, 40, 60, 75, 90])
        truth = 100 * np.diff(np.sin(np.radians(edges)) ** 2)
        self.judge_all_directions(disc_rays(30000, 0.002, 1, random), edges, truth, 0.015)

    def test_ball_that_shines_everywhere(self):
        """A Lambertian ball: its flux within an angle to any axis is (1 - cos) / 2."""
        random = np.random.default_rng(SEED + 1)
        count = 30000
        normals = random.normal(size=(count, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        # A cosine about the normal: the sum of the normal and a uniform direction, made a unit.
        uniform = random.normal(size=(count, 3))
        directions = normals + uniform / np.linalg.norm(uniform, axis=1)[:, None]
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        rays = 0.003 * normals, directions, np.full(count, 100 / count)
        edges = np.arange(0, 181, 30)
        truth = -50 * np.diff(np.cos(np.radians(edges)))
        self.judge_all_directions(rays, edges, truth, 0.015)


if __name__ == "__main__":
    unittest.main()
