#!/usr/bin/env -S python3 -B
"""`luxfield shard` as a user runs it: jobs of the verbs against the verbs themselves, byte for byte, on the engines of
one machine; and what it says to jobs that cannot be. Usage: verbs_test.py LUXFIELD"""

import json
import pathlib
import resource
import shutil
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

    def test_a_job_whose_shards_are_not_the_whole_is_one_sentence(self):
        folder = self.folder
        write_job(folder, "gaps.toml", "merge", "s", "gaps.meas.exr", 3)
        must(folder, "shard", "plan", "gaps.toml", "-o", "gaps", "--quiet")
        path = folder / "gaps/job.json"
        whole = json.loads(path.read_text())
        for shards, said in (([], "shards names none"), (whole["shards"][:2], "length = ")):
            path.write_text(json.dumps(whole | {"shards": shards}))
            for words in (("run", "gaps", "0"), ("status", "gaps"), ("gather", "gaps")):
                result = run(folder, "shard", *words)
                self.assertEqual((result.returncode, len(result.stderr.splitlines())), (2, 1), result)
                self.assertIn(said, result.stderr)

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

    def test_preprocess(self):
        must(self.folder, "reconstruct", "s.meas.exr", "-o", "tables.lf.exr", "--quiet")
        status = self.expect_equal("tables", "preprocess", ["tables.lf.exr"], ".tab.exr", 6, "", [])
        self.assertEqual((status["axis"], status["length"], len(status["shards"])), ("images", 20, 6))
        piece = next((self.folder / "tables/shards").glob("0003-*.exr"))
        whole = piece.read_bytes()
        piece.write_bytes(whole[:-5] + bytes(5))
        gather = run(self.folder, "shard", "gather", "tables")
        self.assertEqual(gather.returncode, 2, gather.stderr)
        self.assertIn(f"{piece.name}: is damaged", gather.stderr)
        must(self.folder, "shard", "run", "tables", "3", "--quiet")
        self.assertEqual(piece.read_bytes(), whole)
        must(self.folder, "shard", "gather", "tables", "--quiet")
        self.assertEqual((self.folder / "tables.one.tab.exr").read_bytes(),
                         (self.folder / "tables.job.tab.exr").read_bytes())

    def write_room(self):
        """room.toml, a textured floor and a lamp under a sky of four frames, and path.toml, which moves the lamp."""
        folder = self.folder
        must(folder, "reconstruct", "s.meas.exr", "-o", "lamp.lf.exr", "--quiet")
        shutil.rmtree(folder / "sky", ignore_errors=True)
        must(folder, "sky", "-o", "sky", "--latitude", "48", "--longitude", "12", "--date", "2024-06-21", "--day",
             "--frames", "4", "--height", "32", "--quiet")
        (folder / "floor.mtl").write_text("newmtl floor\nKd 0.5 0.4 0.3\n")
        (folder / "floor.obj").write_text(
            "mtllib floor.mtl\nv -3 -3 0\nv 3 -3 0\nv 3 3 0\nv -3 3 0\nusemtl floor\nf 1 2 3 4\n")
        (folder / "room.toml").write_text(
            '[camera]\nposition = [0, -4, 2]\nlook_at = [0, 0, 0]\nwidth = 32\nheight = 24\n'
            '[[mesh]]\nfile = "floor.obj"\n[environment]\nfile = "sky"\nscale = 1e-4\n'
            '[[luminaire]]\nname = "lamp"\nfile = "lamp.lf.exr"\nposition = [0, 0, 1]\nlook_at = [0, 0, 0]\n'
            'up = [0, 1, 0]\n')
        (folder / "path.toml").write_text(
            'frames_per_s = 3\nduration_s = 1\n[[luminaire]]\nname = "lamp"\n[[luminaire.key]]\nt_s = 0\n'
            'position = [0, 0, 1]\n[[luminaire.key]]\nt_s = 1\nposition = [0.5, 0, 1.5]\n')

    def test_render(self):
        folder = self.folder
        self.write_room()
        endings = [f"_{frame:04}{kind}" for frame in range(4) for kind in (".exr", ".png", "_map.png")]
        names = ["-o", "one.exr", "--png", "one.png", "--irradiance-map", "one_map.png"]

        def name(stem, ending):  # X_map.png of frame 2 is X_map_0002.png
            return stem + ("_map" + ending.replace("_map", "") if "_map" in ending else ending)

        must(folder, "render", "room.toml", *names, "--sequence", "path.toml", "--spp", "8", "--seed", "5", "--scale",
             "0.1", "1000", "--quiet")
        write_job(folder, "film.toml", "render", "room.toml", "film.exr", 3,
                  'sequence = "path.toml"\nspp = 8\nseed = 5\npng = "film.png"\nirradiance-map = "film_map.png"\n'
                  'scale = [0.1, 1000]')
        must(folder, "shard", "plan", "film.toml", "-o", "film")
        must(folder, "shard", "submit", "film", "--engine", "local", "--quiet")
        for ending in endings:
            self.assertEqual((folder / name("one", ending)).read_bytes(), (folder / name("film", ending)).read_bytes(),
                             ending)
        # The job's figures follow from what the scene leads to as well.
        (folder / "floor.mtl").write_text("newmtl floor\nKd 0.5 0.4 0.2\n")
        next((folder / "film/shards").glob("0001-*.0001.exr")).unlink()
        changed = run(folder, "shard", "run", "film", "1")
        self.assertEqual(changed.returncode, 2, changed.stderr)
        self.assertIn("room.toml: its meshes, textures or frames have changed", changed.stderr)

    def test_render_resumes(self):
        folder = self.folder
        self.write_room()
        words = ["render", "room.toml", "-o", "day.exr", "--png", "day.png", "--spp", "8", "--quiet", "--json",
                 "day.json"]

        def kept(*more):
            must(folder, *words, *more)
            return [frame.get("kept", False) for frame in json.loads((folder / "day.json").read_text())["frames"]]

        self.assertEqual(kept(), [False] * 4)
        frames = [(folder / f"day_{frame:04}.exr").read_bytes() for frame in range(4)]
        self.assertEqual(kept("--resume"), [True] * 4)
        (folder / "day_0001.exr").write_bytes(frames[1][:-100])
        (folder / "day_0002.png").unlink()
        self.assertEqual(kept("--resume"), [True, False, False, True])
        sky = sorted((folder / "sky").glob("*.exr"))
        sky[3].write_bytes(sky[0].read_bytes())
        self.assertEqual(kept("--resume"), [True, True, True, False])
        self.assertEqual(kept("--resume", "--exposure", "2"), [False] * 4)
        (folder / "floor.mtl").write_text("newmtl floor\nKd 0.5 0.4 0.2\n")
        self.assertEqual(kept("--resume", "--exposure", "2"), [False] * 4)
        for frame in (0, 1, 2):
            self.assertNotEqual((folder / f"day_{frame:04}.exr").read_bytes(), frames[frame])
        room = (folder / "room.toml").read_text()
        (folder / "still.toml").write_text(room.replace('"sky"', f'"sky/{sky[0].name}"'))
        one = run(folder, "render", "still.toml", "-o", "still.exr", "--resume", "--quiet")
        self.assertEqual(one.returncode, 2)
        self.assertIn("--resume is for a sequence of frames", one.stderr)

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
        (self.folder / "still.toml").write_text(
            '[camera]\nposition = [0, -4, 2]\nlook_at = [0, 0, 0]\n[[light]]\nkind = "sphere"\nradius = 0.1\n'
            'position = [0, 0, 1]\nradiance = [1, 1, 1]\n')
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
                ({"options": 'memory = "2G"'}, "options.memory is for one machine"),
                ({"verb": "preprocess", "inputs": "s.meas.exr", "output": "bad.tab.exr", "options": "scene = 'still.toml'"},
                 "options.scene reduces the light field as a whole"),
                ({"verb": "preprocess", "inputs": "s.meas.exr", "output": "bad.tab.exr"}, "s.meas.exr"),
                ({"verb": "render", "inputs": "still.toml", "output": "bad.exr"}, "still.toml: makes one picture"),
                ({"verb": "render", "inputs": "still.toml", "output": "bad.exr", "options": "time = '1s'"},
                 "options.time is for one picture"),
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
