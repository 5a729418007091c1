"""Which tests reach which mutant, and whether one of them fails with it."""

import concurrent.futures
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile

# Tests of a room by CTest's names: its own, and chains of rooms where what it does is tested by them.
# Those of the whole lab and of a kernel's drivers are left out.
PROGRAMS = {
    "core": ["core", "storage"],
    "session": ["session", "storage"],
    "rig": ["hal", "capture", "physics", "reconstruct"],
    "hal": ["hal", "usbtmc", "gpiod", "gphoto2", "aravis", "transports", "physics"],
    "pictures": ["reconstruct", "scene"],
    "reconstruct": ["reconstruct", "physics"],
    "kernels": ["render"],
    "planning": ["planning", "physics"],
    "bench": ["bench", "planning", "e2e"],
    "cli": ["e2e"],
    "device_bench": ["device_bench", "e2e"],
}
BATCH_S = 2  # cheap tests share a process up to this
KERNEL_ERROR = re.compile(
    r"error: (kernels/[\w./]+):(\d+):|(kernels/[\w./]+):(\d+):\d+: error:"
)  # PoCL, others
LIMITS = 'ulimit -c 0; ulimit -t "$1"; ulimit -d 16000000; shift; exec "$@"'


def programs_of(room):
    return PROGRAMS.get(room, [room])


class Test:
    def __init__(self, program, line):
        self.program = program
        name, passed, processor_s, wall_s, reached = line.rstrip("\n").split("\t")
        self.name, self.passed = name, passed == "1"
        self.processor_s, self.wall_s = float(processor_s), float(wall_s)
        self.reached = {int(n) for n in reached.split()}


class Judge:
    def __init__(self, tree, jobs):
        self.tree, self.jobs = tree, jobs
        self.base = tree.root / "build/mutants"
        shown = subprocess.run(
            ["ctest", "--show-only=json-v1"],
            cwd=tree.build,
            text=True,
            capture_output=True,
            check=True,
        )
        self.commands, self.serial = {}, set()
        for test in json.loads(shown.stdout)["tests"]:
            if "command" not in test:
                continue  # not built: of no room that is asked for
            program = test["name"].split(".")[0]  # ROOM.SUITE; one program holds all suites of a room
            self.commands[program] = [
                word for word in test["command"] if not word.startswith("--gtest_filter=")
            ]
            if any(p["name"] == "RUN_SERIAL" and p["value"] for p in test.get("properties", [])):
                self.serial.add(program)
        self.tests = []

    def environment(self, number, folder, **more):
        shared = self.tree.root.parent / "shared/data"
        caches = {
            "XDG_CACHE_HOME": str(self.base / "cache"),
            "POCL_CACHE_DIR": str(self.base / "pocl"),
        }
        data = (
            {"LUXFIELD_TEST_DATA": str(shared)}
            if shared.is_dir() and "LUXFIELD_TEST_DATA" not in os.environ
            else {}
        )
        (self.base / "pocl").mkdir(exist_ok=True)
        return {
            **os.environ,
            **caches,
            **data,
            **more,
            "LUXFIELD_MUTANT": str(number),
            "TMPDIR": folder,
        }

    def run(self, number, program, arguments, processor_s, wall_s, **more):
        """Exit status and output. What a test leaves behind goes with its folder and its group."""
        folder = tempfile.mkdtemp(prefix="lxm")
        limited = [
            "sh",
            "-c",
            LIMITS,
            "sh",
            str(int(processor_s)),
            *self.commands[program],
            *arguments,
        ]
        with tempfile.TemporaryFile("w+", errors="replace") as output:
            process = subprocess.Popen(
                limited,
                cwd=self.tree.build,
                env=self.environment(number, folder, **more),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                status = process.wait(timeout=wall_s)
            except subprocess.TimeoutExpired:
                status = -signal.SIGKILL
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            process.wait()
            output.seek(0)
            text = output.read()
        shutil.rmtree(folder, ignore_errors=True)
        return status, text

    def made_of(self, program):
        """When the youngest file was made by which what a program's tests reach may differ."""
        files = [self.tree.build / f"{program}_test"]
        if program == "e2e":
            files += [*self.tree.build.glob("luxfield*"), self.tree.build / "device_bench"]
        return max(file.stat().st_mtime for file in files)

    def note_reached(self, program):
        """Runs a program once without a mutant; returns places of kernels that do not build."""
        reached, tests = self.base / f"{program}.reached", self.base / f"{program}.tests"
        if not tests.exists() or self.made_of(program) > tests.stat().st_mtime:
            unfinished = self.base / f"{program}.unfinished"
            unfinished.unlink(missing_ok=True)
            reached.write_bytes(bytes(max(self.tree.mutants) + 1))
            status, text = self.run(
                -1,
                program,
                [],
                3600,
                7200,
                LUXFIELD_MUTANT_REACHED=str(reached),
                LUXFIELD_MUTANT_TESTS=str(unfinished),
            )
            errors = {(a or c, int(b or d)) for a, b, c, d in KERNEL_ERROR.findall(text)}
            if errors:
                return errors
            if not unfinished.exists():
                raise SystemExit(
                    f"mutants: {program}_test does not run (status {status}):\n{text[-2000:]}"
                )
            unfinished.rename(tests)
        with open(tests) as lines:
            self.tests += [Test(program, line) for line in lines]
        return set()

    def note_all_reached(self, programs):
        """The renderer first: where its kernels do not build, nothing else is worth noting."""
        self.tests, errors = [], set()
        if "render" in programs:
            errors = self.note_reached("render")
            if errors:
                return errors
        programs = [p for p in programs if p != "render"]
        together = [p for p in programs if p not in self.serial]
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            for found in pool.map(self.note_reached, together):
                errors |= found
        for program in programs:
            if program in self.serial:
                errors |= self.note_reached(program)
        return errors

    def failing(self):
        return [t for t in self.tests if not t.passed]

    def batches(self, number, room):
        """The room's tests that reach the mutant, cheapest first."""
        mine = [
            t
            for t in self.tests
            if t.passed and number in t.reached and t.program in programs_of(room)
        ]
        batches = []
        for test in sorted(mine, key=lambda t: (t.processor_s + 0.1 * t.wall_s, t.name)):
            last = next(
                (
                    b
                    for b in batches
                    if b[0].program == test.program
                    and sum(t.processor_s for t in b) + test.processor_s < BATCH_S
                    and len(b) < 100
                ),
                None,
            )
            if last:
                last.append(test)
            else:
                batches.append([test])
        return batches

    def fails(self, number, batch):
        program = batch[0].program
        arguments = [
            "--gtest_filter=" + ":".join(t.name for t in batch),
            "--gtest_fail_fast",
            "--gtest_brief=1",
        ]
        processor_s = 10 + 10 * sum(t.processor_s for t in batch)
        wall_s = 60 + 20 * sum(t.wall_s for t in batch)
        status, text = self.run(number, program, arguments, processor_s, wall_s)
        if status == 0:
            return None
        if program in self.serial and self.run(0, program, arguments, processor_s, wall_s)[0] != 0:
            return None  # on a busy machine it fails without the mutant too
        found = re.search(r"\[  FAILED  \] ([\w./]+)", text)
        return found[1] if found else f"{batch[0].name} ... (status {status})"

    def judge(self, number, room):
        """What noticed the mutant, or None; and how many tests reach it."""
        batches = self.batches(number, room)
        for batch in batches:
            killer = self.fails(number, batch)
            if killer:
                return killer, sum(map(len, batches))
        return None, sum(map(len, batches))
