#!/usr/bin/env -S python3 -B
"""The mutation run itself: what it finds in a few lines; a small tree from draw to survivors."""

import contextlib
import io
import pathlib
import subprocess
import sys
import tempfile
import unittest

import drawing
import judging
import mistakes
import mutated_tree
import source_text

TOY = """// x + y
namespace toy {
constexpr double kScale = 2.5;  // a choice
double Area(double width, double height) {
  if (width < 0) throw Error("width " + std::to_string(width));
  return width * height;
}
int Largest(const int* value, int count) {
  int largest = value[0];
  for (int i = 1; i < count; ++i) largest = std::max(largest, value[i]);
  Trace("a + b", largest);
  return Clip(largest, count);
}
}  // namespace toy
"""

TREE = {
    "CMakePresets.json": """{"version": 6, "configurePresets": [{"name": "release",
        "generator": "Ninja",
        "binaryDir": "${sourceDir}/build/release"}]}""",
    "CMakeLists.txt": """cmake_minimum_required(VERSION 3.25)
project(toy CXX)
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_FLAGS "-Wall -Wextra -Werror")
find_package(GTest REQUIRED)
enable_testing()
add_executable(core_test core/toy.cc tests/core/toy_test.cc tests/core/note_reached.cc)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/include)
file(CREATE_LINK ${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR}/include/luxfield SYMBOLIC)
target_include_directories(core_test PRIVATE ${CMAKE_BINARY_DIR}/include)
target_link_libraries(core_test GTest::gtest_main)
add_test(NAME core COMMAND core_test)
""",
    # Larger does the same with >= as with >, and no test calls Unseen.
    "core/toy.cc": """#include <cmath>
double Larger(double a, double b) { return a > b ? a : b; }
double Unseen(double a) { return a + 1; }
int Halvings(int n) {
  int count = 0;
  while (n > 1) {
    n = n / 2;
    ++count;
  }
  return count;
}
""",
    "tests/core/toy_test.cc": """#include <gtest/gtest.h>
double Larger(double a, double b);
int Halvings(int n);
TEST(Toy, Larger) {
  EXPECT_EQ(Larger(1, 2), 2);
  EXPECT_EQ(Larger(2, 1), 2);
}
TEST(Toy, Halvings) { EXPECT_EQ(Halvings(9), 3); }
""",
}


class Text(unittest.TestCase):
    def test_what_is_no_code_is_masked(self):
        text = 'a("b + c", \'+\'); // d + e\n#define F (g + \\\n h)\nR"(i + j)" /* k\n + */ l'
        mask = source_text.masked(text)
        self.assertEqual(len(mask), len(text))
        self.assertNotIn("+", mask)
        self.assertEqual(mask.count("\n"), text.count("\n"))
        self.assertTrue(mask.rstrip().endswith("l"))

    def test_expressions_end_at_what_binds_less(self):
        text = "x = cond ? f(a + b, c) * d : std::min<int>(e, 1 - g);"
        for at, expected in (
            ("+", "a + b"),
            ("*", "f(a + b, c) * d"),
            ("-", "1 - g"),
            ("min", "std::min<int>(e, 1 - g)"),
        ):
            start, end = source_text.expression(text, text.index(at))
            self.assertEqual(text[start:end], expected)

    def test_expressions_begin_after_a_keyword(self):
        text = "if (a < 0) return b + returned; else return -c * d;"
        for at, expected in (("+", "b + returned"), ("*", "-c * d"), ("<", "a < 0")):
            start, end = source_text.expression(text, text.index(at))
            self.assertEqual(text[start:end], expected)

    def test_mistakes_of_a_few_lines(self):
        found = {
            (m.line, m.original, " ".join(m.mutated.split()))
            for m in mistakes.in_text("toy.cc", TOY)
        }
        for expected in (
            (6, "width * height", "width / height"),
            (9, "0", "1"),
            (10, "i < count", "i + 1 < count"),
            (10, "std::max(largest, value[i])", "std::min(largest, value[i])"),
            (12, "Clip(largest, count)", "Clip(count, largest)"),
            (11, 'Trace("a + b", largest);', ""),
        ):
            self.assertIn(expected, found)
        self.assertFalse(
            [f for f in found if f[0] in (1, 3, 5)], "comments, choices and words of errors"
        )

    def test_conditions_are_negated_whole(self):
        text = """void F() {
  if (const int n = Count(); n > limit) return;
  if (All(row, [](double x) { return Dark(x); })) return;
}
"""
        negated = {m.mutated for m in mistakes.in_text("toy.cc", text) if "!" in m.mutated}
        self.assertEqual(negated, {"!( n > limit)", "!(All(row, [](double x) { return Dark(x); }))"})

    def test_both_versions_are_there_and_lines_stay(self):
        for mistake in mistakes.in_text("toy.cc", TOY):
            schema = mistake.schema(7)
            self.assertIn("LUXFIELD_MUTANT(7)", schema)
            self.assertIn(mistake.original, schema)
            self.assertEqual(schema.count("\n"), mistake.original.count("\n"))

    def test_rooms_share_by_lines_and_none_is_left_out(self):
        share = drawing.shares({"a": 1000, "b": 900, "c": 10, "d": 2}, 100)
        self.assertGreaterEqual(sum(share.values()), 100)
        self.assertEqual((share["c"], share["d"]), (5, 2))
        self.assertGreater(share["a"], share["b"])

    def test_a_draw_stays_while_files_move_and_other_lines_change(self):
        def drawn(path, text):
            with tempfile.TemporaryDirectory() as folder:
                (pathlib.Path(folder) / path).parent.mkdir(parents=True)
                (pathlib.Path(folder) / path).write_text(text)
                (file,) = drawing.draw(pathlib.Path(folder), 2, 1, ["core"]).values()
                return {(m.before, m.original, m.mutated) for m in file.taken}

        before = drawn("core/toy.cc", TOY)
        self.assertEqual(len(before), 2)
        self.assertEqual(before, drawn("core/deeper/toy.cc", TOY))
        more = "int More(int a) {\n  return a + 5;\n}\n" + TOY
        self.assertGreaterEqual(len(before & drawn("core/toy.cc", more)), 1)
        self.assertNotEqual(before, drawn("core/other.cc", TOY))


class Tree(unittest.TestCase):
    def test_from_draw_to_survivors(self):
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(
            io.StringIO()
        ) as said:
            root = pathlib.Path(folder)
            for name, text in TREE.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
            chosen = drawing.draw(root, 100, 1, ["core"])
            self.assertEqual(sorted(chosen), ["core/toy.cc"])
            self.assertEqual(
                [m.line for m in drawing.draw(root, 100, 1, ["core"])["core/toy.cc"].taken],
                [m.line for m in chosen["core/toy.cc"].taken],
                "a seed draws the same again",
            )
            file = chosen["core/toy.cc"]
            text = file.text

            def mistake(original, mutated, dropped=False):
                start = text.index(original)
                return mistakes.Mistake(
                    "core/toy.cc",
                    source_text.line_of(text, start),
                    start,
                    start + len(original),
                    original,
                    mutated,
                    dropped,
                    "",
                    "",
                )

            file.taken = [
                mistake("a > b", "a >= b"),
                mistake("a + 1", "a - 1"),
                mistake("n > 1", "n < 100"),
                mistake("n / 2", "n + no_such_name"),
            ]
            file.waiting = [mistake("int count = 0", "int count"), mistake("n / 2", "n / 3")]
            tree = mutated_tree.MutatedTree(root, chosen)
            tree.keep(["core", "session"])
            self.assertEqual(list(tree.mutants), [1, 2, 3, 4])
            tree.make(["core_test", "storage_test"])
            self.assertIn("do not compile", said.getvalue())
            self.assertEqual(tree.mutants[4].mutated, "n / 3")
            judge = judging.Judge(tree, 1)
            self.assertFalse(judge.note_all_reached(["core"]))
            self.assertEqual([t.reached for t in judge.tests], [{1}, {3, 4}])
            self.assertFalse(judge.failing())
            judge.tests[1].processor_s = -0.9  # a second for what would never end
            self.assertEqual(judge.judge(1, "core"), (None, 1))
            self.assertEqual(judge.judge(2, "core"), (None, 0))
            self.assertEqual(judge.judge(3, "core")[0][:12], "Toy.Halvings")
            self.assertEqual(judge.judge(4, "core"), ("Toy.Halvings", 1))
            with open(root / "core/toy.cc") as source:
                self.assertEqual(source.read(), TREE["core/toy.cc"])


if __name__ == "__main__":
    unittest.main()
