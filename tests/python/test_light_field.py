"""LightField and Sampler against closed forms and quadrature in numpy."""

import os
import subprocess
import sys

import numpy as np
import pytest

import luxfield

DOWN = [0, 0, -1]


def test_irradiance_of_a_square_on_its_axis(lambertian):
    """E = L sum over the square of cos cos / r^2, for a square of half side a at distance d in closed form:
    E = 4 L (x / sqrt(1 + x^2)) atan(x / sqrt(1 + x^2)),  x = a / d  (each half of the two-term sum is the same)."""
    a = 0.03
    for d in (0.5, 2.0, 10.0):
        x = a / d
        q = x / np.sqrt(1 + x * x)
        expected = 4 * 1000 * q * np.arctan(q)
        found = lambertian.irradiance([0, 0, d], DOWN)[0]
        # C is one value in a knot cell where cos^4 varies by up to a few 1e-3.
        assert found == pytest.approx(expected, rel=3e-3), d


def test_radiance_is_the_function_that_it_was_made_from(lambertian):
    u = np.array([[-0.0225, 0.0075], [0.0, 0.0], [0.02, -0.02]])
    s = np.array([[-0.5, 0.3], [0.01, 0.01], [0.7, 0.7]])
    assert lambertian.radiance(u, s)[:, 0] == pytest.approx(np.full(3, 1000), rel=0.03)
    assert lambertian.radiance([0.05, 0], [0, 0])[0] == 0
    assert lambertian.radiance(u[:, None], s[None]).shape == (3, 3, 1)


def test_intensity_flux_and_light_vector_agree_by_quadrature(lambertian):
    """Flux is the integral of intensity, and far away the light vector is intensity / r^2."""
    place, weight = np.polynomial.legendre.leggauss(200)
    x, y = np.meshgrid(2.2 * place, 2.2 * place)  # tan of the angles; I ends at 2
    d = np.stack([x, y, np.ones_like(x)], axis=-1)
    solid = (2.2 * weight)[:, None] * (2.2 * weight) / (1 + x * x + y * y) ** 1.5
    assert (lambertian.intensity(d)[..., 0] * solid).sum() == pytest.approx(lambertian.flux[0], rel=2e-3)
    r = 500.0
    w = np.array([0.3, -0.2, 1.0])
    w /= np.linalg.norm(w)
    J = lambertian.light_vector(r * w)
    assert J.shape == (1, 3)
    assert -J[0] @ w == pytest.approx(lambertian.intensity(w)[0] / r**2, rel=1e-3)


def test_shapes_broadcast_and_normals_need_no_length(lambertian):
    points = np.array([[[0, 0, 1.0]], [[0.1, 0, 2.0]]])
    both = lambertian.irradiance(points, [[0, 0, -3.0], [0, 1, -1]])
    assert both.shape == (2, 2, 1)
    assert both[1, 0, 0] == lambertian.irradiance([0.1, 0, 2.0], DOWN)[0]


@pytest.mark.parametrize("points, normals, words", [
    ([0, 0], DOWN, r"points has shape \(2\); its last axis has to hold 3"),
    ([[0, 0, 1.0]] * 2, [DOWN] * 3, r"shapes do not go together: points \(2, 3\), normals \(3, 3\)"),
    ([0, 0, 1.0], [0, 0, 0], "normals 0 is .* which has no direction"),
    ("lamp", DOWN, "points is not an array of numbers"),
])
def test_arguments_that_make_no_sense_are_named(lambertian, points, normals, words):
    with pytest.raises(ValueError, match=words):
        lambertian.irradiance(points, normals)


def test_coefficients_are_the_objects_own_memory(tmp_path):
    C = np.ones((1, 1, 2, 2), np.float32)
    field = luxfield.LightField(C, grid=(1, 1), spacing_m=0.1, delta_m=1, texel_m=0.5, basis="box")
    view = field.C
    assert view.__array_interface__["data"] == field.C.__array_interface__["data"]
    flux = field.flux[0]
    view *= 2
    assert field.flux[0] == pytest.approx(2 * flux)
    del field
    assert (view == 2).all()  # which the array keeps alive


def test_written_and_read_again_is_the_same(lambertian, tmp_path):
    lambertian.write(tmp_path / "a.lf.exr")
    again = luxfield.read(tmp_path / "a.lf.exr")
    again.write(tmp_path / "b.lf.exr")
    assert (tmp_path / "a.lf.exr").read_bytes() == (tmp_path / "b.lf.exr").read_bytes()
    assert np.array_equal(again.C, lambertian.C)
    for name in ("grid", "spacing_m", "corner_m", "basis", "delta_m", "texel_m", "top_left_m", "unit"):
        assert getattr(again, name) == getattr(lambertian, name), name


def test_pipes_and_devices_are_not_replaced(lambertian, tmp_path):
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "full").symlink_to("/dev/full")
    for name in ("fifo", "full", "."):
        with pytest.raises(luxfield.InputError, match="is no file that can be replaced|is a folder"):
            lambertian.write(tmp_path / name)
    assert (tmp_path / "fifo").is_fifo() and (tmp_path / "full").is_symlink() and len(os.listdir(tmp_path)) == 2


def test_constructor_names_what_is_wrong():
    make = dict(grid=(2, 1), spacing_m=0.1, delta_m=1, texel_m=0.5)
    with pytest.raises(ValueError, match="C has 2 axes; it needs four"):
        luxfield.LightField(np.ones((2, 2), np.float32), **make)
    with pytest.raises(ValueError, match="C has 3 images, a grid of 2 x 1 needs 2"):
        luxfield.LightField(np.ones((3, 1, 2, 2), np.float32), **make)
    with pytest.raises(ValueError, match="not finite"):
        luxfield.LightField(np.full((2, 1, 2, 2), np.nan, np.float32), **make)
    with pytest.raises(luxfield.InputError, match="delta"):
        luxfield.LightField(np.ones((2, 1, 2, 2), np.float32), **{**make, "delta_m": -1})


def test_a_large_field_passes_without_a_second_copy(tmp_path):
    """Peak memory of reading 100 MB and looking at every value grows by less than 1.5 times that."""
    images = np.ones((100, 1, 512, 512), np.float32)
    luxfield.LightField(images, grid=(10, 10), spacing_m=0.01, delta_m=1, texel_m=0.002).write(tmp_path / "x.lf.exr")
    script = ("import re, sys, luxfield\n"
              "peak = lambda: 1024 * int(re.search(r'VmHWM:\\s+(\\d+)', open('/proc/self/status').read())[1])\n"
              "before = peak(); C = luxfield.read(sys.argv[1]).C; assert C.min() == C.max() == 1\n"
              "print((peak() - before) / C.nbytes)")
    run = subprocess.run([sys.executable, "-c", script, tmp_path / "x.lf.exr"], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert 0.9 < float(run.stdout) < 1.5


def test_sampler_is_unbiased_and_its_pdf_is_a_density(lambertian, seed):
    sampler = luxfield.Sampler(lambertian)
    random = np.random.default_rng(seed)
    point, normal = [0.2, -0.1, 0.8], [0.1, 0.2, -1]
    drawn = sampler.sample(point, normal, random.random((40000, 2)))
    weight = drawn["weight"][:, 0]
    z = (weight.mean() - lambertian.irradiance(point, normal)[0]) / (weight.std() / np.sqrt(weight.size))
    assert abs(z) < 4.5
    # The densities of samples, asked for again; and 1 / pdf averages to the solid angle that is lit.
    assert sampler.pdf(point, normal, drawn["direction"]) == pytest.approx(drawn["pdf"], rel=1e-9)
    at = np.asarray(point) + drawn["distance_m"][:, None] * drawn["direction"]
    assert at[:, :2] == pytest.approx(drawn["u"], abs=1e-9)
    inside = np.abs(drawn["u"]).max(axis=1) < 0.0299
    arriving = sampler.radiance(point, drawn["direction"])[inside, 0]
    assert arriving == pytest.approx(drawn["radiance"][inside, 0], rel=1e-6)
    x, y = np.meshgrid(*[(np.arange(400) + 0.5) / 400 * 0.06 - 0.03] * 2)
    d = np.stack([x - point[0], y - point[1], np.full_like(x, -point[2])], axis=-1)
    r = np.linalg.norm(d, axis=-1)
    solid = point[2] / r**3 * (0.06 / 400) ** 2
    assert (sampler.pdf(point, normal, d) * solid).sum() == pytest.approx(1, rel=2e-3)


def test_receivers_without_light_get_samples_of_density_0(lambertian):
    drawn = luxfield.Sampler(lambertian).sample([0, 0, 1.0], [0, 0, 1], [0.5, 0.5])
    assert drawn["pdf"] == 0 and drawn["weight"][0] == 0


def test_drawings_have_units(lambertian):
    assert "cd" in lambertian.plot_intensity().get_ylabel()
    figure = lambertian.plot().figure
    assert any("sr⁻¹ m⁻⁴" in axes.get_ylabel() for axes in figure.axes)


def test_threads_do_not_change_numbers(lambertian):
    points = np.random.default_rng(3).random((300, 3)) + [0, 0, 0.5]
    luxfield.set_threads(1)
    one = lambertian.irradiance(points, DOWN)
    luxfield.set_threads(0)
    assert np.array_equal(one, lambertian.irradiance(points, DOWN))

def test_lengths_that_seem_to_be_in_millimetres_are_warned_of(tmp_path):
    with pytest.warns(luxfield.LuxfieldWarning, match="delta_m = 50 m.*metres") as warned:
        field = luxfield.LightField(np.ones((1, 1, 2, 2), np.float32), grid=(1, 1), spacing_m=0.01, delta_m=50, texel_m=0.01)
    assert warned[0].filename == __file__
    field.write(tmp_path / "far.lf.exr")
    with pytest.warns(luxfield.LuxfieldWarning, match="far.lf.exr") as warned:
        luxfield.read(tmp_path / "far.lf.exr")
    assert warned[0].filename == __file__
