"""Photographs: a stack of pictures with a tone curve merged to radiance, and a mirroring ball
unrolled."""

import struct
import unittest
import zlib

import numpy as np

import exr
from program import Judgement

SEED = 20261128


def write_png(path, pixels):
    """8-bit RGB without filters."""
    height, width = pixels.shape[:2]
    rows = b"".join(b"\0" + pixels[y].tobytes() for y in range(height))

    def chunk(kind, body):
        return (
            struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        )

    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(rows, 1))
        + chunk(b"IEND", b"")
    )


def smooth_scene(width, height, random):
    """Radiance over four decades, smooth over pixels, in three channels."""
    y, x = np.mgrid[0:height, 0:width] / max(width, height)
    scene = np.empty((height, width, 3))
    for k in range(3):
        waves = sum(
            random.normal() * np.sin(2 * np.pi * (fx * x + fy * y) + random.uniform(0, 6))
            for fx, fy in random.uniform(-2.5, 2.5, (6, 2))
        )
        waves = (waves - waves.min()) / np.ptp(waves)
        scene[..., k] = 10 ** (4 * waves - 2)
    return scene


class Stack(Judgement):
    EXPOSURES = [0.0625 * 2.1**k for k in range(12)]

    def test_grainy_pictures(self):
        """An S-shaped curve and grain of 7 %: as scans of film. Every pixel that any picture shows
        well has a value, and
        values differ from the truth as sigma says."""
        random = np.random.default_rng(SEED)
        scene = smooth_scene(180, 140, random)
        names = []
        for k, exposure in enumerate(self.EXPOSURES):
            x = scene * exposure * np.exp(random.normal(0, 0.07, scene.shape))
            code = 255 * x**0.8 / (x**0.8 + 1) * 1.25  # clips at 255
            names.append(f"p{k:02d}.png")
            write_png(self.folder / names[-1], np.clip(np.round(code), 0, 255).astype(np.uint8))
        times = ",".join(f"{e:.9g}" for e in self.EXPOSURES)
        self.run_program("calibrate", "response", *names, "-o", "c.cal.json", "--exposure", times)
        self.run_program(
            "merge", *names, "-o", "x.exr", "--calibration", "c.cal.json", "--exposure", times
        )
        channels = exr.read(self.folder / "x.exr")[0].channels
        for k, name in enumerate("RGB"):
            with self.subTest(channel=name):
                value, mask = channels[name].astype(float), channels[f"mask.{name}"]
                sigma = channels[f"sigma.{name}"].astype(float)
                # Well shown: a code from 25 to 230 in at least one picture.
                mean_codes = [
                    318.75 * (scene[..., k] * e) ** 0.8 / ((scene[..., k] * e) ** 0.8 + 1)
                    for e in self.EXPOSURES
                ]
                shown = np.any([(c > 25) & (c < 230) for c in mean_codes], 0)
                good = (mask == 0) & (value > 0)
                print(
                    f"{name}: {shown.mean():.1%} are shown well, {(good & shown).sum() / shown.sum():.1%} of them have a "
                    f"value",
                    end="",
                )
                self.assertGreater((good & shown).sum() / shown.sum(), 0.99)
                ratio = np.log2(value[good] / scene[..., k][good])
                ratio -= np.median(ratio)  # the reference code's gauge
                pulls = ratio * np.log(2) * value[good] / sigma[good]
                print(
                    f"; {np.abs(ratio).mean():.3f} stop mean error, pull^2 {np.median(pulls**2) / 0.455:.2f} by the median"
                )
                self.assertLess(np.abs(ratio).mean(), 0.08)
                self.assertLess(np.median(pulls**2) / 0.455, 1.6)
                self.assertGreater(np.median(pulls**2) / 0.455, 0.4)
                self.assertTrue(
                    np.all(value[mask == 4] != 0) and np.all(value[mask == 2] != 0),
                    "flagged pixels hold an estimate",
                )
                self.assertTrue(np.all(sigma[mask != 0] > 0))


BALL = """
[probe]
kind = "mirror-ball"
azimuth_deg = 30
elevation_deg = 0
unit = "cd/m2"
[camera]
gain_dn_per_e = 1
saturation_dn = 60000
[[exposure]]
file = "short.exr"
exposure_s = 0.001
[[exposure]]
file = "long.exr"
exposure_s = 0.03
"""


class Ball(Judgement):
    def test_ball_in_a_world(self):
        """A ball photographed from far away in a smooth world; the map shows that world."""
        random = np.random.default_rng(SEED)
        size, radius = 220, 83.4
        centre = np.array([108.3, 113.8])
        form, line = random.normal(0, 0.5, (3, 3)), random.normal(0, 0.5, 3)
        world = lambda w: 3e5 * np.exp(
            np.einsum("ij,i...,j...->...", form, w, w) + np.einsum("i,i...->...", line, w)
        )
        sub = (np.arange(size * 3) + 0.5) / 3
        x, y = np.meshgrid((sub - centre[0]) / radius, (centre[1] - sub) / radius)
        # Camera frame: looks along `forward`, azimuth from north (+y) over east (+x).
        azimuth = np.radians(30)
        forward = np.array([np.sin(azimuth), np.cos(azimuth), 0])
        right, up = np.array([np.cos(azimuth), -np.sin(azimuth), 0]), np.array([0, 0, 1.0])
        r2 = x**2 + y**2
        n = np.sqrt(np.maximum(0, 1 - r2))
        normal = (
            np.multiply.outer(right, x) + np.multiply.outer(up, y) - np.multiply.outer(forward, n)
        )
        away = forward[:, None, None] + 2 * n * normal  # d - 2 (d.n) n
        picture = np.where(r2 < 1, world(away), 2e5 * 0.2)
        picture = picture.reshape(size, 3, size, 3).mean((1, 3))
        for name, exposure in [("short", 0.001), ("long", 0.03)]:
            electrons = random.poisson(np.maximum(picture * exposure, 0))
            frame = np.minimum(electrons, 60000).astype(np.float32)
            exr.write(self.folder / f"{name}.exr", [exr.Part("", {c: frame for c in "RGB"})])
        self.write("probe.toml", BALL)
        self.run_program("probe", "probe.toml", "-o", "map.exr")
        channels = exr.read(self.folder / "map.exr")[0].channels
        seen, covered = channels["G"].astype(float), channels["coverage.Y"] > 0.999
        faces = seen.shape[0] // 6
        # Faces from top to bottom +x, -x, +z, -z, -y, +y, seen from inside: (outward, right, up).
        axes = {
            "+x": ((1, 0, 0), (0, -1, 0), (0, 0, 1)),
            "-x": ((-1, 0, 0), (0, 1, 0), (0, 0, 1)),
            "+z": ((0, 0, 1), (1, 0, 0), (0, -1, 0)),
            "-z": ((0, 0, -1), (1, 0, 0), (0, 1, 0)),
            "-y": ((0, -1, 0), (-1, 0, 0), (0, 0, 1)),
            "+y": ((0, 1, 0), (1, 0, 0), (0, 0, 1)),
        }
        a = 2 * (np.arange(faces) + 0.5) / faces - 1
        right_a, up_a = np.meshgrid(a, -a)
        errors, turned = [], []
        for k, (out, to_right, to_up) in enumerate(axes.values()):
            w = (
                np.multiply.outer(np.array(out, float), np.ones_like(right_a))
                + np.multiply.outer(np.array(to_right, float), right_a)
                + np.multiply.outer(np.array(to_up, float), up_a)
            )
            w /= np.linalg.norm(w, axis=0)
            # Towards the rim, r > 0.9, a pixel spans tens of degrees.
            near = np.einsum("i,i...->...", -forward, w) > np.cos(2 * np.arcsin(0.9))
            face, good = (
                seen[k * faces : (k + 1) * faces],
                covered[k * faces : (k + 1) * faces] & near,
            )
            errors.append((face[good] / world(w)[good] - 1))
            turned.append((face[good] / world(w * np.array([-1, 1, 1])[:, None, None])[good] - 1))
        rms, wrong = np.sqrt(np.mean(np.concatenate(errors) ** 2)), np.sqrt(
            np.mean(np.concatenate(turned) ** 2)
        )
        print(
            f"ball: map against its world {rms:.2%} rms, mirrored {wrong:.0%}; {covered.mean():.1%} covered"
        )
        self.assertLess(rms, 0.03)
        self.assertGreater(wrong, 0.15)
        self.assertGreater(covered.mean(), 0.85)


if __name__ == "__main__":
    unittest.main()
