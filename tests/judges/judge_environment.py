"""Sums over environment maps of every layout, and over the sky that the program makes."""

import datetime
import unittest

import numpy as np

import exr
from program import Judgement

SEED = 20261126
WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


def pixel_grid(width, height, samples):
    """Picture coordinates a (right) and b (up) in [-1, 1] of samples x samples points in every
    pixel, and their area."""
    x = 2 * (np.arange(width * samples) + 0.5) / (width * samples) - 1
    y = 1 - 2 * (np.arange(height * samples) + 0.5) / (height * samples)
    a, b = np.meshgrid(x, y)
    return a, b, 1.0 / (width * height * samples**2)


def directions(layout, a, b):
    """World directions (3, ...) and solid angle per picture area (the whole picture is 1), of
    docs/formats/environment.md:
    a viewer looks along -y with -x at the right hand and +z overhead."""
    r = np.sqrt(a**2 + b**2)
    inside = r < 1
    unit_right, unit_up = a / np.where(r > 0, r, 1), b / np.where(r > 0, r, 1)

    def around(axis, right, up, angle):
        return (
            np.multiply.outer(axis, np.cos(angle))
            + np.multiply.outer(right, np.sin(angle) * unit_right)
            + np.multiply.outer(up, np.sin(angle) * unit_up)
        )

    x, y, z = np.eye(3)
    if layout == "latitude-longitude":
        theta, phi = (1 - b) * np.pi / 2, -a * np.pi
        return (
            np.stack([np.sin(theta) * np.sin(phi), -np.sin(theta) * np.cos(phi), np.cos(theta)]),
            2 * np.pi**2 * np.sin(theta),
        )
    with np.errstate(divide="ignore", invalid="ignore"):
        if layout == "angular-map":
            return around(-y, -x, z, np.pi * r), np.where(
                inside, 4 * np.pi * np.sin(np.pi * r) / r, 0
            )
        if layout == "mirror-ball":
            # A ball seen from far away: its normal has angle asin r to the viewer at +y, the ray
            # leaves at twice that.
            return around(y, -x, z, 2 * np.arcsin(np.minimum(r, 1))), np.where(inside, 16.0, 0)
        if layout == "fisheye-hemisphere":
            return around(z, -x, y, np.pi * r / 2), np.where(
                inside, 2 * np.pi * np.sin(np.pi * r / 2) / r, 0
            )
    raise ValueError(layout)


def sums(layout, pixels, samples=12):
    """Mean radiance over the sphere, and irradiance facing up and down, per channel."""
    height, width = pixels.shape[:2]
    a, b, area = pixel_grid(width, height, samples)
    w, per_area = directions(layout, a, b)
    d = np.repeat(np.repeat(pixels, samples, 0), samples, 1)
    steradian = per_area * area
    return (
        (steradian[..., None] * d).sum((0, 1)) / (4 * np.pi),
        ((steradian * np.maximum(w[2], 0))[..., None] * d).sum((0, 1)),
        ((steradian * np.maximum(-w[2], 0))[..., None] * d).sum((0, 1)),
    )


def smooth_map(layout, width, height, random):
    """exp of a random quadratic form of the direction, in each channel: brighter by large factors
    to some sides."""
    a, b, _ = pixel_grid(width, height, 1)
    w, _ = directions(layout, a, b)
    w = np.nan_to_num(w)
    form, line = random.normal(0, 0.7, (3, 3, 3)), random.normal(0, 0.7, (3, 3))
    return np.exp(np.einsum("cij,iyx,jyx->yxc", form, w, w) + np.einsum("ci,iyx->yxc", line, w))


def write_hdr(path, pixels):
    """A Radiance picture, plain scan lines; returns the radiance that its bytes mean, (mantissa +
    1/2) / 256 2^(E - 128)."""
    _, exponent = np.frexp(pixels.max(-1))
    mantissa = np.floor(np.ldexp(pixels, (8 - exponent)[..., None])).clip(0, 255)
    bytes_ = np.concatenate([mantissa, (exponent + 128)[..., None]], -1).astype(np.uint8)
    height, width = pixels.shape[:2]
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nPRIMARIES=0.640 0.330 0.300 0.600 0.150 0.060 0.3127 0.3290\n\n-Y {height} +X {width}\n"
    path.write_bytes(header.encode() + bytes_.tobytes())
    return np.ldexp(mantissa + 0.5, (exponent - 8)[..., None])


class Environment(Judgement):
    def test_sums_of_layouts(self):
        random = np.random.default_rng(SEED)
        for layout, size in [
            ("latitude-longitude", (96, 48)),
            ("angular-map", (64, 64)),
            ("mirror-ball", (64, 64)),
            ("fisheye-hemisphere", (64, 64)),
        ]:
            with self.subTest(layout=layout):
                pixels = smooth_map(layout, *size, random)
                pixels = write_hdr(self.folder / "map.hdr", pixels)
                told = self.figures("info", "map.hdr", "--layout", layout)
                mean, up, down = sums(layout, pixels)
                print(
                    layout,
                    [
                        f"{max(abs(np.array(told[k]) / v - 1)):.1e}"
                        for k, v in [("mean_radiance", mean), ("irradiance_up", up)]
                    ],
                )
                # Pixels that the horizon or the rim cuts are shared by cube map and picture in
                # other ways: of a map that is
                # smooth that is of second order in the pixel, some (pi / 64)^2.
                np.testing.assert_allclose(told["mean_radiance"], mean, rtol=2e-3)
                np.testing.assert_allclose(told["irradiance_up"], up, rtol=3e-3)
                if layout != "fisheye-hemisphere":
                    np.testing.assert_allclose(told["irradiance_down"], down, rtol=3e-3)

    def test_light_on_a_floor(self):
        """A white floor under a bright, structured map: radiance = albedo / pi times the map's
        sum, within its noise."""
        random = np.random.default_rng(SEED)
        pixels = np.exp(random.normal(0, 1, (24, 48, 3)))
        pixels[5, 30] *= 2000
        exr.write(
            self.folder / "map.exr",
            [exr.Part("", {n: pixels[..., k].astype(np.float32) for k, n in enumerate("RGB")})],
        )
        self.write(
            "scene.toml",
            """
[camera]
position = [0, -3, 2]
look_at = [0, 0, 0]
width = 16
height = 12
[[material]]
name = "floor"
albedo = [0.6, 0.6, 0.6]
[[quad]]
corner = [-100, -100, 0]
edge_u = [200, 0, 0]
edge_v = [0, 200, 0]
material = "floor"
[environment]
file = "map.exr"
layout = "latitude-longitude"
""",
        )
        seeds = 8
        means = []
        for seed in range(1, seeds + 1):
            self.run_program("render", "scene.toml", "-o", "x.exr", "--spp", "512", "--seed", seed)
            channels = exr.read(self.folder / "x.exr")[0].channels
            lit = channels["coverage.Y"] > 0
            means.append([channels[c][lit].mean() for c in "RGB"])
        _, up, _ = sums("latitude-longitude", pixels.astype(np.float32).astype(float))
        ratio = np.array(means) / (0.6 / np.pi * up)
        z = (ratio.mean(0) - 1) / (ratio.std(0, ddof=1) / np.sqrt(seeds))
        print("floor under a map:", ratio.mean(0), "z", z)
        # Up to the sun's texel, which the cube map spreads over its neighbours: their cosine
        # differs by some 0.1 %.
        self.assertTrue(
            np.all(
                np.abs(ratio.mean(0) - 1) < np.maximum(4.5 * np.abs((ratio.mean(0) - 1) / z), 3e-3)
            )
        )


class Sky(Judgement):
    def sky(
        self, height, *options, date="2024-06-21", time="09:00", latitude=48.14, longitude=11.58
    ):
        told = self.figures(
            "sky",
            "-o",
            "sky.exr",
            "--latitude",
            latitude,
            "--longitude",
            longitude,
            "--date",
            date,
            "--time",
            time,
            "--height",
            height,
            *options,
        )
        channels = exr.read(self.folder / "sky.exr")[0].channels
        return told, np.stack([channels[c] for c in "RGB"], -1).astype(float)

    def test_sum_of_the_picture(self):
        """The picture's own sum is the illuminance that is printed, sun and sky."""
        for turbidity, time in [("2", "09:00"), ("3", "04:30"), ("6", "15:00"), ("10", "12:00")]:
            with self.subTest(turbidity=turbidity):
                told, pixels = self.sky(384, "--turbidity", turbidity, time=time)
                _, up, _ = sums("latitude-longitude", pixels, 2)
                error = up @ WEIGHTS / told["global_horizontal_lx"] - 1
                print(
                    f"turbidity {turbidity}, sun at {told['sun_elevation_deg']:.1f} degrees: sum of the picture {100 * error:+.2f} %"
                )
                self.assertLess(
                    abs(error), 0.01
                )  # the sun's pixel, 0.47 degrees, is taken at its middle
                beam = told["direct_normal_lx"] * np.sin(np.radians(told["sun_elevation_deg"]))
                self.assertAlmostEqual(
                    (told["diffuse_horizontal_lx"] + beam) / told["global_horizontal_lx"],
                    1,
                    places=3,
                )

    def test_place_of_the_sun(self):
        """Against the Sun's coordinates of Meeus, Astronomical Algorithms (1998), chapters 12, 13,
        16 and 25, 0.01 degrees."""
        random = np.random.default_rng(SEED)
        worst = 0
        for _ in range(12):
            when = datetime.datetime(1960, 1, 1) + datetime.timedelta(
                minutes=int(random.integers(0, 80 * 525960))
            )
            latitude, longitude = random.uniform(-65, 65), random.uniform(-180, 180)
            altitude, azimuth = sun_place(when, latitude, longitude)
            if altitude < 3:
                continue
            told, _ = self.sky(
                32,
                date=when.strftime("%Y-%m-%d"),
                time=when.strftime("%H:%M"),
                latitude=latitude,
                longitude=longitude,
            )
            a, b = np.radians([altitude, told["sun_elevation_deg"]])
            turn = np.radians(azimuth - told["sun_azimuth_deg"])
            apart = np.degrees(
                2
                * np.arcsin(
                    np.sqrt(
                        np.sin((a - b) / 2) ** 2 + np.cos(a) * np.cos(b) * np.sin(turn / 2) ** 2
                    )
                )
            )
            worst = max(worst, apart)
            self.assertLess(
                apart, 0.013, f"{when} {latitude} {longitude}"
            )  # 0.01 of either side, rms
        print(f"sun's place: worst {worst:.4f} degrees apart")
        self.assertGreater(worst, 0)


def sun_place(when, latitude, longitude):
    """Apparent altitude (refraction by Saemundsson, as Meeus 16.4 gives it) and azimuth from north
    over east, degrees."""
    days = (when - datetime.datetime(2000, 1, 1, 12)).total_seconds() / 86400
    seconds_dynamical = (
        64.0  # dynamical less universal time: 30 to 75 s in these years, 0.0005 degrees at most
    )
    t = (days + seconds_dynamical / 86400) / 36525
    mean = 280.46646 + 36000.76983 * t + 0.0003032 * t**2
    m = np.radians(357.52911 + 35999.05029 * t - 0.0001537 * t**2)
    centre = (
        (1.914602 - 0.004817 * t) * np.sin(m)
        + (0.019993 - 0.000101 * t) * np.sin(2 * m)
        + 0.000289 * np.sin(3 * m)
    )
    node = np.radians(125.04 - 1934.136 * t)
    lam = np.radians(mean + centre - 0.00569 - 0.00478 * np.sin(node))
    obliquity = np.radians(23.4392911 - 0.0130042 * t + 0.00256 * np.cos(node))
    declination = np.arcsin(np.sin(obliquity) * np.sin(lam))
    right_ascension = np.arctan2(np.cos(obliquity) * np.sin(lam), np.cos(lam))
    sidereal = 280.46061837 + 360.98564736629 * days + 0.000387933 * (days / 36525) ** 2
    sidereal += -0.00478 * np.sin(node) * np.cos(obliquity)
    hour = np.radians(sidereal + longitude) - right_ascension
    phi = np.radians(latitude)
    altitude = np.degrees(
        np.arcsin(
            np.sin(phi) * np.sin(declination) + np.cos(phi) * np.cos(declination) * np.cos(hour)
        )
    )
    azimuth = (
        np.degrees(
            np.arctan2(np.sin(hour), np.cos(hour) * np.sin(phi) - np.tan(declination) * np.cos(phi))
        )
        + 180
    )
    parallax = 8.794 / 3600 * np.cos(np.radians(altitude))
    altitude -= parallax
    refraction = (
        1.02 / np.tan(np.radians(altitude + 10.3 / (altitude + 5.11))) / 60 + 0.0019279 / 60
    )
    return altitude + refraction, azimuth


if __name__ == "__main__":
    unittest.main()
