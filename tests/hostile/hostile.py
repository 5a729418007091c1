"""Hostile inputs over every verb and file kind; see docs/testing.md.

    hostile.py ZYGOTE [--cases N] [--first N] [--seed S] [--only K] [--keep FOLDER] [--processes N] [--of WORDS]

Case K of seed S is the same in every run, and another one with --of: `--only K` runs it alone, shows
what it gave and, with --keep, leaves its folder. Ends with a line `hostile N cases, F failed`, and 1 if any did."""

import argparse
import collections
import json
import multiprocessing
import os
import random as randomness
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cases
import corpus
import mutate

PROCESSOR_S, WALL_S, MOST_BYTES = 20, 240, 2 << 30
OWN_CACHE = Path(tempfile.gettempdir()) / f"luxfield-hostile-cache-{os.getuid()}"


class Zygote:
    """The program, forked for each run (zygote.cc)."""

    def __init__(self, program):
        environment = dict(
            os.environ, XDG_CACHE_HOME=str(OWN_CACHE), HOME="/nonexistent", LC_ALL="C.UTF-8"
        )
        self.process = subprocess.Popen(
            [program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment
        )

    def run(self, folder, words, streams=None, limits=None):
        request = {"folder": str(folder), "words": words, "limits": limits or {}, "wall_s": WALL_S,
                   "processor_s": PROCESSOR_S}  # fmt: skip
        request |= streams or {"stdin": "/dev/null", "stdout": "/dev/null", "stderr": "/dev/null"}
        self.process.stdin.write(json.dumps(request).encode() + b"\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def copy(source, target):
    if source.is_dir():
        shutil.copytree(source, target)
    else:
        shutil.copyfile(source, target)


def signature(path):
    """Enough to tell a file that was changed: None where it is absent."""
    try:
        status = path.lstat()
    except OSError:
        return None
    return status.st_ino, status.st_size, status.st_mtime_ns


def complaints(case, folder, answer, before):
    """What is wrong with how the program took the case."""
    wrong = []
    exit_code = answer.get("exit")
    if "signal" in answer:
        wrong.append(
            "hang"
            if answer["late"] or answer["signal"] in (24, 9)
            else f"signal {answer['signal']}"
        )
    elif exit_code not in (0, 2, 3, 4):
        wrong.append(f"exit {exit_code}")
    if answer["late"]:
        wrong.append(f"hang: not done in {WALL_S} s")
    if answer["left"]:
        wrong.append("left a process behind")
    if answer["processor_s"] > PROCESSOR_S:
        wrong.append(f"{answer['processor_s']:.1f} s of processor time")
    if answer["peak_bytes"] > MOST_BYTES:
        wrong.append(f"{answer['peak_bytes'] / 2**30:.2f} GiB of memory")
    for path in [*folder.rglob(".*"), *folder.glob("*/scratch/*")]:
        if path.name not in before and path.name != ".":
            wrong.append(f"left {path.relative_to(folder)}")
    errors = (folder / "err").read_bytes() if (folder / "err").is_file() else b""
    # Whole files, of which only what was printed is lost.
    whole = exit_code == 3 and (case.streams["stdout"] != "out" or "fsize" in case.limits)
    unnamed = set(case.template.outputs.split()) - set(case.template.words.split())
    for name in case.template.outputs.split():
        if (
            (name in case.words or name in unnamed)
            and exit_code in (2, 3)
            and not whole
            and signature(folder / name) != before.get(name)
        ):
            wrong.append(f"exit {exit_code} with an output: {name}")
    if exit_code == 2 and case.streams["stderr"] == "err" and "fsize" not in case.limits:
        lines = [line for line in errors.decode("utf8", "replace").splitlines()]
        sentences = [line for line in lines if re.match(r"luxfield: (?!warning: )", line)]
        others = [line for line in lines if not line.startswith("luxfield: ")]
        if len(sentences) != 1 or (others and "--quiet" in case.words):
            wrong.append(f"{len(sentences)} sentences and {len(others)} other lines on stderr")
    printed = errors + ((folder / "out").read_bytes() if (folder / "out").is_file() else b"")
    if re.search(rb"[\x00-\x08\x0b-\x1f\x7f]|\xc2[\x80-\x9f]", printed):
        wrong.append("control characters are printed")
    if b"internal error" in errors and exit_code != 1:
        wrong.append("says internal error")
    return wrong


def content(folder):
    """Of a session, but for its lock."""
    return {
        path.relative_to(folder): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "LOCK"
    }


def wrong_bytes(case, source, folder, must_be):
    """Outputs that are not the corpus' own, or not there."""
    wrong = []
    for name, _, right in (item.partition("=") for item in case.template.right.split()):
        if not (folder / name).is_file():
            wrong += [f"exit 0 without {name}"] * must_be
        elif (folder / name).read_bytes() != (source / right).read_bytes():
            wrong.append(f"wrong bytes: {name}")
    return wrong


def prepare(zygote, case, folder):
    for line in filter(None, case.template.before.split("; ")):
        answer = zygote.run(folder, line.split() + ["--quiet"])
        if answer.get("exit") != 0:
            raise RuntimeError(f"luxfield {line}: {answer}")


def run_case(zygote, seed, number, source, folder, of=""):
    """(case, answer, complaints) of case `number`, in the empty folder."""
    random = randomness.Random(f"{seed} {number}")
    case = cases.draw(random, of)
    for item in case.template.inputs.split():
        name, _, target = item.partition("=")
        copy(source / name, folder / (target or name))
    prepare(zygote, case, folder)
    for item in case.spoil:
        name, _, target = item.partition("=")
        mutate.spoil(random, folder / (target or name))
    kept = case.template.keeps and not case.spoil and content(folder / case.template.keeps)
    wrong = []
    for words in [case.words] + [case.template.then.split() + ["--quiet"]] * bool(case.template.then):
        for stream in ("out", "err"):
            (folder / stream).unlink(missing_ok=True)
        before = {path.name: signature(path) for path in folder.rglob("*")}
        answer = zygote.run(folder, words, case.streams, case.limits)
        wrong += complaints(case, folder, answer, before)
        if answer.get("exit") != 0:
            break
    gathered = words[:3] == ["shard", "gather", "job"] and set(words[3:]) <= {"--quiet"}
    wrong += wrong_bytes(case, source, folder, gathered and answer.get("exit") == 0)
    if kept and content(folder / case.template.keeps) != kept:
        wrong.append(f"changed {case.template.keeps}, in which nothing is wrong")
    return case, answer, wrong


def remove(folder):
    for path in folder.rglob("*"):
        if path.is_dir() and not path.is_symlink():
            path.chmod(0o700)
    shutil.rmtree(folder, ignore_errors=True)


def work(job):
    program, seed, numbers, source, keep, of = job
    zygote, failed, used, exits = Zygote(program), [], 0.0, collections.Counter()
    for number in numbers:
        folder = Path(tempfile.mkdtemp(prefix="luxfield-hostile-"))
        case, answer, wrong = run_case(zygote, seed, number, source, folder, of)
        used += answer["processor_s"]
        exits[case.template.words.split()[0], answer.get("exit", "signal")] += 1
        if wrong:
            error = folder / "err"
            text = error.read_bytes()[-400:].decode("utf8", "replace") if error.is_file() else ""
            failed.append((number, case, answer, wrong, text))
            if keep:
                shutil.copytree(
                    folder,
                    Path(keep) / f"case-{number}",
                    symlinks=True,
                    ignore=special,
                    dirs_exist_ok=True,
                )
        remove(folder)
    zygote.close()
    return failed, used, exits


def special(folder, names):
    return [
        n for n in names if not (Path(folder) / n).is_dir() and not (Path(folder) / n).is_file()
    ]


def show(number, case, answer, wrong, text, seed, program, of):
    print(f"case {number}: {'; '.join(wrong)}")
    print("  luxfield", shlex.join(case.words))
    print(
        f"  spoilt: {', '.join(case.spoil) or 'nothing'}; streams {case.streams}; limits {case.limits}"
    )
    print(f"  {answer}")
    for line in text.splitlines()[-3:]:
        print(f"  | {line!r}")
    print(f"  again: hostile.py {program} --seed {seed} --only {number} --keep ."
          + (f" --of {shlex.quote(of)}" if of else ""))


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("zygote")
    parser.add_argument("--cases", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", type=int)
    parser.add_argument("--keep")
    parser.add_argument("--of", default="", help="only of templates whose words begin so")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="luxfield-hostile-corpus-") as name:
        source = Path(name)
        first = Zygote(options.zygote)
        corpus.make(source, lambda words: first.run(source, words))
        first.close()
        numbers = (
            [options.only]
            if options.only is not None
            else range(options.first, options.first + options.cases)
        )
        jobs = [(options.zygote, options.seed, list(part), source, options.keep, options.of)
                for part in (numbers[i : i + 50] for i in range(0, len(numbers), 50))]  # fmt: skip
        failures, used, exits = [], 0.0, collections.Counter()
        with multiprocessing.Pool(options.processes) as pool:
            for failed, seconds, counts in pool.imap_unordered(work, jobs):
                failures += failed
                used += seconds
                exits += counts
                for failure in failed:
                    show(*failure, options.seed, options.zygote, options.of)
                    sys.stdout.flush()
    print("verb: runs by exit code")
    for verb in sorted({verb for verb, _ in exits}):
        print(
            f"  {verb}: "
            + ", ".join(
                f"{n} x {code}" for (v, code), n in sorted(exits.items(), key=str) if v == verb
            )
        )
    if options.only is not None and not failures:
        print(f"case {options.only} is taken well")
    print(f"seed {options.seed}, {used:.0f} s of processor time, {time.monotonic() - start:.0f} s")
    print(f"hostile {len(numbers)} cases, {len(failures)} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
