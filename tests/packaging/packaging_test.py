#!/usr/bin/env -S python3 -B
"""Man pages and completions that packaging/ makes of the program's --help: packaging_test.py PROGRAM"""

import gzip
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "packaging"))

import completions  # noqa: E402
import man_pages  # noqa: E402
import verbs_help  # noqa: E402

program = ""


class Packaging(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="luxfield_packaging_"))
        cls.pages = list(verbs_help.pages(program))
        man_pages.write(cls.pages, "1.2.3", cls.folder / "man")
        completions.write(cls.pages, cls.folder)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def page(self, *words):
        return next(page for page in self.pages if page.words == ["luxfield", *words])

    def manual(self, name):
        return gzip.decompress((self.folder / "man" / f"{name}.1.gz").read_bytes()).decode()

    def test_help_is_understood(self):
        top = self.page()
        self.assertIn("merge", [verb.names[0] for verb in top.verbs])
        merge = self.page("merge")
        self.assertTrue(merge.description.startswith("Merge "))
        self.assertIn("[OPTIONS]", merge.usage)
        options = {name: option for option in merge.options for name in option.names}
        self.assertEqual(options["--output"].names, ["-o", "--output"])
        self.assertIn("REQUIRED", options["--output"].value)
        self.assertEqual(options["--estimator"].choices, ["inverse-variance", "poisson"])
        self.assertIn("inverse-variance: iterated", options["--estimator"].text)
        self.assertEqual(options["--quiet"].value, "")
        self.assertIn("sensor", [verb.names[0] for verb in self.page("calibrate").verbs])
        self.page("calibrate", "sensor")
        for page in self.pages:
            self.assertTrue(page.description, page.words)
            self.assertTrue(page.options, page.words)
            for option in page.options:
                self.assertTrue(option.text, (page.words, option))

    def test_every_verb_has_a_man_page(self):
        for page in self.pages:
            name = "-".join(page.words)
            text = self.manual(name)
            self.assertTrue(text.startswith(f'.TH "{name.upper()}" 1'), name)
            self.assertIn("luxfield 1.2.3", text)
            self.assertIn(".SH NAME\n", text)
        self.assertIn(r"\fBluxfield\-merge\fR(1)", self.manual("luxfield"))

    @unittest.skipUnless(shutil.which("groff"), "groff is missing")
    def test_man_pages_are_set_without_a_warning(self):
        for file in sorted((self.folder / "man").iterdir()):
            # Long words leave lines short; nothing else is excused.
            done = subprocess.run(
                ["groff", "-man", "-ww", "-Wbreak", "-Kutf8", "-Tutf8", "-rLL=100n"],
                input=gzip.decompress(file.read_bytes()),
                capture_output=True,
            )
            self.assertEqual((done.returncode, done.stderr), (0, b""), file.name)

    def complete(self, *words):
        array = " ".join(f"'{word}'" for word in ("luxfield", *words))
        script = f"source {self.folder}/luxfield.bash; COMP_WORDS=({array}); COMP_CWORD={len(words)}; _luxfield; "
        script += 'printf "%s\\n" "${COMPREPLY[@]}"'
        return subprocess.run(["bash", "-c", script], text=True, capture_output=True, check=True, cwd=ROOT).stdout.split()

    def test_bash_completes(self):
        self.assertEqual(self.complete("me"), ["merge"])
        self.assertEqual(set(self.complete("re")), {"report", "reconstruct", "render", "relight"})
        self.assertEqual(self.complete("merge", "--skip"), ["--skip-hashes"])
        self.assertEqual(self.complete("merge", "--estimator", "p"), ["poisson"])
        self.assertEqual(self.complete("calibrate", "sen"), ["sensor"])
        self.assertEqual(self.complete("calibrate", "sensor", "--j"), ["--json"])
        self.assertEqual(self.complete("info", "READ"), ["README.md"])

    def test_other_shells_read_theirs(self):
        for shell, file in (("zsh", "_luxfield"), ("fish", "luxfield.fish")):
            if not shutil.which(shell):
                continue  # what it says is made from the same list as bash's
            done = subprocess.run([shell, "-n", self.folder / file], text=True, capture_output=True)
            self.assertEqual((done.returncode, done.stderr), (0, ""), shell)

    def test_every_option_is_in_every_completion(self):
        texts = {name: (self.folder / name).read_text() for name in ("luxfield.bash", "_luxfield", "luxfield.fish")}
        for page in self.pages:
            for option in page.options:
                for name in option.names:
                    self.assertIn(name, texts["luxfield.bash"])
                    self.assertIn(f"'{name}[", texts["_luxfield"])
                    self.assertIn(f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}", texts["luxfield.fish"])


if __name__ == "__main__":
    program = sys.argv.pop(1)
    unittest.main()
