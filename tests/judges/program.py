"""Runs the program under judgement: the path stands in LUXFIELD, files live in a temporary folder
of each test."""

import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("LUXFIELD", str(SOURCE / "build/release/luxfield"))


class Judgement(unittest.TestCase):
    """A test case with a folder of its own, and the program run in it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="luxfield-judge-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_program(self, *arguments, code=0):
        """Runs `luxfield ARGUMENTS`; returns stdout. Fails unless it exits with the code."""
        done = subprocess.run(
            [PROGRAM, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True
        )
        self.assertEqual(
            done.returncode,
            code,
            f"luxfield {' '.join(map(str, arguments))}:\n{done.stdout}\n{done.stderr}",
        )
        return done.stdout

    def figures(self, *arguments):
        """What `luxfield ARGUMENTS --json` writes."""
        self.run_program(*arguments, "--json", "figures.json")
        return json.loads((self.folder / "figures.json").read_text())

    def write(self, name, text):
        (self.folder / name).write_text(text)
        return self.folder / name
