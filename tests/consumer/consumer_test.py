#!/usr/bin/env -S python3 -B
"""A foreign project with luxfield installed, as part of it, and by pkg-config; what the installed headers let in.

    tests/consumer/consumer_test.py BUILD_FOLDER
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[1]
INCLUDE = re.compile(r"^#include [\"<]luxfield/([^\">]+)[\">]", re.M)
# Types of the command line, of JSON, of logs and of libraries that are ours to choose.
FOREIGN = re.compile(r"\bcl_\w+|\bCL/|\bCLI\b|nlohmann|\bglog\b|google::|\btoml::|opencv2|\bcv::|ceres|fmt::|<Eigen|<tbb")
build = pathlib.Path()


def run(*words, **more):
    done = subprocess.run(
        [str(word) for word in words], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more
    )
    if done.returncode:
        raise AssertionError(f"{words} ended with {done.returncode}:\n{done.stdout}")
    return done.stdout


def configure(source, folder, *options):
    return run("cmake", "-S", source, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", *options)


class Consumer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="luxfield_consumer_"))
        cls.prefix = cls.folder / "prefix"
        run("cmake", "--install", build, "--prefix", cls.prefix)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def expect_flux(self, program):
        said = run(program, self.folder / "lamp.lf.exr")
        version = re.search(r"project\(luxfield VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]
        self.assertEqual(said, f"luxfield {version}: 4.8e-06 W\n")

    def test_installed(self):
        folder = self.folder / "installed"
        configure(HERE, folder, f"-DCMAKE_PREFIX_PATH={self.prefix}")
        cache = (folder / "CMakeCache.txt").read_text()
        for other in ("OpenCL", "Ceres", "embree", "OPENCV", "LIBUSB"):
            self.assertNotIn(other, cache, "libraries that luxfield::lightfield does not need")
        run("cmake", "--build", folder)
        self.expect_flux(folder / "consumer")

    def test_installed_program(self):
        program = self.prefix / "bin/luxfield"
        environment = {**os.environ, "PATH": "/usr/bin:/bin"}
        lamp = ROOT / "data/scenes/garage.toml"
        self.assertIn("garage", run(program, "info", lamp, cwd="/", env=environment))
        for verb in ("render", "bench", "view"):  # each another program
            said = run(program, verb, "--help", cwd="/", env=environment)
            self.assertIn(f"luxfield {verb}", said)

    def test_part_of_another_project(self):
        folder = self.folder / "part"
        launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
        configure(HERE, folder, f"-DLUXFIELD_SOURCE={ROOT}", "-DLUXFIELD_COMPONENTS=lightfield", *launcher)
        wanted = run("ninja", "-C", folder, "-n", "-v")
        built = set(re.findall(r"luxfield_(\w+)\.dir", wanted))
        self.assertEqual(built, {"core", "lightfield"})
        run("cmake", "--build", folder)
        self.expect_flux(folder / "consumer")

    def test_all_of_luxfield_as_part_of_another_project_builds_what_is_linked(self):
        folder = self.folder / "all"
        configure(HERE, folder, f"-DLUXFIELD_SOURCE={ROOT}")
        built = set(re.findall(r"luxfield_(\w+)\.dir", run("ninja", "-C", folder, "-n", "-v")))
        self.assertEqual(built, {"core", "lightfield"})

    def test_unknown_component(self):
        (self.folder / "unknown").mkdir()
        (self.folder / "unknown/CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(unknown LANGUAGES CXX)\n"
            "find_package(luxfield CONFIG REQUIRED COMPONENTS lightfield glow)\n"
        )
        with self.assertRaisesRegex(AssertionError, "(?s)no\\s+component\\s+'glow'"):
            configure(self.folder / "unknown", self.folder / "unknown/build", f"-DCMAKE_PREFIX_PATH={self.prefix}")

    def test_docs_show_this_program(self):
        self.assertIn("```cpp\n" + (HERE / "main.cc").read_text() + "```", (ROOT / "docs/library.md").read_text())

    def test_pkg_config(self):
        paths = [str(path) for path in self.prefix.rglob("pkgconfig")]
        self.assertEqual(len(paths), 1)
        environment = {**os.environ, "PKG_CONFIG_PATH": paths[0]}
        flags = run("pkg-config", "--cflags", "--libs", "luxfield-lightfield", env=environment).split()
        program = self.folder / "by_pkg_config"
        run(os.environ.get("CXX", "c++"), HERE / "main.cc", *flags, "-o", program)
        self.expect_flux(program)

    def test_installed_headers_include_each_other_and_let_nothing_foreign_in(self):
        top = self.prefix / "include/luxfield"
        headers = sorted(path.relative_to(top).as_posix() for path in top.rglob("*.*h"))
        self.assertIn("lightfield/light_field.h", headers)
        self.assertIn("preprocess/sampler.h", headers)
        for header in headers:
            text = (top / header).read_text()
            for included in INCLUDE.findall(text):
                self.assertIn(included, headers, f"{header} includes it")
            code = re.sub(r"//.*", "", text)
            self.assertIsNone(FOREIGN.search(code), f"{header}: {FOREIGN.search(code)}")
        every = self.folder / "every.cc"
        every.write_text("".join(f"#include <luxfield/{header}>\n" for header in headers))
        run(os.environ.get("CXX", "c++"), "-std=c++20", "-fsyntax-only", f"-I{self.prefix}/include", every)


if __name__ == "__main__":
    build = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main()
