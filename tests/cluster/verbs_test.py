#!/usr/bin/env -S python3 -B
"""`luxfield shard` as a user runs it: jobs of the verbs against the verbs themselves, byte for byte, on the engines of
one machine; and what it says to jobs that cannot be. Usage: verbs_test.py LUXFIELD"""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LUXFIELD = None


def run(folder, *words):
    return subprocess.run([LUXFIELD, *words], cwd=folder, capture_output=True, text=True, timeout=600)


def must(folder, *words):
    result = run(folder, *words)
    if result.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, words))}: exit {result.returncode}: {result.stderr}")
    return result.stdout


def write_job(folder, name, verb, inputs, output, shards, options=""):
    text = f'[job]\nverb = "{verb}"\ninput = {json.dumps(inputs)}\noutput = "{output}"\nshards = {shards}\n'
    (folder / name).write_text(text + (f"[options]\n{options}\n" if options else ""))


class Shards(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.held = tempfile.TemporaryDirectory(prefix="luxfield-shard.")
        cls.folder = pathlib.Path(cls.held.name)
        must(cls.folder, "capture", ROOT / "data/plans/small.toml", "s", "--lab", ROOT / "data/labs/small.toml",
             "--quiet")
        must(cls.folder, "merge", "s", "-o", "s.meas.exr", "--quiet")

    @classmethod
    def tearDownClass(cls):
        cls.held.cleanup()

    def expect_equal(self, name, verb, inputs, ending, shards, options, words, engine="local"):
        """The job in so many shards, and the verb with the same options, write the same."""
        folder = self.folder
        must(folder, verb, *inputs, "-o", f"{name}.one{ending}", *words, "--quiet")
        write_job(folder, f"{name}.toml", verb, inputs if len(inputs) > 1 else inputs[0], f"{name}.job{ending}", shards,
                  options)
        must(folder, "shard", "plan", f"{name}.toml", "-o", name, "--quiet")
        must(folder, "shard", "submit", name, "--engine", engine, "--jobs", "2", "--quiet")
        self.assertEqual((folder / f"{name}.one{ending}").read_bytes(), (folder / f"{name}.job{ending}").read_bytes(),
                         name)
        must(folder, "shard", "status", name, "--hashes", "--json", f"{name}.json", "--quiet")
        status = json.loads((folder / f"{name}.json").read_text())
        self.assertEqual(status["counts"], {"done": len(status["shards"])})
        return status

    def test_merge(self):
        status = self.expect_equal("merge", "merge", ["s"], ".meas.exr", 7, "", [])
        self.assertEqual((status["axis"], status["length"], len(status["shards"])), ("positions", 20, 7))

    def test_merge_with_options(self):
        self.expect_equal("monitor", "merge", ["s"], ".meas.exr", 3,
                          'lamp-level = "monitor"\nestimate-exposures = true\nskip-hashes = false',
                          ["--lamp-level", "monitor", "--estimate-exposures"], "parallel")

    def test_reconstruct(self):
        status = self.expect_equal("solve", "reconstruct", ["s.meas.exr"], ".lf.exr", 5, 'keep = "flux"',
                                   ["--keep", "flux"])
        self.assertEqual((status["axis"], status["length"]), ("rows", 32))

    def test_reconstruct_with_sigma(self):
        folder = self.folder
        must(folder, "reconstruct", "s.meas.exr", "-o", "a.lf.exr", "--sigma", "a.sigma.lf.exr", "--non-negative",
             "--quiet")
        write_job(folder, "sigma.toml", "reconstruct", "s.meas.exr", "b.lf.exr", 4,
                  'sigma = "b.sigma.lf.exr"\nnon-negative = true')
        must(folder, "shard", "plan", "sigma.toml", "-o", "sigma")
        must(folder, "shard", "submit", "sigma", "--engine", "local", "--quiet")
        for ending in (".lf.exr", ".sigma.lf.exr"):
            self.assertEqual((folder / ("a" + ending)).read_bytes(), (folder / ("b" + ending)).read_bytes(), ending)

    def test_shards_one_by_one(self):
        folder = self.folder
        write_job(folder, "steps.toml", "merge", "s", "steps.meas.exr", 3)
        must(folder, "shard", "plan", "steps.toml", "-o", "steps")
        early = run(folder, "shard", "gather", "steps")
        self.assertEqual(early.returncode, 2)
        self.assertIn("3 of 3 shards are missing: 0, 1, 2", early.stderr)
        self.assertFalse((folder / "steps.meas.exr").exists())
        for number in (2, 0, 1):
            must(folder, "shard", "run", "steps", str(number), "--quiet")
        self.assertIn("there already", must(folder, "shard", "run", "steps", "1", "--quiet"))
        must(folder, "shard", "gather", "steps")
        self.assertEqual((folder / "steps.meas.exr").read_bytes(), (folder / "s.meas.exr").read_bytes())

    def test_slurm_is_refused_by_name_and_its_scripts_stay(self):
        folder = self.folder
        write_job(folder, "slurm.toml", "merge", "s", "slurm.meas.exr", 3)
        must(folder, "shard", "plan", "slurm.toml", "-o", "slurm")
        result = subprocess.run([LUXFIELD, "shard", "submit", "slurm", "--engine", "slurm"], cwd=folder, text=True,
                                capture_output=True, env={"PATH": str(folder)})
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("sbatch is not on the PATH", result.stderr)
        self.assertIn("#SBATCH --array=0-2", (folder / "slurm/submit/shards.sbatch").read_text())
        self.assertIn("afterok", (folder / "slurm/submit/slurm.sh").read_text())

    def test_what_cannot_be_is_said(self):
        good = dict(verb="merge", inputs="s", output="bad.meas.exr", shards=3)
        for change, sentence in (
                ({"verb": "budget"}, "job.verb = 'budget' cannot be cut into shards"),
                ({"inputs": ["s", "s"]}, "job.input names 2 files where merge takes one"),
                ({"inputs": "absent"}, "absent"),
                ({"inputs": "s.meas.exr"}, "s.meas.exr"),
                ({"output": "bad.exr"}, "must end in .meas.exr"),
                ({"shards": 0}, "job.shards = 0 must lie in [1, 100000]"),
                ({"options": 'estimater = "poisson"'}, "did you mean 'estimator'?"),
                ({"options": 'estimator = "median"'}, "median"),
                ({"options": "estimate-exposures = 1"}, "options.estimate-exposures must be true or false"),
                ({"options": "exposure = [1, 2]"}, "options.exposure is for pictures"),
                ({"options": "calibration = 'absent.cal.json'"}, "absent.cal.json"),
                ({"verb": "reconstruct", "inputs": "s.meas.exr", "output": "bad.lf.exr", "options": 'regularise = "auto"'},
                 "options.regularise takes sums over all texels"),
                ({"verb": "reconstruct", "inputs": "s.meas.exr", "output": "bad.lf.exr",
                  "options": 'non-negative = true\nnon-negative-metric = "irradiance"'},
                 "options.non-negative-metric = irradiance takes sums")):
            with self.subTest(change):
                write_job(self.folder, "bad.toml", **{**good, **change})
                result = run(self.folder, "shard", "plan", "bad.toml", "-o", "bad")
                self.assertEqual(result.returncode, 2, result.stderr)
                self.assertIn(sentence, result.stderr)
                self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
                self.assertFalse((self.folder / "bad").exists())


if __name__ == "__main__":
    LUXFIELD = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
