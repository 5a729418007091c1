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
import resource
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cases
import corpus
import documents
import mutate

PROCESSOR_S, WALL_S, MOST_BYTES = 20, 240, 2 << 30
OWN_CACHE = Path(tempfile.gettempdir()) / f"luxfield-hostile-cache-{os.getuid()}"


HERE = Path(__file__).resolve().parent
LAMP_READER = HERE.parents[1] / "web/lib/index.js"


class Zygote:
    """A program that is forked for each run (zygote.cc, python_server.py)."""

    def __init__(self, *command, **environment):
        environment = dict(
            os.environ, XDG_CACHE_HOME=str(OWN_CACHE), HOME="/nonexistent", LC_ALL="C.UTF-8", **environment
        )
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment
        )

    def run(self, folder, words, streams=None, limits=None):
        request = {"folder": str(folder), "words": words, "limits": limits or {}, "wall_s": WALL_S,
                   "processor_s": PROCESSOR_S}  # fmt: skip
        if (folder / "cache").is_dir():
            request["cache"] = str(folder / "cache")
        request |= streams or {"stdin": "/dev/null", "stdout": "/dev/null", "stderr": "/dev/null"}
        self.process.stdin.write(json.dumps(request).encode() + b"\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def close(self):
        self.process.stdin.close()
        self.process.wait()


class Node:
    """The reader of lamps in pages, a process for each run."""

    def run(self, folder, words, streams, limits):
        def limit():
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_CPU, (PROCESSOR_S, PROCESSOR_S + 1))

        command = ["node", HERE / "read_lamp.mjs", LAMP_READER, *words]
        with open(folder / "out", "wb") as out, open(folder / "err", "wb") as err:
            process = subprocess.Popen(command, cwd=folder, stdout=out, stderr=err, preexec_fn=limit)
            _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        ended = ("signal", -process.returncode) if process.returncode < 0 else ("exit", process.returncode)
        return {"processor_s": used.ru_utime + used.ru_stime, "peak_bytes": 1024 * used.ru_maxrss, "late": False,
                "left": False} | dict([ended])  # fmt: skip

    def close(self):
        pass


def missing(zygote):
    """The programs of cases that cannot run here, and why."""
    build, why = Path(zygote).resolve().parent, {}
    if not shutil.which("node"):
        why["node"] = "node is not installed"
    elif int(subprocess.run(["node", "--version"], capture_output=True).stdout[1:].split(b".")[0]) < 18:
        why["node"] = "node is older than 18"
    module = subprocess.run([sys.executable, "-c", "import luxfield"], capture_output=True,
                            env=dict(os.environ, PYTHONPATH=str(build / "python")))  # fmt: skip
    if module.returncode != 0:
        why["python"] = f"no luxfield for {sys.executable} in {build / 'python'}"
    return why


class Programs:
    """What runs cases, begun where it is needed first."""

    def __init__(self, zygote):
        build = Path(zygote).resolve().parent
        self.running, self.begin = {}, {
            "luxfield": lambda: Zygote(zygote),
            "reload": lambda: self["luxfield"],
            "node": Node,
            "python": lambda: Zygote(sys.executable, str(HERE / "python_server.py"), OPENBLAS_NUM_THREADS="1",
                                     PYTHONPATH=str(build / "python"), LUXFIELD_PROGRAM=str(build / "luxfield")),
        }  # fmt: skip

    def __getitem__(self, name):
        if name not in self.running:
            self.running[name] = self.begin[name]()
        return self.running[name]

    def close(self):
        for program in {id(p): p for p in self.running.values()}.values():
            program.close()


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
    if not case.template.before and case.words != case.template.words.split() + ["--quiet"]:
        return wrong  # somebody wanted something else
    for name, _, right in (item.partition("=") for item in case.template.right.split()):
        if not (folder / name).is_file():
            wrong += [f"exit 0 without {name}"] * must_be
        elif (folder / name).read_bytes() != (source / right).read_bytes():
            wrong.append(f"wrong bytes: {name}")
    return wrong


def wrong_documents(case, folder):
    """What is wrong with the texts of a run's documents."""
    wrong = []
    for name in case.template.outputs.split():
        if name in case.words and (folder / name).is_file() and case.words[0] == "photometry":
            asks = folder / "ask.toml"
            texts = documents.asked_texts(asks, folder / name) if "ask.toml" in case.words else []
            wrong += documents.complaints(folder / name, texts)
    return wrong


def prepare(zygote, case, folder):
    for line in filter(None, case.template.before.split("; ")):
        answer = zygote.run(folder, line.split() + ["--quiet"])
        if answer.get("exit") != 0:
            raise RuntimeError(f"luxfield {line}: {answer}")


def run_case(programs, seed, number, source, folder, of=""):
    """(case, answer, complaints) of case `number`, in the empty folder."""
    random = randomness.Random(f"{seed} {number}")
    case = cases.draw(random, of)
    program = programs[case.template.program]
    later = folder / "new" if case.template.program == "reload" else folder  # what is spoilt comes later
    later.mkdir(exist_ok=True)
    for item in case.template.inputs.split():
        name, _, target = item.partition("=")
        copy(source / name, folder / (target or name))
        if later != folder:
            copy(source / name, later / (target or name))
    prepare(program, case, folder)
    for item in case.spoil:
        name, _, target = item.partition("=")
        mutate.spoil(random, later / (target or name))
    kept = case.template.keeps and not case.spoil and content(folder / case.template.keeps)
    wrong = []
    for words in [case.words] + [case.template.then.split() + ["--quiet"]] * bool(case.template.then):
        for stream in ("out", "err"):
            (folder / stream).unlink(missing_ok=True)
        before = {path.name: signature(path) for path in folder.rglob("*")}
        answer = program.run(folder, words, case.streams, case.limits)
        wrong += complaints(case, folder, answer, before)
        if answer.get("exit") != 0:
            break
    done = answer.get("exit") == 0
    gathered = words[:3] == ["shard", "gather", "job"] and set(words[3:]) <= {"--quiet"}
    wrong += wrong_bytes(case, source, folder, gathered and done)
    wrong += wrong_documents(case, folder) if done else []
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
    programs, failed, used, exits = Programs(program), [], 0.0, collections.Counter()
    for number in numbers:
        folder = Path(tempfile.mkdtemp(prefix="luxfield-hostile-"))
        case, answer, wrong = run_case(programs, seed, number, source, folder, of)
        used += answer["processor_s"]
        verb = case.words[0] if case.template.program == "python" else case.template.words.split()[0]
        exits[verb, answer.get("exit", "signal")] += 1
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
    programs.close()
    return failed, used, exits


def special(folder, names):
    return [
        n for n in names if not (Path(folder) / n).is_dir() and not (Path(folder) / n).is_file()
    ]


def show(number, case, answer, wrong, text, seed, program, of):
    print(f"case {number}: {'; '.join(wrong)}")
    print(f"  {case.template.program}", shlex.join(map(str, case.words)))
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
        first = Programs(options.zygote)
        corpus.make(source, lambda words: first["luxfield"].run(source, words))
        first.close()
        for name, why in missing(options.zygote).items():
            cases.leave_out(name)
            print(f"without the cases of {name}: {why}")
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
