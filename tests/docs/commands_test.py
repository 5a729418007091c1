#!/usr/bin/env -S python3 -B
"""Every command that a page states is one that the program takes, and those of the pages in `WALKED` do what they say.

    tests/docs/commands_test.py PROGRAM
"""

import fnmatch
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import pages

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "packaging"))

import verbs_help  # noqa: E402

program = ""

# Pages whose commands are run, in this order and in one folder: later pages go on with files of earlier ones.
WALKED = ["tutorial", "how-to/calibrate", "how-to/measure", "how-to/permissions", "how-to/export", "how-to/light", "bridges", "web", "photometry", "scale"]
# Files that a page takes as given: copies of what the pages before it made.
GIVEN = {
    "how-to/measure": {"lamp.session": "small.session", "budget.toml": "data/dataset/budget.toml"},
    "how-to/export": {"lamp.lf.exr": "small.lf.exr"},
    "how-to/light": {"led.tm25ray": "lamp.tm25ray"},
}
# Commands of those pages that are not run, and why. Their options are still looked up.
NOT_RUN = {
    "*[[]*": "a pattern, not a command",
    "*...*": "a pattern, not a command",
    "demo": "minutes; planning.Demo runs it",
    "devices *": "of the devices of a bench",
    "bench *": "a benchmark",
    "plan data/plans/bike.toml *": "minutes",
    "capture garage.toml *": "goes on with the plan's",
    "*film.tone.toml*": "of a film of the bench",
    "* *.jpg *": "of photographs of the bench",
    "*f.filter.exr*": "of a printed filter",
    "capture data/plans/filter.toml *": "the print of the line before it",
    "merge lamp.session *--calibration*": "the session of a lamp by the camera that was calibrated; e2e.Calibrate has them",
    "budget lamp.session --calibration *": "likewise",
    "* --day*": "67 pictures",
    "info day": "67 pictures",
    "render data/scenes/demo.toml -o X.exr *": "a lamp of minutes",
    "relight *": "the picture of the line before it",
    "render data/scenes/day.toml *": "67 pictures",
    "render data/scenes/hall.toml *": "a lamp of minutes",
    "render data/scenes/street.toml *": "a lamp of minutes",
    "preprocess *street.toml*": "a lamp of minutes",
    "export * -o lamp.rad --check": "of Radiance, which a machine may lack; e2e.Export reads the answers of a judge",
    "render SCENE *": "a pattern, not a command",
    "shard *": "tests/cluster runs them",
    "photometry *ask.toml*": "tests/judges ask",
}


def commands(text):
    """Commands of a page: (words after the program's name, whether in a block of its own)."""
    found, fenced, lines = [], False, iter(text.splitlines())
    prose = []
    for line in lines:
        if line.startswith("```"):
            fenced = not fenced
        elif fenced or line.startswith("    "):
            while line.rstrip().endswith("\\"):
                line = line.rstrip()[:-1] + " " + next(lines).strip()
            match = re.match(r"\s*(?:\./run|luxfield)\s+(.*)", re.sub(r"\s+#.*", "", line))
            if match:
                found.append((match[1], True))
        else:
            prose.append(line)
    for code in re.findall(r"`([^`]+)`", "\n".join(prose)):
        match = re.match(r"(?:\./run|luxfield)\s+(\S.*)", " ".join(code.split()))
        if match:
            found.append((match[1], False))
    return found


def of_script():
    """Words that ./run takes besides the program's verbs."""
    return set(re.findall(r"^  (\w+)\)$", (ROOT / "run").read_text(), re.MULTILINE))


class Parsed(unittest.TestCase):
    def test_commands_are_found(self):
        text = "Do `./run info\nX` or\n\n    luxfield cache --size  # bytes\n    ./run plan a \\\n      --lab b\n\n```\n./run sky\n```\n"
        self.assertEqual(
            commands(text), [("cache --size", True), ("plan a  --lab b", True), ("sky", True), ("info X", False)])

    def test_verbs_and_options_are_the_programs(self):
        helps = {" ".join(page.words[1:]): {name for option in page.options for name in option.names}
                 for page in verbs_help.pages(program)}
        script, wrong, seen = of_script(), [], 0
        # docs/mistakes.md is about commands that are wrong.
        for path in [ROOT / "README.md", *sorted({*(ROOT / "docs").rglob("*.md")} - {ROOT / "docs/mistakes.md"})]:
            for command, block in commands(pages.text(path)):
                words = command.split()
                verb = next((" ".join(words[:n]) for n in (2, 1) if " ".join(words[:n]) in helps), None)
                seen += 1
                if verb is None:
                    if block and words[0] not in script:
                        wrong.append(f"{path.relative_to(ROOT)}: {command}: no such verb")
                    continue
                for option in re.findall(r"(?<![\w-])--[a-z][a-z-]*", command):
                    if option not in helps[verb] and option not in ("--help", "--version"):
                        wrong.append(f"{path.relative_to(ROOT)}: {command}: no {option}")
        self.assertGreater(seen, 150)
        self.assertEqual(wrong, [], "\n".join(wrong))


class Walked(unittest.TestCase):
    def test_commands_of_the_pages_do_what_they_say(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="luxfield_commands_"))
        self.addCleanup(shutil.rmtree, folder)
        (folder / "data").symlink_to(ROOT / "data")
        (folder / "out").mkdir()
        failed, ran, script, used = [], 0, of_script(), set()
        for page in WALKED:
            for name, source in GIVEN.get(page, {}).items():
                (folder / name).symlink_to(source)
            for command, block in commands(pages.text(ROOT / f"docs/{page}.md")):
                reason = next((pattern for pattern in NOT_RUN if fnmatch.fnmatch(command, pattern)), None)
                used.add(reason)
                if not block or reason or command.split()[0] in script:
                    continue
                start = time.monotonic()
                done = subprocess.run([program, *shlex.split(command)], cwd=folder, text=True, capture_output=True)
                ran += 1
                print(f"{time.monotonic() - start:6.1f} s  {command}", flush=True)
                if done.returncode:
                    failed.append(f"docs/{page}.md: {command}: {done.stderr.strip().splitlines()[-1:]}")
        self.assertEqual(failed, [], "\n".join(failed))
        self.assertGreater(ran, 30)
        self.assertEqual(set(NOT_RUN) - used, set(), "no page has such a command any more")


if __name__ == "__main__":
    program = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main(verbosity=2)
