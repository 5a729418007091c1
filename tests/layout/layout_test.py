#!/usr/bin/env -S python3 -B
"""What check_layout finds in a tree of a few lines, that it finds nothing in this one, and that the benches can be left
out of a build."""

import pathlib
import subprocess
import tempfile
import unittest

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[1]

ARROWS = """# comment
core:
core/deep: core
upper:     core core/deep  # another
"""

TREE = {
    "tests/layout/arrows.txt": ARROWS,
    "core/CMakeLists.txt": "luxfield_room(core SOURCES\n  low.cc\n  deep/under.cl)\n",
    "core/low.h": "",
    "core/low.cc": '#include "luxfield/core/low.h"\n',
    "core/deep/under.h": '#include "luxfield/core/low.h"\n',
    "core/deep/under.cl": "",
    "upper/CMakeLists.txt": "luxfield_room(upper SOURCES\n  top.cc)\n",
    "upper/top.cc": '#include "luxfield/core/deep/under.h"\n#include "luxfield/core/low.h"\n',
    "upper/main.cc": '#include "luxfield/no_room/is_looked_at.h"\n',
}

# A change of one file, and what is said of it.
WRONG = [
    ("core/low.cc", '#include "luxfield/upper/top.h"\n', "core -> upper is no arrow"),
    ("core/low.cc", '#include "luxfield/core/gone.h"\n', "core/gone.h, which is not there"),
    ("core/other.cc", "", "core/other.cc is not in core/CMakeLists.txt"),
    ("core/deep/other.cl", "", "core/deep/other.cl is not in core/CMakeLists.txt"),
    ("upper/new/file.h", "", "upper/new/ is no room"),
    ("upper/top.cc", '#include "luxfield/core/low.h"\n', "upper -> core/deep is not needed"),
    ("tests/layout/arrows.txt", ARROWS.replace("core:", "core: upper"), "does not stand above it"),
    ("tests/layout/arrows.txt", ARROWS.replace("core/deep: core", "core/deep: core gone"), "no room of the table"),
]


def check(root):
    return subprocess.run([HERE / "check_layout", root], text=True, capture_output=True)


class Layout(unittest.TestCase):
    def test_this_tree_is_as_its_table_says(self):
        done = check(ROOT)
        self.assertEqual((done.returncode, done.stdout), (0, "0 wrong arrows and lists\n"))

    def test_a_whole_tree_and_each_mistake(self):
        for name, text, said in [(None, "", ""), *WRONG]:
            with tempfile.TemporaryDirectory() as folder, self.subTest(said):
                for path, content in {**TREE, **({name: text} if name else {})}.items():
                    file = pathlib.Path(folder) / path
                    file.parent.mkdir(parents=True, exist_ok=True)
                    file.write_text(content)
                done = check(folder)
                self.assertEqual(done.returncode, 1 if name else 0, done.stdout + done.stderr)
                self.assertIn(said, done.stdout)

    def test_benches_can_be_left_out(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(
                ["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", "-DLUXFIELD_BUILD_BENCH=OFF"],
                check=True,
                capture_output=True,
            )
            build = (pathlib.Path(folder) / "build.ninja").read_text()
        self.assertIn("luxfield_cli", build)
        for name in ("luxfield_bench", "device_bench"):
            self.assertNotIn(name, build)


if __name__ == "__main__":
    unittest.main()
