#!/usr/bin/env -S python3 -B
"""The open data set that data/dataset/make.py makes, of its smallest lamp: dataset_test.py PROGRAM"""

import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "data/dataset"))

import make  # noqa: E402

program = ""


class DataSet(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="luxfield_dataset_"))
        command = [ROOT / "data/dataset/make.py", program, "-o", cls.folder, "--lamp", "filament", "--spp", "2"]
        subprocess.run([*command, "--rays", "20000"], check=True, stdout=subprocess.DEVNULL)
        cls.lamp = cls.folder / "filament"

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def figures(self, *arguments):
        return make.run(program, *arguments)

    def test_every_file_is_there_and_readable_by_all(self):
        for name in make.FILES:
            path = self.lamp / name
            self.assertTrue(path.is_dir() if name.endswith("/") else path.stat().st_size > 0, name)
        for path in self.folder.rglob("*"):
            self.assertEqual(path.stat().st_mode & 0o044, 0o044, path)
        self.assertEqual({path.name for path in self.lamp.iterdir()}, {name.rstrip("/") for name in make.FILES})
        self.assertIn("CC-BY-4.0", (self.folder / "LICENSE.txt").read_text())

    def test_sums_are_of_every_file(self):
        check = subprocess.run(["sha256sum", "--check", "--quiet", "SHA256SUMS"], cwd=self.folder)
        self.assertEqual(check.returncode, 0)
        listed = len((self.folder / "SHA256SUMS").read_text().splitlines())
        self.assertEqual(listed, sum(path.is_file() for path in self.folder.rglob("*")) - 1)
        self.figures("verify", self.lamp / "session")

    def test_flux_is_that_of_an_isotropic_coil_through_its_opening(self):
        # hal/sim/filament.h: 2 pi I (1 - gap / sqrt(gap^2 + opening^2)), I = 2 pi L_0 a b.
        intensity = 2 * math.pi * 7e6 * 5e-4 * 2e-3
        flux = 2 * math.pi * intensity * (1 - 0.04 / math.hypot(0.04, 0.03))
        row = next(line for line in (self.folder / "README.md").read_text().splitlines() if line.startswith("| filament"))
        value, expanded = map(float, re.search(r"\| ([\d.]+) \+- ([\d.e+-]+) \|", row).groups())
        self.assertLess(abs(value - flux), 1.5 * expanded, row)  # three standard uncertainties
        self.assertLess(expanded, 0.02 * flux, row)

    def test_the_session_gives_the_light_field_again(self):
        again = self.folder / "again"
        again.mkdir()
        try:
            self.figures("merge", self.lamp / "session", "-o", again / "a.meas.exr", "--lamp-level", "monitor")
            self.figures("reconstruct", again / "a.meas.exr", "-o", again / "a.lf.exr")
            compared = self.figures("compare", again / "a.lf.exr", self.lamp / "lamp.lf.exr")
            self.assertEqual(compared["max_abs"], 0, json.dumps(compared)[:400])
        finally:
            shutil.rmtree(again)


if __name__ == "__main__":
    program = sys.argv.pop(1)
    unittest.main(verbosity=2)
