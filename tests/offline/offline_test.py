#!/usr/bin/env -S python3 -B
"""Compilers of GPUs that are not here take every program of the renderer, and leave no function to find elsewhere.

  tests/offline/offline_test.py WRITE_PROGRAMS     the built write_programs

clang's OpenCL for AMD's gfx1030 and NVIDIA's sm_89 with libclc, as drivers use it. Nothing is inlined: a function that
is C99's `inline` without `static` has no body to call wherever a driver's compiler decides so, too.
"""

import concurrent.futures
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).parents[2]
CLANG, NM = "clang-16", "llvm-nm-16"
LIBRARY = pathlib.Path("/usr/lib/clc")
# -D__OPENCL_VERSION__: drivers define it, clang itself does not. Of a file's functions each program calls some.
CLANG_WORDS = [CLANG, "-x", "cl", "-Xclang", "-finclude-default-header", "-D__OPENCL_VERSION__=120", "-nogpulib", "-O0",
               "-Wall", "-Wmissing-prototypes", "-Wno-unused-function", "-Wno-linker-warnings"]
TARGETS = {"AMD": ["-target", "amdgcn-amd-amdhsa", "-mcpu=gfx1030"],
           "NVIDIA": ["-target", "nvptx64-nvidia-nvcl", "-Xclang", "-target-cpu", "-Xclang", "sm_89",
                      "-Xclang", "-target-feature", "-Xclang", "+ptx78"]}
LIBRARIES = {"AMD": LIBRARY / "amdgcn--amdhsa.bc", "NVIDIA": LIBRARY / "nvptx64--nvidiacl.bc"}


def what_is_missing():
    return [str(name) for name in (CLANG, NM) if not shutil.which(name)] + \
        [str(path) for path in LIBRARIES.values() if not path.exists()]


def compile_program(target, source, options, output, *words):
    """What the compiler says, or "" if it says nothing."""
    library = ["-Xclang", "-mlink-builtin-bitcode", "-Xclang", str(LIBRARIES[target])]
    done = subprocess.run([*CLANG_WORDS, *TARGETS[target], *library, *options.split(), *words, str(source),
                           "-o", str(output)], capture_output=True, text=True)
    return done.stderr or ("" if done.returncode == 0 else f"{CLANG}: exit code {done.returncode}")


def undefined(binary):
    return subprocess.run([NM, "--undefined-only", "--just-symbol-name", str(binary)], capture_output=True, text=True,
                          check=True).stdout.split()


class Offline(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        listed = subprocess.run([WRITE_PROGRAMS, folder.name], capture_output=True, text=True, check=True).stdout
        cls.programs = [line.split("\t") for line in listed.splitlines()]

    def judge(self, programs, problem_of):
        """`problem_of` each program is "", on all processors that this process may use."""
        with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as threads:
            problems = list(threads.map(lambda program: problem_of(*program), programs))
        wrong = [f"{path} with '{options}':\n{problem}" for (_, path, options), problem in zip(programs, problems)
                 if problem]
        if wrong:
            self.fail(f"{len(wrong)} of {len(programs)} programs:\n" + "\n".join(wrong[:5]))

    def test_every_kernel_file_is_among_the_programs(self):
        files = {str(path.relative_to(ROOT / "render")) for path in (ROOT / "render/kernels").rglob("*.cl")}
        self.assertEqual({path for _, path, _ in self.programs}, files)

    def test_every_program_compiles_without_a_warning_and_defines_what_it_calls(self):
        def problem(number, _, options):
            output = self.folder / f"{number}.bc"
            said = compile_program("AMD", self.folder / f"{number}.cl", options, output, "-c", "-emit-llvm")
            return said or " ".join(undefined(output))

        self.judge(self.programs, problem)

    def test_code_is_made_of_the_fullest_program_of_each_file(self):
        fullest = list({path: [number, path, options] for number, path, options in self.programs}.values())
        for target, words in {"AMD": ["-c"], "NVIDIA": ["-c", "-emit-llvm"]}.items():
            def problem(number, _, options):
                source, output = self.folder / f"{number}.cl", self.folder / f"{number}.{target}"
                said = compile_program(target, source, options, output, *words)
                if not said and target == "NVIDIA":  # whose code is a text
                    said = compile_program(target, source, options, os.devnull, "-S")
                return said or " ".join(undefined(output))

            with self.subTest(target):
                self.judge(fullest, problem)


if __name__ == "__main__":
    missing = what_is_missing()
    if missing:
        print(f"SKIPPED: tests/offline: {', '.join(missing)} missing; install clang-16, llvm-16 and libclc-16")
        sys.exit(77)
    WRITE_PROGRAMS = sys.argv.pop(1)
    unittest.main()
