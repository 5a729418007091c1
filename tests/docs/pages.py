"""The files of a source tree that people read, and the text of their comments."""

import os
import pathlib
import re

CODE = (".h", ".cc", ".cl", ".clh")
SCRIPTS = (".py", ".sh", ".cmake", ".txt", ".toml")
# And folders whose name begins with a dot. What makes the site names pages as they are called there.
SKIPPED = ("build", "out", "site")


def files(root, suffixes):
    """Paths of all files under `root` with one of the suffixes, in order; "" is a name without a dot."""
    found = []
    for folder, names, here in os.walk(root):
        names[:] = [name for name in names if not name.startswith(".") and name not in SKIPPED]
        found += [pathlib.Path(folder, name) for name in here if pathlib.Path(name).suffix in suffixes]
    return sorted(found)


def text(path):
    """The text of a file; of one that is no text, nothing."""
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return ""


def comment(line):
    """What stands in a line that holds nothing but a // comment, its leading blanks kept; else None."""
    match = re.fullmatch(r"\s*//+ ?(.*)", line)
    return match and match[1]
