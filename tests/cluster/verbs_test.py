#!/usr/bin/env -S python3 -B
"""`luxfield shard` as a user runs it: jobs of the verbs against the verbs themselves, byte for byte, on the engines of
one machine; and what it says to jobs that cannot be. Usage: verbs_test.py LUXFIELD"""

import json
import pathlib
import resource
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LUXFIELD = None


def run(folder, *words):
    return subprocess.run([LUXFIELD, *words], cwd=folder, capture_output=True, text=True, timeout=600)


def run_limited(folder, most_bytes, *words):
    """Where no file grows beyond so many bytes, as on a disk that is full by then."""
    return subprocess.run([LUXFIELD, *words], cwd=folder, capture_output=True, text=True, timeout=600,
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes)))


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

    def plan_merge(self, name, shards=3):
        write_job(self.folder, f"{name}.toml", "merge", "s", f"{name}.meas.exr", shards)
        must(self.folder, "shard", "plan", f"{name}.toml", "-o", name)

    def expect_whole(self, name):
        """What is not done is done and gathered, to the bytes of the verb, and nothing else is left."""
        folder = self.folder
        must(folder, "shard", "submit", name, "--engine", "local", "--quiet")
        self.assertEqual((folder / f"{name}.meas.exr").read_bytes(), (folder / "s.meas.exr").read_bytes())
        self.assertEqual({file.suffix for file in (folder / name / "shards").iterdir()}, {".exr", ".json"})
        self.assertFalse(list((folder / name).glob("shards/*.failed.json")))
        self.assertEqual(list((folder / name / "scratch").iterdir()), [])
        self.assertEqual([path.name for path in folder.glob(".*.tmp.*")], [])

    def states(self, name, *words):
        must(self.folder, "shard", "status", name, *words, "--json", "status.json", "--quiet")
        return [shard["state"] for shard in json.loads((self.folder / "status.json").read_text())["shards"]]

    def test_a_full_disk_is_said_and_nothing_is_lost(self):
        folder = self.folder
        self.plan_merge("full")
        full = run_limited(folder, 4000, "shard", "run", "full", "1", "--quiet")
        self.assertEqual(full.returncode, 3, full.stderr)
        self.assertEqual(full.stderr.count("\n"), 1, full.stderr)
        self.assertIn("full/scratch/1.", full.stderr)
        self.assertEqual(self.states("full"), ["missing", "failed", "missing"])
        self.assertIn(full.stderr.split(": ", 1)[1].strip(), must(folder, "shard", "status", "full"))
        for number in range(3):
            must(folder, "shard", "run", "full", str(number), "--quiet")
        gather = run_limited(folder, (folder / "s.meas.exr").stat().st_size - 1, "shard", "gather", "full", "--quiet")
        self.assertEqual(gather.returncode, 3, gather.stderr)
        self.assertIn("full.meas.exr", gather.stderr)
        self.assertFalse((folder / "full.meas.exr").exists())
        self.expect_whole("full")

    def test_a_damaged_shard_is_named_and_done_again(self):
        folder = self.folder
        self.plan_merge("rot")
        for number in range(3):
            must(folder, "shard", "run", "rot", str(number), "--quiet")
        piece, gone, manifest = (next((folder / "rot/shards").glob(f"000{number}-*{ending}"))
                                 for number, ending in ((0, ".exr"), (1, ".exr"), (2, ".json")))
        whole = piece.read_bytes()
        piece.write_bytes(whole[:-9] + bytes(9))
        gather = run(folder, "shard", "gather", "rot")
        self.assertEqual(gather.returncode, 2, gather.stderr)
        self.assertIn(f"{piece.name}: is damaged: its SHA-256 is not that of its manifest; do the shard again with "
                      "`luxfield shard run rot 0`", gather.stderr)
        gone.unlink()
        manifest.write_bytes(manifest.read_bytes()[:40])
        self.assertEqual(self.states("rot"), ["done", "damaged", "missing"])
        self.assertEqual(self.states("rot", "--hashes"), ["damaged", "damaged", "missing"])
        self.assertFalse((folder / "rot.meas.exr").exists())
        self.expect_whole("rot")

    def test_killed_and_run_by_several_at_once(self):
        folder = self.folder
        self.plan_merge("kill", 5)
        killed = 0
        for number in range(5):
            words = [LUXFIELD, "shard", "run", "kill", str(number), "--quiet"]
            process = subprocess.Popen(words, cwd=folder)
            while process.poll() is None and not list((folder / "kill").glob(f"scratch/{number}.*")):
                pass
            process.kill()
            killed += process.wait() < 0
        self.assertGreater(killed, 0)
        self.assertGreaterEqual(self.states("kill").count("done"), 5 - killed)
        several = [subprocess.Popen([LUXFIELD, "shard", "run", "kill", str(number), "--quiet"], cwd=folder)
                   for number in (0, 0, 0, 1, 1)]
        self.assertEqual([process.wait() for process in several], [0] * 5)
        self.expect_whole("kill")

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
