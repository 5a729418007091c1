#!/usr/bin/env -S python3 -B
"""What the checks of comments and docs find in a tree of a few lines, and that they find nothing in this one."""

import pathlib
import subprocess
import tempfile
import unittest

HERE = pathlib.Path(__file__).parent

THEORY = """# Theory

## 1 Frames

**Two planes.** F and I.

1. First
2. Second

## 7 Irradiance (derived)
"""


WHOLE = """// Two planes, a distance of delta apart, and what a receiver on the axis sees from in front of them
// (Gershun), in metres, which are:
//   - a list's item that is as long as the line allows, and which goes on in the following line as
//     prose does, x = 1
//
//   J(p) = delta^2 / z^3 * sum_m integral_F C_m(s(u)) Phi_m(u) (u - p) du + a term of that length
//   E_n = n . J(p)
//   var(X) = (sum r_m mu_m)^2 + sum_m (sum over texels of r_m s_m)^2
//            + (sum r_m s_m / sqrt(n_m))^2
//
//   label      what stands beside it, up to the end of the line and farther, with x = y in it and
//              more of the same, x^2
struct A {};
"""

# Each is found once, in its second line.
BROKEN = [
    ("runs over", "// The light of all receivers, seen from where the lamp stands, by b =\n// a + c.\n"),
    ("runs over", "// The light of all receivers, seen from where the lamp stands, by b\n// = a + c.\n"),
    ("runs over", "// The light of all receivers, which is near exp(-4 pi^2\n// k^2 R) of it.\n"),
    ("runs over", "  int a = 0;  // the number of texels, which is W +\n              // n - 1\n"),
    ("runs over", "// The light of all receivers that stand before the lamp and see it under a small angle, sqrt(1\n"
                  "// - q^2).\n"),
    ("runs over", "//   J(p) = delta^2 / z^3 * sum_m integral_F C_m(s(u)) Phi_m(u) (u - p) du,   z\n"
                  "//   = delta + D\n"),
    ("filled", "//   y = black + gain * t * (a X + dark_current) + noise and its rounding,   X in electrons per\n"
               "//   second var(y) = gain * (y - black) + read_noise^2\n"),
    ("fell back", "//   angular map          what the viewer sees, straight behind him on the rim: angle to forward pi\n"
                  "//   r,\n"),
]


def in_full(text):
    """Names of pages written short, so that they are no citations of this file."""
    return text.replace("@", "docs/theory.md").replace("GONE", "GONE." + "md")


class Check(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = pathlib.Path(self.folder.name)
        self.write("docs/theory.md", THEORY)

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(in_full(text), encoding="utf-8")

    def run_check(self, check, root):
        done = subprocess.run([HERE / check, root], capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr

    def found(self, check):
        """What the check says of the small tree, less its last line, which counts."""
        status, output = self.run_check(check, self.root)
        lines = output.splitlines()[:-1]
        self.assertEqual(status, 1 if lines else 0, output)
        return lines

    def find_none_here(self, check):
        status, output = self.run_check(check, HERE.parents[1])
        self.assertEqual(status, 0, output)


class Citations(Check):
    def test_this_tree_cites_what_is_there(self):
        self.find_none_here("check_citations")

    def test_right_citations_pass(self):
        self.write("core/a.h", '// E (@ 1 and 7), @ 1.2, @ 7, "Irradiance",\n'
                   '// @\n// 1, "Two planes"; 50 of 9 in @.\n')
        self.write("docs/lab.md", "[theory](theory.md) 7 and [this](../core/a.h), `@` 1\n")
        self.assertEqual(self.found("check_citations"), [])

    def test_wrong_citations_are_found(self):
        for text, complaint in [
                ("// X (GONE).", "cites GONE, which is not in the tree"),
                ("// X (@ 8).", "cites section 8 of @"),
                ("// X (@\n// 8).", "cites section 8 of @"),
                ('// X (@ 1, "Two planes", and 9).', "cites section 9 of @"),
                ("// X (@ 1.3).", "cites section 1.3 of @"),
                ("// X (@ 1 and 9).", "cites section 9 of @"),
                ("// @'s sections 1 and 9.", "cites section 9 of @"),
                ('// X (@ 1, "Three\n// planes").', 'cites "Three planes" of @')]:
            with self.subTest(text):
                self.write("core/a.h", text + "\n")
                [line] = self.found("check_citations")
                self.assertIn("core/a.h: " + in_full(complaint), line)

    def test_dead_links_are_found(self):
        self.write("docs/lab.md", "[theory](docs/theory.md), [page](https://example.org/x.md)\n")
        [line] = self.found("check_citations")
        self.assertIn("docs/lab.md: links to docs/theory.md", line)


class FormulaBlocks(Check):
    def test_this_tree_has_none_that_is_broken(self):
        self.find_none_here("find_formula_blocks")

    def test_whole_formulas_pass(self):
        self.write("core/a.h", WHOLE)
        self.assertEqual(self.found("find_formula_blocks"), [])

    def test_broken_formulas_are_found(self):
        for kind, text in BROKEN:
            with self.subTest(text):
                self.write("core/a.h", text)
                lines = self.found("find_formula_blocks")
                self.assertEqual(lines[0], f"core/a.h:2: {kind}")
                self.assertEqual(len(lines), 3)


class LongLines(Check):
    def test_pages_of_this_tree_are_wrapped(self):
        self.find_none_here("find_long_lines")

    def test_lines_that_cannot_be_shorter_pass(self):
        long = "word " * 30
        self.write("docs/lab.md", f"{'a' * 110}\n\n    {long}\n| {long} |\n```\n{long}\n```\n"
                   f"* [{'b' * 60}](https://example.org/{'c' * 60})\n[d]: https://example.org/{'e' * 100}\n")
        self.write("core/a.h", f"// {long}\n")
        self.assertEqual(self.found("find_long_lines"), [])

    def test_long_lines_are_found(self):
        for text in [f"{'a' * 55} {'b' * 55}", f"* {'word ' * 22}", f"{'word ' * 21}and [a page](theory.md)",
                     f"\u00e4 {'word ' * 22}"]:
            with self.subTest(text):
                self.write("docs/lab.md", f"# Lab\n\n{text}\n")
                [line] = self.found("find_long_lines")
                self.assertTrue(line.startswith("docs/lab.md:3: "), line)


if __name__ == "__main__":
    unittest.main()
