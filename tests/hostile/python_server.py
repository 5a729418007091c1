"""Calls of the Python module, each in a fork of a process that has it loaded: the requests and answers of
zygote.cc, with the seed of a call in place of a verb."""

import json
import os
import random as randomness
import resource
import signal
import sys
import time
import traceback

import luxfield
import numpy as np  # noqa: F401  loaded before the forks
import python_calls

SPACE_BYTES = 2 << 30  # of address space beyond what a call begins with: what is too large is refused
REFUSALS = (luxfield.Error, ValueError, TypeError, MemoryError, OverflowError, IndexError, OSError)


def space_in_use():
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[0]) * resource.getpagesize()


def open_stream(stream, how):
    os.close(stream)
    if how != "closed":
        flags = os.O_RDONLY if stream == 0 else os.O_WRONLY | os.O_CREAT | os.O_APPEND
        assert os.open(how if how != "clogged" else "/dev/full", flags, 0o600) == stream


def child(request):
    os.setpgid(0, 0)
    os.chdir(request["folder"])
    for stream, name in enumerate(("stdin", "stdout", "stderr")):
        open_stream(stream, request[name])
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (request["processor_s"], request["processor_s"] + 1))
    resource.setrlimit(resource.RLIMIT_AS, (space_in_use() + SPACE_BYTES,) * 2)
    try:
        python_calls.call(randomness.Random(request["words"][1]))
        return 0
    except REFUSALS as refusal:
        text = str(refusal).strip() or "no words" * (not isinstance(refusal, MemoryError))
        if "no words" in text or "/tmp/luxfield-" in text:
            os.write(2, f"a refusal of no use: {text}\n".encode())
            return 1
        return 0
    except BaseException:
        os.write(2, traceback.format_exc().encode())
        return 1


def answer(request):
    pid = os.fork()
    if pid == 0:
        try:
            os._exit(child(request))
        finally:
            os._exit(1)
    until, late = time.monotonic() + request["wall_s"], False
    while True:
        done, status, used = os.wait4(pid, os.WNOHANG)
        if done:
            break
        if time.monotonic() > until:
            late = True
            os.kill(pid, signal.SIGKILL)
        time.sleep(0.001)
    try:
        os.killpg(pid, signal.SIGKILL)
        left = True
    except ProcessLookupError:
        left = False
    result = {"processor_s": used.ru_utime + used.ru_stime, "peak_bytes": 1024 * used.ru_maxrss,
              "late": late, "left": left}  # fmt: skip
    ended = ("signal", os.WTERMSIG(status)) if os.WIFSIGNALED(status) else ("exit", os.WEXITSTATUS(status))
    return result | dict([ended])


for line in sys.stdin:
    print(json.dumps(answer(json.loads(line))), flush=True)
