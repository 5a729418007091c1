#!/usr/bin/env -S python3 -B
"""What share of small mistakes the tests notice: see docs/testing.md."""

import argparse
import concurrent.futures
import os
import pathlib
import sys
import time

import drawing
import judging
import mutated_tree

ROOT = pathlib.Path(__file__).resolve().parents[2]


def known_survivors():
    """change: reason, of survivors.txt: pairs of lines, the second one indented."""
    known, change = {}, None
    for line in (pathlib.Path(__file__).parent / "survivors.txt").read_text().splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        if line[0].isspace():
            known[change] = (known[change] + " " + line.strip()).strip()
        else:
            change = line
            known[change] = ""
    return known


def arguments():
    parser = argparse.ArgumentParser(prog="./run mutants", description=__doc__)
    parser.add_argument(
        "rooms", nargs="*", metavar="ROOM", help="only those of the whole draw in these rooms"
    )
    parser.add_argument("--count", type=int, default=210, help="mutants drawn over all rooms (210)")
    parser.add_argument("--seed", type=int, default=1, help="of the draw (1)")
    parser.add_argument("--jobs", type=int, default=2, help="tests that run at a time (2)")
    parser.add_argument(
        "--only", type=int, nargs="+", metavar="N", help="only these numbers of the draw"
    )
    parser.add_argument("--list", action="store_true", help="print the draw and end")
    asked = parser.parse_args()
    if unknown := set(asked.rooms) - set(drawing.ROOMS):
        parser.error(f"no room {', '.join(sorted(unknown))}: there are {', '.join(drawing.ROOMS)}")
    return asked


def main():
    asked = arguments()
    begin = time.time()
    chosen = drawing.draw(ROOT, asked.count, asked.seed)
    tree = mutated_tree.MutatedTree(ROOT, chosen)
    print(
        f"mutants: {len(tree.mutants)} drawn with seed {asked.seed} from {len(chosen)} files",
        flush=True,
    )
    tree.keep(asked.rooms or drawing.ROOMS)
    numbers = [n for n in tree.mutants if not asked.only or n in asked.only]
    if asked.list:
        for number in numbers:
            m = tree.mutants[number]
            print(f"{number:4} {m.path}:{m.line}  {m.change()}")
        return 0
    rooms = {drawing.room_of(tree.mutants[n].path) for n in numbers}
    programs = sorted({p for room in rooms for p in judging.programs_of(room)})
    while True:
        tree.make([f"{p}_test" for p in programs])
        judge = judging.Judge(tree, asked.jobs)
        programs = [p for p in programs if p in judge.commands]
        print(f"mutants: built after {time.time() - begin:.0f} s", flush=True)
        errors = judge.note_all_reached(programs)
        if not errors:
            break
        replaced = tree.replace(errors)
        print(f"mutants: {replaced} of kernels do not compile, others are taken", flush=True)
        if not replaced:
            raise SystemExit(f"mutants: kernels do not build: {sorted(errors)}")
    print(f"mutants: {len(judge.tests)} tests noted after {time.time() - begin:.0f} s", flush=True)
    for test in judge.failing():
        print(f"mutants: {test.name} fails without any mutant, and is left out", flush=True)

    numbers = [n for n in numbers if n in tree.mutants]  # but for what does not compile
    survivors = judge_all(tree, judge, numbers, asked.jobs, begin)
    known = known_survivors()
    for number, tests in sorted(survivors.items()):
        m = tree.mutants[number]
        print(
            f"\nsurvived {number}, reached by {tests} tests: {m.path}:{m.line}\n  {m.change()}\n  "
            f"{known.get(m.change(), 'NOT KNOWN: a test is missing, or a reason in survivors.txt')}"
        )
    times = os.times()
    print(
        f"\n{time.time() - begin:.0f} s, "
        f"of processor time {times.children_user + times.children_system:.0f} s"
    )
    print(f"mutants {len(numbers)} survived {len(survivors)}")
    return any(tree.mutants[n].change() not in known for n in survivors)


def judge_all(tree, judge, numbers, jobs, begin):
    """Numbers of the survivors, with how many tests reach each."""
    survivors = {}
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:

        def judged(number):
            return number, judge.judge(number, drawing.room_of(tree.mutants[number].path))

        for done, (number, (killer, tests)) in enumerate(pool.map(judged, numbers), 1):
            if killer is None:
                survivors[number] = tests
            m = tree.mutants[number]
            print(
                f"{done:4}/{len(numbers)} {time.time() - begin:5.0f} s {number:4} {m.path}:{m.line} "
                f"{'SURVIVED' if killer is None else 'seen by ' + killer}",
                flush=True,
            )
    return survivors


if __name__ == "__main__":
    sys.exit(main())
