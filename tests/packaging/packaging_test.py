#!/usr/bin/env -S python3 -B
"""Man pages and completions that packaging/ makes of the program's --help, the udev rule as it is installed, and the
pins of what the judges are installed from: packaging_test.py PROGRAM"""

import fnmatch
import gzip
import json
import pathlib
import re
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


def rules(text):
    """(key, operator, value) of each line of a udev rules file."""
    part = re.compile(r'([A-Z_]+(?:\{\w+\})?)(==|!=|\+=|=)"([^"]*)"')
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    for line in lines:
        parts = part.findall(line)
        assert ", ".join('%s%s"%s"' % each for each in parts) == line, f"no rule: {line}"
        yield parts


def applied(text, device):
    """What the rules assign to a device, after udev(7): jumps, matches of patterns with alternatives."""
    given, label = {}, None
    for parts in rules(text):
        if label and ("LABEL", "=", label) not in parts:
            continue
        label = None
        matched = True
        for key, operator, value in parts:
            if operator in ("==", "!="):
                found = any(fnmatch.fnmatchcase(device.get(key, ""), each) for each in value.split("|"))
                matched = matched and found == (operator == "==")
        for key, operator, value in parts if matched else []:
            if key == "GOTO":
                label = value
            elif operator in ("=", "+="):
                given[key] = value
    assert label is None, f"no LABEL {label}"
    return given


class UdevRule(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="luxfield_udev_"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        build = pathlib.Path(program).resolve().parent
        subprocess.run(
            ["cmake", "--install", build, "--component", "program", "--prefix", cls.folder], check=True, capture_output=True
        )
        cls.file = cls.folder / "lib/udev/rules.d/60-luxfield.rules"
        cls.text = cls.file.read_text()

    def usb(self, interfaces):
        device = {"ACTION": "add", "SUBSYSTEM": "usb", "ENV{DEVTYPE}": "usb_device", "ENV{ID_USB_INTERFACES}": interfaces}
        return applied(self.text, device)

    def test_devices_of_the_drivers_have_their_group(self):
        source = (ROOT / "hal/drivers/usbtmc/usbtmc.cc").read_text()
        instrument = [int(re.search(rf"\b{name} = (\w+)", source)[1], 0) for name in ("kClass", "kSubclass")]
        for interfaces in (
            ":%02x%02x00:" % tuple(instrument),
            ":ff0000:%02x%02x01:" % tuple(instrument),  # a second interface; USB488
            ":060101:",  # PTP
            ":ef0500:ef0501:ef0502:",  # USB3 Vision: control, events, stream
        ):
            given = self.usb(interfaces)
            self.assertEqual((given.get("GROUP"), given.get("TAG")), ("plugdev", "uaccess"), interfaces)
        chip = {"ACTION": "add", "SUBSYSTEM": "gpio", "KERNEL": "gpiochip12"}
        given = applied(self.text, chip)
        self.assertEqual((given.get("GROUP"), given.get("MODE"), given.get("TAG")), ("gpio", "0660", None))

    def test_others_are_left_alone(self):
        for interfaces in (":030101:030102:", ":080650:", ":0e0100:0e0200:", ":fe0101:", ":ef0201:", ""):
            self.assertNotIn("GROUP", self.usb(interfaces), interfaces)
        for device in ({"SUBSYSTEM": "gpio", "KERNEL": "gpio17"}, {"SUBSYSTEM": "block", "KERNEL": "sda"}):
            self.assertEqual(applied(self.text, {"ACTION": "add", **device}).get("GROUP"), None, device)
        self.assertEqual(applied(self.text, {"ACTION": "remove", "SUBSYSTEM": "gpio", "KERNEL": "gpiochip0"}).get("GROUP"), None)

    def test_udev_takes_it(self):
        tool = shutil.which("udevadm")
        if not tool or subprocess.run([tool, "verify", "--help"], capture_output=True).returncode:
            self.skipTest("udevadm verify is missing: it comes with systemd 254")
        done = subprocess.run([tool, "verify", "--resolve-names=never", self.file], text=True, capture_output=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


class Judges(unittest.TestCase):
    """What bridges/judges/install installs has one version, and hashes of its archives."""

    folder = ROOT / "bridges/judges"

    def test_packages_of_python_are_pinned(self):
        wanted = {
            re.match(r"[\w-]+", line)[0]
            for line in (self.folder / "requirements.in").read_text().splitlines()
            if line and not line.startswith("#")
        }
        lines = (self.folder / "requirements.txt").read_text().splitlines()
        entries = re.split(r"\n(?=\S)", "\n".join(line for line in lines if not line.lstrip().startswith("#")))
        for entry in entries:
            self.assertRegex(entry, r"\A[\w-]+==[\w.]+[^\n]*( \\\n    --hash=sha256:[0-9a-f]{64})+\Z")
        self.assertEqual(wanted - {entry.split("==")[0] for entry in entries}, set())

    def test_packages_of_node_are_pinned(self):
        wanted = json.loads((self.folder / "package.json").read_text())["dependencies"]
        locked = json.loads((self.folder / "package-lock.json").read_text())["packages"]
        self.assertEqual({f"node_modules/{name}" for name in wanted}, set(locked) - {""})
        for name in wanted:
            self.assertRegex(locked[f"node_modules/{name}"]["integrity"], r"^sha512-")

    def test_nothing_else_is_installed(self):
        script = (self.folder / "install").read_text().replace("\\\n", "")
        for line in script.splitlines():
            if "pip\" install" in line:
                self.assertIn("--require-hashes", line)
                self.assertIn("--no-deps", line)
                self.assertIn("--no-build-isolation", line)
            self.assertNotIn("npm install", line)


if __name__ == "__main__":
    program = sys.argv.pop(1)
    unittest.main()
