"""The verbs as functions: the same bytes as on the command line, errors and warnings as Python's."""

import inspect
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
import pytest

import luxfield
from luxfield import process, toml, verbs


def command_line(*arguments):
    subprocess.run([process.program(), *map(str, arguments), "--quiet"], check=True, capture_output=True)


def test_the_chain_gives_the_command_lines_bytes(small, tmp_path):
    command_line("merge", small["session"], "-o", tmp_path / "x.meas.exr", "--lamp-level", "monitor")
    command_line("reconstruct", tmp_path / "x.meas.exr", "-o", tmp_path / "x.lf.exr")
    assert (tmp_path / "x.meas.exr").read_bytes() == small["measured"].output.read_bytes()
    assert (tmp_path / "x.lf.exr").read_bytes() == small["solved"].output.read_bytes()


def test_results_hold_data_figures_and_text(small):
    assert small["captured"].output == small["session"]
    measured, solved = small["measured"].value, small["solved"]
    assert measured.grid == (5, 4) and measured.unit == "lm" and measured.delta_m == 0.3
    E, sigma = measured.irradiance(2, 1), measured.sigma(2, 1)
    assert E.shape == sigma.shape == (1, 32, 32) and (sigma[measured.mask(2, 1)[None] == 0] > 0).all()
    assert measured.count(2, 1).shape == (32, 32)
    assert np.hypot(*measured.displacement_m(0, 0)) < 1e-3
    with pytest.raises(IndexError, match=r"\(5, 0\) is beside the grid of 5 x 4"):
        measured.mask(5, 0)
    assert not E.flags.writeable
    assert isinstance(solved.value, luxfield.LightField)
    assert solved.sigma.C.shape == solved.value.C.shape and (solved.sigma.C >= 0).all()
    assert "coefficient images" in repr(solved) and solved.figures
    with pytest.raises(AttributeError, match="the result has no 'colour'; it has "):
        solved.colour
    # What the capture's errors leave of the flux: well within a per cent.
    assert solved.value.flux == pytest.approx(small["truth"].value.flux, rel=0.01)
    assert luxfield.compare(solved, small["truth"]).rel_rmse < 0.3


def test_verbs_that_read(small):
    assert luxfield.info(small["solved"]).figures["kind"] == "light field"
    assert luxfield.verify(small["session"]).figures
    report = luxfield.report(small["session"])
    assert report.output.read_text().lower().startswith("<!doctype html>")
    budget = luxfield.budget(small["session"], at=(0, 0, 3))
    assert "irradiance" in budget.text and luxfield.plan(small["plan"], lab=small["lab"]).figures
    assert luxfield.preprocess(small["solved"]).output.stat().st_size > 0


def test_photometry_takes_dicts_and_the_results_own_sigma(small, tmp_path):
    asked = {"point": [{"name": "desk", "position_m": [0.1, 0, 2]}], "certificate": {"lamp": "small"}}
    found = luxfield.photometry(small["solved"], ask=asked)
    assert found.flux_lm == pytest.approx(small["solved"].value.flux[0], rel=1e-5) and found.flux_lm_u > 0
    assert found.points[0]["name"] == "desk" and found.points[0]["illuminance_lx_u"] > 0
    assert luxfield.photometry(small["solved"].value).flux_lm_u is None
    by_hand = luxfield.photometry(small["solved"].value, sigma=small["solved"].sigma)
    assert by_hand.flux_lm_u == pytest.approx(found.flux_lm_u, rel=1e-6)
    pdf = luxfield.photometry(small["solved"], ask=asked, output=tmp_path / "x.pdf")
    assert pdf.output.read_bytes().startswith(b"%PDF-")
    with pytest.raises(luxfield.InputError, match="un-r1.*names no file"):
        luxfield.photometry(small["solved"], ask={"headlamp": [{"regulation": "un-r1"}]})
    both = luxfield.compare(small["solved"], small["truth"], sigma_a=small["solved"].sigma)
    assert both.photometry["quantities"][0]["name"] == "flux"
    assert luxfield.export(small["solved"], tmp_path / "x.ldt").output.stat().st_size > 0


SCENE = {
    "camera": {"position": [0, -3, 1.5], "look_at": [0, 3, 0.0], "width": 64, "height": 48},
    "material": [{"name": "floor", "albedo": [0.6, 0.5, 0.4]}],
    "quad": [{"corner": [-5, -5, 0], "edge_u": [10, 0, 0], "edge_v": [0, 10, 0], "material": "floor"}],
}


def lit_by(**luminaire):
    return {**SCENE, "luminaire": [{"name": "lamp", "position": [0, 0, 1], "look_at": [0, 3, 0.2], **luminaire}]}


def test_a_scene_built_in_code_is_lit(small, tmp_path):
    lamp = small["solved"].value
    picture = luxfield.render(lit_by(file=lamp), estimator="exact", shadows="none").value
    assert picture.pixels.shape == (3, 48, 64)
    # Every pixel's irradiance by the lamp's closed form, in the luminaire's frame: z ahead, y up, x to the right.
    P = np.stack([picture[f"position.{c}"] for c in "XYZ"], axis=-1)
    N = np.stack([picture[f"normal.{c}"] for c in "XYZ"], axis=-1)
    z = np.array([0, 3, -0.8]) / np.hypot(3, 0.8)
    x = np.cross([0, 0, 1], z)
    x /= np.linalg.norm(x)
    luminaire_from_world = np.stack([x, np.cross(z, x), z])
    ground = picture["coverage.Y"] > 0.5
    expected = lamp.irradiance((P[ground] - [0, 0, 1]) @ luminaire_from_world.T, N[ground] @ luminaire_from_world.T)
    found = picture["irradiance.G"][ground]
    # Positions are float32, and the light falls off over centimetres.
    assert found == pytest.approx(expected[:, 0], abs=2e-4 * expected.max())
    assert picture.plot() is not None and picture.tone_mapped().max() <= 1


def test_light_fields_stand_in_for_files(small):
    scene = lit_by(file="not-there.lf.exr")
    lamp = small["solved"].value
    a = luxfield.render(scene, light_field=lamp, spp=4).value
    b = luxfield.render(lit_by(file=small["solved"]), spp=4).value
    assert np.array_equal(a.pixels, b.pixels)
    c = luxfield.render(scene, light_field={"lamp": lamp}, spp=4).value
    assert np.array_equal(a.pixels, c.pixels)


def test_relight_scales(small):
    whole = luxfield.render(lit_by(file=small["solved"]), spp=4, light_groups=True)
    half = luxfield.relight(whole, scale={"lamp": 0.5})
    assert half.value.pixels == pytest.approx(0.5 * whole.value.pixels, rel=1e-5, abs=1e-6)


def test_sky_is_an_environment(tmp_path):
    environment = luxfield.sky(latitude=48, date="2024-06-21", height=32).value
    assert environment.layout == "latitude-longitude" and environment.pixels.shape == (3, 32, 64)
    # The pixel that shows each direction, by the layout's formula (docs/formats/environment.md).
    row, column = np.mgrid[0:32, 0:64]
    theta, phi = np.pi * (row + 0.5) / 32, np.pi * (1 - 2 * (column + 0.5) / 64)
    directions = np.stack([np.sin(theta) * np.sin(phi), -np.sin(theta) * np.cos(phi), np.cos(theta)], axis=-1)
    assert np.array_equal(environment.radiance(3 * directions), np.moveaxis(environment.pixels, 0, -1))
    assert environment.plot() is not None
    with pytest.raises(ValueError, match="name it in output"):
        luxfield.sky(latitude=48, date="2024-06-21", day=True)
    hdr = luxfield.sky(latitude=48, date="2024-06-21", height=32, output=tmp_path / "x.hdr")
    assert luxfield.Picture.read(hdr.output).pixels.shape == (3, 32, 64)
    assert luxfield.Environment.read(hdr.output, layout="latitude-longitude").pixels.shape == (3, 32, 64)


def program_that(tmp_path, monkeypatch, text):
    """Makes a shell script the program."""
    script = tmp_path / "program"
    script.write_text("#!/bin/sh\n" + text)
    script.chmod(0o755)
    monkeypatch.setenv("LUXFIELD_PROGRAM", str(script))


@pytest.mark.parametrize("code, kind", [(1, luxfield.errors.InternalError), (2, luxfield.InputError),
                                        (3, luxfield.DeviceError), (4, luxfield.Interrupted),
                                        (-9, luxfield.errors.InternalError)])
def test_every_exit_code_is_an_exception_with_the_last_sentence(code, kind, tmp_path, monkeypatch):
    end = f"exit {code}" if code > 0 else f"kill {code} $$"
    program_that(tmp_path, monkeypatch, f"echo luxfield: warning: mind the gap >&2; echo luxfield: so it is >&2; {end}")
    with pytest.warns(luxfield.LuxfieldWarning, match="mind the gap") as warned:
        with pytest.raises(kind, match="^so it is$") as raised:
            luxfield.info("x")
    assert type(raised.value) is kind and warned[0].filename == __file__


# Sends Ctrl-C to itself as soon as a program has begun, before who started it knows.
PRESSED_AT_ONCE = """
import os, signal, subprocess, time
start = subprocess.Popen
def pressed_at_once(*arguments, **options):
    child = start(*arguments, **options)
    while not os.path.exists("begun"):
        time.sleep(0.02)
    os.kill(os.getpid(), signal.SIGINT)
    return child
subprocess.Popen = pressed_at_once
"""


@pytest.mark.parametrize("at_once", [False, True])
def test_ctrl_c_reaches_the_program_which_ends_in_its_own_way(at_once, tmp_path):
    script = tmp_path / "program"
    script.write_text("#!/bin/sh\ntrap 'echo ended > ended; exit 4' INT\n: > begun\nwhile :; do sleep 0.05; done\n")
    script.chmod(0o755)
    code = "import luxfield\ntry: luxfield.info('x')\nexcept KeyboardInterrupt: print('interrupted')"
    environment = {**os.environ, "LUXFIELD_PROGRAM": str(script)}
    notebook = subprocess.Popen([sys.executable, "-c", PRESSED_AT_ONCE * at_once + code], env=environment, cwd=tmp_path,
                                stdout=subprocess.PIPE, text=True)
    if not at_once:
        deadline = time.monotonic() + 60
        while not (tmp_path / "begun").exists():
            assert time.monotonic() < deadline and notebook.poll() is None
            time.sleep(0.02)
        notebook.send_signal(signal.SIGINT)
    assert notebook.communicate(timeout=60)[0] == "interrupted\n"
    assert (tmp_path / "ended").read_text() == "ended\n"


def test_a_program_that_is_not_there_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("LUXFIELD_PROGRAM")
    monkeypatch.setattr(process._build, "PROGRAM", str(tmp_path / "not-built"))
    with pytest.raises(luxfield.InputError, match="LUXFIELD_PROGRAM"):
        luxfield.info("x")
    (tmp_path / "luxfield").write_text("#!/bin/sh\n")
    (tmp_path / "luxfield").chmod(0o755)
    assert process.program() == str(tmp_path / "luxfield")
    monkeypatch.setenv("LUXFIELD_PROGRAM", str(tmp_path / "gone"))
    with pytest.raises(luxfield.InputError, match="gone: cannot be started.*LUXFIELD_PROGRAM"):
        luxfield.info("x")


def test_the_build_trees_package_runs_its_own_program(monkeypatch):
    built = pathlib.Path(luxfield.__file__).absolute().parents[2] / "luxfield"
    if not built.exists():
        pytest.skip(f"{built} is not built")
    monkeypatch.delenv("LUXFIELD_PROGRAM")
    assert process.program() == str(built)


def test_nothing_beside_the_packages_folder_is_run_or_read(tmp_path):
    """A copy in TMP/x, and TMP/luxfield and TMP/data, which somebody else may have put there."""
    shutil.copytree(pathlib.Path(luxfield.__file__).parent, tmp_path / "x/luxfield",
                    ignore=shutil.ignore_patterns("_build.py", "__pycache__"))
    for folder in (tmp_path, tmp_path / "bin"):
        folder.mkdir(exist_ok=True)
        (folder / "luxfield").write_text("#!/bin/sh\n")
        (folder / "luxfield").chmod(0o755)
    for data in (tmp_path / "data", tmp_path / "share/luxfield/data"):
        (data / "labs").mkdir(parents=True)
        (data / "labs/small.toml").write_text("")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "x"), "PATH": str(tmp_path / "bin")}
    del environment["LUXFIELD_PROGRAM"]
    code = "from luxfield import process; print(process.program(), process.data_file('labs/small.toml'))"
    said = subprocess.run([sys.executable, "-c", code], env=environment, cwd=tmp_path, capture_output=True, text=True)
    assert said.stdout.split() == [str(tmp_path / "bin/luxfield"), str(tmp_path / "share/luxfield/data/labs/small.toml")]


def test_errors_are_pythons_with_the_programs_sentence(tmp_path, small):
    with pytest.raises(luxfield.InputError, match="not-there"):
        luxfield.merge(tmp_path / "not-there")
    with pytest.raises(luxfield.InputError, match="is not there"):
        luxfield.read(tmp_path / "not-there.exr")
    with pytest.raises(luxfield.InputError, match="light_fild|light-fild"):
        luxfield.render(SCENE, light_fild=1)
    with pytest.raises(luxfield.InputError, match="which Python has no class for"):
        luxfield.read(small["plan"])
    with pytest.raises(luxfield.InputError, match="no-such-file"):
        luxfield.import_rays("no-such-file.tm25ray")
    with pytest.raises(luxfield.InputError, match="no-such-file"):
        luxfield.probe("no-such-file.toml")
    assert issubclass(luxfield.InputError, ValueError) and issubclass(luxfield.DeviceError, luxfield.Error)


def test_a_name_that_looks_like_an_option_is_a_file(small, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("--help", "-h", "--version", "--", "-x.lf.exr", "-1"):
        with pytest.raises(luxfield.InputError, match=f"^{name}: "):
            luxfield.info(name)
    lamp = luxfield.export(small["solved"], "-x.ldt").output
    assert luxfield.info(lamp).figures["kind"] == "photometry"
    solved = small["solved"].value
    solved.write("-x.lf.exr")
    assert luxfield.preprocess("-x.lf.exr", output="-y.tab.exr").output.stat().st_size > 0
    small["solved"].sigma.write("-s.lf.exr")
    assert luxfield.photometry("-x.lf.exr", sigma="-s.lf.exr").flux_lm > 0


def test_figures_that_are_not_written_are_the_fault_of_the_call(small, tmp_path, monkeypatch):
    with pytest.raises(luxfield.InputError, match="ended without figures; leave out help") as raised:
        luxfield.info(small["plan"], help=True)
    assert tempfile.gettempdir() not in str(raised.value)
    program_that(tmp_path, monkeypatch, "exit 0")
    with pytest.raises(luxfield.InputError, match="program: `info` ended without figures"):
        luxfield.info("x")


def test_objects_in_place_of_files_are_named_by_their_argument(small):
    for call, words in [
        (lambda: luxfield.render({**SCENE, "quad": [{"corner": [0, 0]}]}), "^scene: "),
        (lambda: luxfield.plan({"plan": {"kind": "geometri"}}, lab=small["lab"]), "^plan: "),
        (lambda: luxfield.photometry(small["solved"].value, ask={"point": [{"position_m": 3}]}), "^ask: "),
        (lambda: luxfield.merge(small["solved"]), "^session: is a light field"),
    ]:
        with pytest.raises(luxfield.InputError, match=words) as raised:
            call()
        assert tempfile.gettempdir() not in str(raised.value)


def test_progress_is_handed_over(small):
    lines = []
    luxfield.render(lit_by(file=small["solved"]), spp=4, progress=lines.append)
    assert any(line.startswith("render") and "%" in line for line in lines)


def test_options_as_on_the_command_line():
    assert process.arguments({"spp": 4, "light_groups": True, "png": None, "quiet": False, "scale": (0, 2),
                              "knob": {"a": 1, "b": 2}, "calibration": ["x", "-y"], "level": -1}) == [
        "--spp", "4", "--light-groups", "--scale", "0", "2", "--knob", "a=1", "--knob", "b=2",
        "--calibration", "x", "--calibration=-y", "--level=-1"]


def test_toml_of_dicts_reads_back():
    import tomllib

    named = {"caf\u00e9 \U0001f4a1": {"a.b": "\U0001f4a1\x7f\x01", "x": [{"y z": 1}]}}
    assert tomllib.loads(toml.dumps(named)) == named
    table = {"a": {"b": 1, "c": {"d": [0.5, 1e-9]}, "text": 'quoted "and"\n', "none": None}, "flag": True,
             "list": [{"x": 1}, {"x": 2, "deep": {"y": np.float64(3)}}], "array": np.arange(3)}
    assert tomllib.loads(toml.dumps(table)) == {
        "a": {"b": 1, "c": {"d": [0.5, 1e-9]}, "text": 'quoted "and"\n'}, "flag": True,
        "list": [{"x": 1}, {"x": 2, "deep": {"y": 3.0}}], "array": [0, 1, 2]}
    with pytest.raises(TypeError, match="a: .* has no place in a TOML file"):
        toml.dumps({"a": object()})


def test_everything_public_is_documented():
    for name in luxfield.__all__:
        thing = getattr(luxfield, name)
        if callable(thing):
            assert inspect.getdoc(thing), name
    for kind in (luxfield.LightField, luxfield.Measurements, luxfield.Sampler, luxfield.Environment):
        for name in dir(kind):
            if not name.startswith("_"):
                assert inspect.getdoc(getattr(kind, name)), f"{kind.__name__}.{name}"
    assert set(verbs.__all__) <= set(luxfield.__all__)


def test_files_that_come_with_the_program_are_found(source):
    assert luxfield.data_file("labs/small.toml").samefile(source / "data/labs/small.toml")
    with pytest.raises(luxfield.InputError, match="labs/smal.toml: is not in .* or "):
        luxfield.data_file("labs/smal.toml")
