"""Runs the verbs of the program `luxfield`: arguments in, figures out.

A verb runs in a process of its own, so that results are those of the command line to the byte, the
interpreter stays free, and nothing that a verb does can end the notebook it is called from.
"""

import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import sysconfig
import tempfile
import threading
import warnings

from . import errors

try:
    from . import _build  # which the build tree's package alone has
except ImportError:
    _build = None

_ERRORS = {2: errors.InputError, 3: errors.DeviceError, 4: errors.Interrupted}


def program():
    """The path of the program: LUXFIELD_PROGRAM, that of this package's build tree or environment, or PATH."""
    named = os.environ.get("LUXFIELD_PROGRAM")
    if named:
        return named
    built = [_build.PROGRAM] if _build else []
    for path in [*built, os.path.join(sysconfig.get_path("scripts"), "luxfield")]:
        if os.path.isfile(path) and os.access(path, os.X_OK):
            return path
    found = shutil.which("luxfield")
    if not found:
        raise errors.InputError("the program `luxfield` is not found; install it, put it on PATH, or name it in "
                                "LUXFIELD_PROGRAM")
    return found


def data_file(name):
    """The path of a lab, plan or scene that comes with luxfield: data_file("labs/small.toml").

    It is looked for in the source tree of this package's build, then where the program is installed."""
    installed = pathlib.Path(program()).resolve().parent.parent / "share/luxfield/data"
    folders = [pathlib.Path(_build.DATA), installed] if _build else [installed]
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    raise errors.InputError(f"{name}: is not in {' or '.join(map(str, folders))}; name a file like labs/small.toml")


def arguments(options):
    """Keyword arguments as the program's options.

    `spp=16` is `--spp 16`, True a flag, None and False are left out; a tuple is one option with several values,
    a list the option repeated, a dict `--option KEY=VALUE` for each entry.
    """
    def one_value(option, value):
        word = str(value)
        return [f"{option}={word}"] if word.startswith("-") else [option, word]  # which is no option itself

    words = []
    for name, value in options.items():
        option = "--" + name.strip("_").replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(option)
        elif isinstance(value, dict):
            for key, one in value.items():
                words += [option, f"{key}={one}"]
        elif isinstance(value, tuple):
            words += [option, *map(str, value)]
        elif isinstance(value, list):
            for one in value:
                words += one_value(option, one)
        else:
            words += one_value(option, value)
    return words


def _listen(stream, progress, said):
    """Passes warnings and progress on line by line; keeps what the program says at its end."""
    for line in stream:
        line = line.rstrip("\n")
        if line.startswith("luxfield: warning: "):
            said.append(("warning", line[len("luxfield: warning: "):]))
        elif line.startswith("luxfield: "):
            said.append(("error", line[len("luxfield: "):]))
        elif progress:
            progress(line)


def _show(line):
    print(line, file=sys.stderr, flush=True)


class _CtrlC:
    """Passes Ctrl-C on to a program from before it starts until it has ended, where nobody else has taken it.

    A KeyboardInterrupt between the start and the wait for the end would leave the program running.
    """

    def __init__(self):
        self.pressed = self._sent = 0
        self._child = None
        # Only the main thread gets signals.
        self._takes = (threading.current_thread() is threading.main_thread()
                       and signal.getsignal(signal.SIGINT) is signal.default_int_handler)

    def __enter__(self):
        if self._takes:
            signal.signal(signal.SIGINT, self._press)
        return self

    def __exit__(self, *_):
        if self._takes:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def pass_on_to(self, child):
        self._child = child
        self._pass_on()

    def _press(self, *_):
        self.pressed += 1
        self._pass_on()

    def _pass_on(self):
        while self._child and self._sent < self.pressed:
            self._sent += 1
            self._child.send_signal(signal.SIGINT)


def run(verb, *inputs, progress=None, names=(), **options):
    """Runs `luxfield VERB --OPTION VALUE ... -- INPUTS` and returns (figures, text).

    figures   what the program writes with --json, as a dict
    text      what it prints
    progress  None: silent; True: lines on stderr; a function: called with each line
    names     (path, name): what sentences call a file that the caller does not know

    Warnings become LuxfieldWarning; errors InputError, DeviceError or Interrupted with the program's sentence.
    Ctrl-C is passed on to the program, which stops as it does on a terminal, and raises KeyboardInterrupt.
    """
    listener = _show if progress is True else progress
    with tempfile.TemporaryDirectory(prefix="luxfield-") as folder:
        figures = pathlib.Path(folder) / "figures.json"
        command = [program(), *verb.split(), *arguments(options), "--json", str(figures)]
        if not listener:
            command.append("--quiet")
        if inputs:
            command += ["--", *map(str, inputs)]  # none of which is an option, whatever it begins with
        with _CtrlC() as ctrl_c:
            try:
                child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                         stderr=subprocess.PIPE, text=True, errors="replace", start_new_session=True)
            except OSError as error:
                raise errors.InputError(f"{command[0]}: cannot be started: {error.strerror}; name the program "
                                        "`luxfield` in LUXFIELD_PROGRAM, or install it") from None
            ctrl_c.pass_on_to(child)
            said, text = [], []
            threads = [threading.Thread(target=_listen, args=(child.stderr, listener, said)),
                       threading.Thread(target=lambda: text.append(child.stdout.read()))]
            for thread in threads:
                thread.start()
            code = child.wait()
        for thread in threads:
            thread.join()
        child.stdout.close()
        child.stderr.close()
        for path, name in names:
            said = [(kind, sentence.replace(str(path), name)) for kind, sentence in said]
        for kind, sentence in said:
            if kind == "warning":
                warnings.warn(sentence, errors.LuxfieldWarning, stacklevel=4)  # of who called the verb
        if ctrl_c.pressed:
            raise KeyboardInterrupt
        if code != 0:
            sentences = [sentence for kind, sentence in said if kind == "error"]
            sentence = sentences[-1] if sentences else f"`luxfield {verb}` ended with exit code {code}"
            raise _ERRORS.get(code, errors.InternalError)(sentence)
        if not figures.exists():
            raise errors.InputError(f"{command[0]}: `{verb}` ended without figures; leave out help and version, and "
                                    "see that LUXFIELD_PROGRAM names luxfield")
        return json.loads(figures.read_text()), text[0]
