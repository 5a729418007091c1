"""A copy of the tree with all mutants compiled in."""

import os
import pathlib
import re
import shutil
import subprocess

import drawing
import source_text

HERE = pathlib.Path(__file__).parent
NOT_COPIED = {"build", "out", ".git"}
COMPILER_ERROR = re.compile(
    r"^(\S+?):(\d+):(?:\d+:)?\s+(?:(?:fatal )?error:|required from here)", re.M
)
# Kernels are built when they are run: this is where.
KERNEL_BUILDER = "render/device/program.cc"
KERNEL_TEXT = "source = ResolveIncludes(text, name);"
KERNEL_TEXT_WITH_MUTANT = "source = luxfield_mutants::WithMutant(ResolveIncludes(text, name));"


class MutatedTree:
    """`chosen`: files with mistakes taken (drawing.File), by path."""

    def __init__(self, root, chosen):
        self.root, self.chosen = pathlib.Path(root), chosen
        self.tree = self.root / "build/mutants/tree"
        self.build = self.tree / "build/release"
        self.mutants = {}  # number: mistake
        for file in chosen.values():
            for mistake in file.taken:
                self.mutants[len(self.mutants) + 1] = mistake
        # What did not compile last time need not be tried again.
        self.broken = self.root / "build/mutants/not_compiling"
        known = set(self.broken.read_text().splitlines()) if self.broken.exists() else set()
        while hit := [n for n, m in self.mutants.items() if m.change() in known]:
            for number in hit:
                self.take_another(number)

    def keep(self, rooms):
        """Only the mutants of these rooms, with the numbers that they have in the whole draw."""
        self.mutants = {n: m for n, m in self.mutants.items() if drawing.room_of(m.path) in rooms}

    def text(self, path, original):
        mine = [(n, m) for n, m in self.mutants.items() if m.path == path]
        text = original
        for number, mistake in sorted(mine, key=lambda pair: -pair[1].start):
            text = text[: mistake.start] + mistake.schema(number) + text[mistake.end :]
        if path == KERNEL_BUILDER:
            assert (
                text.count(KERNEL_TEXT) == 1
            ), "where kernels are built has changed: see KERNEL_TEXT"
            text = text.replace(KERNEL_TEXT, KERNEL_TEXT_WITH_MUTANT)
        elif not mine or not path.endswith(".cc"):
            return text
        return '#include "luxfield/core/luxfield_mutant.h"\n#line 1\n' + text

    def write(self):
        """Files that stay as they were keep their time, so that nothing of them is built again."""
        wanted = {}
        for folder, folders, names in os.walk(self.root):
            if pathlib.Path(folder) == self.root:
                folders[:] = [f for f in folders if f not in NOT_COPIED]
            for name in names:
                path = (pathlib.Path(folder) / name).relative_to(self.root).as_posix()
                wanted[path] = None
        for path in ["core/luxfield_mutant.h"] + sorted(
            {
                f"{p.rsplit('/', 1)[0]}/note_reached.cc"
                for p in wanted
                if p.startswith("tests/") and p.endswith("_test.cc")
            }
        ):
            wanted[path] = HERE / path.rsplit("/", 1)[1]
        for path, source in wanted.items():
            source, target = source or self.root / path, self.tree / path
            content = source.read_bytes()
            if path in self.chosen or path == KERNEL_BUILDER:
                content = self.text(path, content.decode()).encode()
            if not target.exists() or target.read_bytes() != content:
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(content)
                shutil.copymode(source, target)
        for folder, folders, names in os.walk(self.tree):
            if pathlib.Path(folder) == self.tree:
                folders[:] = [f for f in folders if f != "build"]
            for name in names:
                path = (pathlib.Path(folder) / name).relative_to(self.tree).as_posix()
                if path not in wanted:
                    (self.tree / path).unlink()

    def replace(self, errors):
        """Mutants at these places do not compile: others of their files take their numbers."""
        distances = {}  # by file: of each of its mutants to the nearest error
        for path, line in errors:
            for number, m in self.mutants.items():
                if path.endswith("/" + m.path) or m.path.endswith("/" + path):
                    first = source_text.line_of(self.chosen[m.path].text, m.start)
                    last = first + m.original.count("\n")
                    distance = max(first - line, line - last, 0)
                    of_file = distances.setdefault(m.path, {})
                    of_file[number] = min(distance, of_file.get(number, distance))
        hit = [
            n
            for of_file in distances.values()
            for n, d in of_file.items()
            if d == min(of_file.values())
        ]
        self.broken.parent.mkdir(parents=True, exist_ok=True)
        with open(self.broken, "a") as broken:
            for number in sorted(hit):
                broken.write(self.mutants[number].change() + "\n")
                self.take_another(number)
        return len(hit)

    def take_another(self, number):
        file = self.chosen[self.mutants[number].path]
        file.taken.remove(self.mutants[number])
        if file.take():
            self.mutants[number] = file.taken[-1]
        else:
            del self.mutants[number]

    def make(self, programs):
        """Builds those of the programs that there are here; what does not compile is replaced."""
        while True:
            self.write()
            if not (self.build / "build.ninja").exists():
                self.build.mkdir(parents=True, exist_ok=True)
                subprocess.run(
                    ["cmake", "--preset", "release"],
                    cwd=self.tree,
                    check=True,
                    stdout=subprocess.DEVNULL,
                )
            known = subprocess.run(
                ["ninja", "-t", "targets", "all"], cwd=self.build, text=True, capture_output=True
            )
            there = {line.split(":")[0] for line in known.stdout.splitlines()}
            done = subprocess.run(
                ["ninja", "-k", "0", *(p for p in programs if p in there)],
                cwd=self.build,
                text=True,
                capture_output=True,
            )
            if done.returncode == 0:
                return
            errors = {(p, int(n)) for p, n in COMPILER_ERROR.findall(done.stdout)}
            replaced = self.replace(errors)
            print(f"mutants: {replaced} do not compile, others are taken", flush=True)
            if not replaced:
                raise SystemExit(
                    "mutants: the copy of the tree does not build:\n" + done.stdout[-4000:]
                )
