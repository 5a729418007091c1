#!/usr/bin/env -S python3 -B
"""Jobs of `luxfield shard submit --engine slurm` on a Slurm of two nodes on the loopback, while shards, the nodes'
daemons and the controller are killed at random times: no shard is lost, none is wrong, and what is gathered is, to
the byte, what the verb writes by itself. Usage: cluster_test.py LUXFIELD [--kills N] [--seed S]; the seed is
otherwise that of LUXFIELD_SEED.

Exits with 77 where Slurm cannot run, and says why."""

import argparse
import collections
import itertools
import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

import loopback_slurm

ROOT = pathlib.Path(__file__).resolve().parents[2]
PATIENCE_S = 900  # for one job


def must(words, folder, environment=None):
    result = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True, env=environment)
    if result.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, words))}: exit {result.returncode}: {result.stderr or result.stdout}")
    return result.stdout


def processes():
    """Number and words of each process."""
    for entry in pathlib.Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                yield int(entry.name), (entry / "cmdline").read_bytes().split(b"\0")
            except OSError:
                pass  # it has ended


def shards_running(folder):
    return [process for process, words in processes()
            if b"shard" in words and b"run" in words and any(word.startswith(bytes(folder)) for word in words)]


def tasks_of(cluster, node):
    """Processes of the tasks on a node: of the sessions that run a script from its spool folder, which are the step's
    daemon, the script and what it started."""
    sessions, session_of = set(), {}
    for process, words in processes():
        try:
            session_of[process] = os.getsid(process)
        except ProcessLookupError:
            continue
        if any(word.startswith(bytes(cluster.spool(node))) for word in words):
            sessions.add(session_of[process])
    return [process for process, session in session_of.items() if session in sessions]


def kill(process):
    try:
        os.kill(process, signal.SIGKILL)
        return True
    except ProcessLookupError:
        return False


class Killer:
    """One kill at a time, each of a victim of the kind drawn."""

    def __init__(self, cluster, folder, generator):
        self.cluster, self.folder, self.generator = cluster, folder, generator
        self.done = collections.Counter()

    def strike(self):
        kind = self.generator.choice(("shard", "shard", "shard", "node", "controller"))
        if kind == "shard":
            end = time.monotonic() + 3
            while not (running := shards_running(self.folder)) and time.monotonic() < end:
                time.sleep(0.01)
            if not running or not kill(self.generator.choice(running)):
                return
        elif kind == "node":
            # As if the machine lost its power: the daemon and all that runs on it.
            node = self.generator.choice(loopback_slurm.NODES)
            self.cluster.kill(node)
            for process in tasks_of(self.cluster, node):
                kill(process)
            self.cluster.start_node(node)
        else:
            self.cluster.kill("slurmctld")
            self.cluster.start_controller()
        self.done[kind] += 1


def finish(luxfield, cluster, folder, job, outputs, killer, kills, generator):
    """Submits until the outputs are there; strikes meanwhile, so many times at most."""
    submissions, refused, end = 0, 0, time.monotonic() + PATIENCE_S
    kills += sum(killer.done.values())
    while not all(output.exists() for output in outputs):
        if time.monotonic() > end:
            raise RuntimeError(f"{job}: not gathered in {PATIENCE_S} s: "
                               + must([luxfield, "shard", "status", job], folder) + cluster.describe())
        cluster.mend()
        if cluster.jobs() == []:
            result = subprocess.run([luxfield, "shard", "submit", job, "--engine", "slurm"], cwd=folder, text=True,
                                    capture_output=True, env=cluster.environment)
            submissions += result.returncode == 0
            refused = 0 if result.returncode == 0 else refused + 1
            # 3: the controller was not there to take it, which it is before long.
            if result.returncode not in (0, 3) or refused == 20:
                raise RuntimeError(f"{job}: {result.stderr}")
        if sum(killer.done.values()) < kills:
            time.sleep(generator.uniform(0.05, 1.5))
            killer.strike()
        else:
            time.sleep(0.2)
    return submissions


# Verb, input, output of the verb itself, files of it, shards, options.
JOBS = (("merge", "s", "one.meas.exr", ["one.meas.exr"], 10, {}),
        ("reconstruct", "one.meas.exr", "one.lf.exr", ["one.lf.exr"], 8, {}),
        ("render", "room.toml", "one.exr", [f"one_000{n}.exr" for n in range(6)], 6,
         {"sequence": "path.toml", "spp": 8}))
MOST_KILLS = 12  # of one job


def write_inputs(luxfield, folder):
    """What the jobs read, and what the verbs themselves write."""
    (folder / "room.toml").write_text(
        '[camera]\nposition = [0, -4, 2]\nlook_at = [0, 0, 0]\nwidth = 48\nheight = 32\n'
        '[[material]]\nname = "grey"\nalbedo = [0.5, 0.5, 0.5]\n'
        '[[quad]]\ncorner = [-3, -3, 0]\nedge_u = [6, 0, 0]\nedge_v = [0, 6, 0]\nmaterial = "grey"\n'
        '[[luminaire]]\nname = "lamp"\nfile = "one.lf.exr"\nposition = [0, 0, 1]\nlook_at = [0, 0, 0]\n'
        'up = [0, 1, 0]\n')
    (folder / "path.toml").write_text(
        'frames_per_s = 5\nduration_s = 1\n[[luminaire]]\nname = "lamp"\n[[luminaire.key]]\nt_s = 0\n'
        'position = [0, 0, 1]\n[[luminaire.key]]\nt_s = 1\nposition = [0.5, 0, 1.5]\n')
    must([luxfield, "capture", ROOT / "data/plans/small.toml", "s", "--lab", ROOT / "data/labs/small.toml", "--quiet"],
         folder)
    for verb, source, output, _, _, options in JOBS:
        words = [word for name, value in options.items() for word in (f"--{name}", value)]
        must([luxfield, verb, source, "-o", output, *words, "--quiet"], folder)


def do(luxfield, cluster, folder, number, job, killer, kills, generator):
    """Plans the job, has it done while things are killed, and compares what is gathered."""
    verb, source, output, files, shards, options = job
    name = f"{verb}{number}"
    (folder / f"{name}.toml").write_text(
        f'[job]\nverb = "{verb}"\ninput = "{source}"\noutput = "{name}{output[3:]}"\nshards = {shards}\n[options]\n'
        + "".join(f"{option} = {json.dumps(value)}\n" for option, value in options.items()))
    must([luxfield, "shard", "plan", f"{name}.toml", "-o", name], folder)
    gathered = [folder / (name + file[3:]) for file in files]
    submissions = finish(luxfield, cluster, folder, name, gathered, killer, kills, generator)
    for one, file in zip(gathered, files):
        if one.read_bytes() != (folder / file).read_bytes():
            raise RuntimeError(f"{name}: the bytes of {one.name} are not those of the verb itself")
    print(f"{verb}: {shards} shards, submitted {submissions} times, equal to the byte; killed so far: "
          f"{dict(killer.done)}", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("luxfield", type=pathlib.Path)
    parser.add_argument("--kills", type=int, default=8)
    parser.add_argument("--seed", default=os.environ.get("LUXFIELD_SEED", "1"))
    options = parser.parse_args()
    luxfield = options.luxfield.resolve()
    if why := loopback_slurm.missing():
        print(f"SKIPPED: cluster: {why}")
        return 77
    generator = random.Random(options.seed)
    with tempfile.TemporaryDirectory(prefix="luxfield-cluster.") as name:
        folder = pathlib.Path(name)
        write_inputs(luxfield, folder)
        cluster = loopback_slurm.Cluster(folder / "slurm")
        try:
            cluster.start()
            killer = Killer(cluster, folder, generator)
            for number in itertools.count():
                left = options.kills - sum(killer.done.values())
                if number >= len(JOBS) and left <= 0:
                    break
                jobs_left = max(1, len(JOBS) - number)
                kills = min(MOST_KILLS, -(-left // jobs_left))
                do(luxfield, cluster, folder, number, JOBS[number % len(JOBS)], killer, kills, generator)
        finally:
            cluster.stop()
            for node in loopback_slurm.NODES:
                for process in tasks_of(cluster, node):
                    kill(process)
    print(f"seed {options.seed}: {sum(killer.done.values())} kills, nothing lost and nothing wrong")
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # the daemons are ended all the same
    try:
        sys.exit(main())
    except RuntimeError as error:
        print(f"cluster: {error}", file=sys.stderr)
        sys.exit(1)
