#!/usr/bin/env python3
"""Makes the open data set: three simulated lamps with their truth and their measurement.

    data/dataset/make.py LUXFIELD [-o FOLDER] [--lamp NAME]... [--rays N] [--spp N]

LUXFIELD is the program. For each lamp FOLDER/NAME/ gets the files that `FILES` lists; FOLDER gets a README.md
with the lamps' figures, LICENSE.txt and SHA256SUMS. A lamp's folder appears when all of it is made; an earlier
one of the same name is replaced. The same program makes the same light fields to the bit; sessions and files
that state when they were made differ in that.
"""
import argparse
import hashlib
import json
import math
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
LAMPS = {
    "headlight": "a low-beam projector headlight, 180 mm wide, with a cut-off",
    "downlight": "a downlight, 90 mm wide: a broad source in a bowl of 108 facets",
    "filament": "a bare coil of 2 mm, 40 mm behind a round opening of 60 mm",
}
FILES = {
    "lab.toml": "the simulated bench: lamp, camera, stage, and how large each of their errors is",
    "plan.toml": "what was measured: planes, basis, filter positions, exposures",
    "budget.toml": "standard deviations of the bench's errors, for `luxfield budget` and certificates",
    "truth.lf.exr": "the lamp's projection on the plan's basis, without any error",
    "session/": "the measurement: frames of the camera, a journal, hashes (a folder)",
    "lamp.lf.exr": "the light field that the session was solved for",
    "lamp.sigma.lf.exr": "its standard deviations",
    "lamp.ies": "the far field, IES LM-63-2002",
    "lamp.ldt": "the far field, EULUMDAT",
    "lamp.tm25ray": "rays of equal flux, IES TM-25",
    "certificate.pdf": "flux, intensities and error budget as a calibration certificate",
    "lamp.png": "walls and objects that the lamp lights from 0.3 m on (`data/scenes/wall.toml`)",
}
LICENCE = """Licensed under the Creative Commons Attribution 4.0 International licence
(SPDX: CC-BY-4.0, https://creativecommons.org/licenses/by/4.0/).

You may copy, change and publish these files, for any purpose, as long as you say where they come from:
luxfield, simulated measurements of three luminaires, version {version}.
"""


class Failure(Exception):
    """A verb failed; what it said stands above."""


def run(luxfield, *arguments):
    """Runs a verb and returns its --json."""
    with tempfile.TemporaryDirectory() as folder:
        figures = Path(folder) / "figures.json"
        command = [luxfield, *map(str, arguments), "--quiet", "--json", str(figures)]
        if subprocess.run(command, stdout=subprocess.DEVNULL).returncode:
            raise Failure(f"failed: {' '.join(command)}")
        return json.loads(figures.read_text())


def make_lamp(luxfield, name, folder, rays, spp):
    """All files of a lamp; returns the figures that README.md states."""
    for kind in ("lab", "plan"):
        shutil.copyfile(HERE / f"{name}.{kind}.toml", folder / f"{kind}.toml")
    shutil.copyfile(HERE / "budget.toml", folder / "budget.toml")
    lab, plan, session = folder / "lab.toml", folder / "plan.toml", folder / "session"
    lamp, sigma, truth = folder / "lamp.lf.exr", folder / "lamp.sigma.lf.exr", folder / "truth.lf.exr"
    measured = folder / "lamp.meas.exr"  # merge makes it again in seconds: not published
    run(luxfield, "simulate", lab, "--plan", plan, "-o", truth)
    run(luxfield, "capture", plan, session, "--lab", lab)
    run(luxfield, "merge", session, "-o", measured, "--lamp-level", "monitor")
    run(luxfield, "reconstruct", measured, "-o", lamp, "--sigma", sigma)
    measured.unlink()
    budget = run(luxfield, "budget", session, "--lamp-level", "monitor", "--uncertainty", folder / "budget.toml")
    for ending in ("ies", "ldt"):
        run(luxfield, "export", lamp, "--sigma", sigma, "-o", folder / f"lamp.{ending}")
    run(luxfield, "export", lamp, "--rays", rays, "-o", folder / "lamp.tm25ray")
    run(luxfield, "photometry", lamp, "--sigma", sigma, "--session", session, "--uncertainty", folder / "budget.toml",
        "-o", folder / "certificate.pdf")
    run(luxfield, "photometry", lamp, "--sigma", sigma, "-o", folder / "figures.json")
    figures = {"measured": json.loads((folder / "figures.json").read_text()), "budget": budget}
    run(luxfield, "photometry", truth, "-o", folder / "figures.json")
    figures["truth"] = json.loads((folder / "figures.json").read_text())
    (folder / "figures.json").unlink()
    run(luxfield, "render", HERE.parent / "scenes/wall.toml", "--light-field", lamp, "--spp", spp, "--tone", "filmic",
        "-o", folder / "picture.exr", "--png", folder / "lamp.png")
    (folder / "picture.exr").unlink()
    return figures


def row(name, figures):
    """A line of README.md: truth, and measurement +- U, k = 2, by the rule of the certificate."""
    measured, truth = figures["measured"], figures["truth"]
    flux = figures["budget"]["quantities"][0]
    peak = measured["intensity_peak_cd"]
    peak_u = math.hypot(measured["intensity_peak_cd_u"], peak * flux["relative"])
    beam, beam_u = measured["beam_angle_deg"], measured["beam_angle_deg_u"]
    cells = [name, f"{truth['flux_lm']:.6g}", f"{flux['value']:.6g} +- {2 * flux['sigma']:.2g}",
             f"{truth['intensity_peak_cd']:.5g}", f"{peak:.5g} +- {2 * peak_u:.2g}",
             f"{truth['beam_angle_deg']:.5g}", f"{beam:.5g} +- {2 * beam_u:.1g}"]
    return "| " + " | ".join(cells) + " |"


def readme(version, figures):
    lamps = [f"* `{name}/`: {LAMPS[name]}" for name in figures]
    files = [f"| `{name}` | {text} |" for name, text in FILES.items()]
    return "\n".join([
        "# Three luminaires as light fields: truth, measurement, error bars", "",
        f"Made by luxfield {version}. What the camera of a simulated bench saw through 81 to 121 positions of an optical",
        "filter, with the errors of a real bench switched on, and what was solved from it. The truth is known, so that",
        "a method of reconstruction, interpolation or export can be judged by it.", "", *lamps, "",
        "| file of each lamp | what it is |", "|---|---|", *files, "",
        "Flux in lm, largest intensity in cd, beam angle (of half the largest intensity) in degrees; the truth, which is",
        "the projection of the lamp's rays on the plan's basis, beside the measurement with its expanded uncertainty,",
        "k = 2. The flux's has the whole error budget; the intensity's its noise and, in proportion, the budget of the",
        "flux; the beam angle's the noise alone, without what filters off their nominal shape do to it.", "",
        "| lamp | flux | measured | peak | measured | beam angle | measured |", "|---|---|---|---|---|---|---|",
        *(row(name, figures[name]) for name in figures), "",
        "The coefficients of a light field are float images of an OpenEXR file, one part for each filter position; units,",
        "planes and basis stand in its header. To light a scene, to export, to measure again:", "",
        "    luxfield info lamp.lf.exr", "    luxfield view lamp.lf.exr", "    luxfield merge session -o lamp.meas.exr --lamp-level monitor",
        "    luxfield reconstruct lamp.meas.exr -o again.lf.exr", "    luxfield compare again.lf.exr truth.lf.exr", "",
        "`sha256sum --check SHA256SUMS` checks the files; LICENSE.txt says what you may do with them.", ""])


def open_to_readers(folder):
    """A session is its owner's alone; what is published is everybody's to read."""
    for path in [folder, *folder.rglob("*")]:
        path.chmod(0o755 if path.is_dir() else 0o644)


def digest(path):
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_sums(folder):
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != "SHA256SUMS")
    lines = [f"{digest(path)}  {path.relative_to(folder)}\n" for path in paths]
    (folder / "SHA256SUMS").write_text("".join(lines))
    return sum(path.stat().st_size for path in paths)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("luxfield", help="the program")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/dataset"), help="folder (default: out/dataset)")
    parser.add_argument("--lamp", choices=LAMPS, action="append", help="only this one (repeatable; default: all)")
    parser.add_argument("--rays", type=int, default=200000, help="rays of each lamp's TM-25 file (default: 200000)")
    parser.add_argument("--spp", type=int, default=64, help="light samples per pixel of the pictures (default: 64)")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    version = subprocess.run([options.luxfield, "--version"], capture_output=True, text=True, check=True)
    version = version.stdout.split()[1]
    figures = {}
    for name in options.lamp or LAMPS:
        print(f"dataset: {name}", flush=True)
        staged = Path(tempfile.mkdtemp(prefix=f".{name}.", dir=options.output))
        try:
            figures[name] = make_lamp(options.luxfield, name, staged, options.rays, options.spp)
            open_to_readers(staged)
            shutil.rmtree(options.output / name, ignore_errors=True)
            staged.rename(options.output / name)
        finally:
            shutil.rmtree(staged, ignore_errors=True)
    (options.output / "README.md").write_text(readme(version, figures))
    (options.output / "LICENSE.txt").write_text(LICENCE.format(version=version))
    size = write_sums(options.output)
    print(f"dataset: {options.output}, {size / 1e6:.0f} MB; look at {options.output}/README.md")


if __name__ == "__main__":
    try:
        main()
    except Failure as failure:
        sys.exit(f"dataset: {failure}")
