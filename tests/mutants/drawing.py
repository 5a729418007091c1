"""Which mutants are made: drawn by seed over the lines of all rooms and of the kernels.

A draw orders files and mistakes by hashes of their text, so that it stays what it is while other lines change and
while files move: what the tests have learned to notice is asked for again.
"""

import hashlib
import math
import pathlib

import mistakes

ROOMS = [
    "core",
    "session",
    "lightfield",
    "environment",
    "formats",
    "rig",
    "hal",
    "capture",
    "pictures",
    "reconstruct",
    "scene",
    "preprocess",
    "photometry",
    "web",
    "render",
    "kernels",
    "planning",
    "bench",
    "shard",
    "cli",
    "view",
    "device_bench",
]
LEAST_OF_A_ROOM = 5
PER_TICKET = 3  # lines that a file gives each time it is drawn, so that fewer files are compiled
LINES_OF_A_TICKET = 40  # a file is drawn as often as it has so many lines


def place(seed, *words):
    """Where something stands in a draw: as good as random, the same again for the same words."""
    text = "\n".join([str(seed), *map(str, words)])
    return hashlib.sha256(text.encode()).digest()


def room_of(path):
    return "kernels" if path.endswith((".cl", ".clh")) else path.split("/")[0]


def sources(root):
    """The product's files by room. Headers of types are compiled as C++ too and hold no code."""
    files = {room: [] for room in ROOMS}
    for room in ROOMS:
        if room != "kernels":
            for path in sorted((root / room).rglob("*")):
                name = path.relative_to(root).as_posix()
                if path.suffix in (".cc", ".cl", ".clh") and not name.endswith("_types.clh"):
                    files[room_of(name)].append(name)
    return files


class File:
    """The mistakes of a file in the order of the draw, of which some are taken, one a line."""

    def __init__(self, root, path, seed):
        self.text = (pathlib.Path(root) / path).read_text()
        name = pathlib.PurePath(path).name
        by_line = {}
        for mistake in mistakes.in_text(path, self.text):
            by_line.setdefault(mistake.line, []).append(mistake)

        def order(mistake):
            return place(
                seed, name, mistake.before, mistake.original, mistake.mutated, mistake.after
            )

        self.lines = len(by_line)
        self.waiting = sorted((min(of_line, key=order) for of_line in by_line.values()), key=order)
        self.taken = []
        tickets = math.ceil(self.lines / LINES_OF_A_TICKET)
        self.tickets = [place(seed, name, number) for number in range(tickets)]

    def take(self):
        """The next mistake that overlaps none that is taken; False where there is none."""
        for mistake in list(self.waiting):
            self.waiting.remove(mistake)
            if all(mistake.end <= t.start or t.end <= mistake.start for t in self.taken):
                self.taken.append(mistake)
                return True
        return False


def shares(lines, count):
    """`count` shared out by lines, none of the rooms left out."""
    total = sum(lines.values())
    least = min(LEAST_OF_A_ROOM, max(1, count // len(lines)))
    share = {
        room: max(min(least, lines[room]), round(count * lines[room] / total)) for room in lines
    }
    while sum(share.values()) < count:
        share[max(share, key=lambda room: (lines[room] / share[room], room))] += 1
    return share


def draw(root, count, seed, rooms=ROOMS):
    """The files with mistakes taken, by path."""
    found = {
        room: {path: File(root, path, seed) for path in paths}
        for room, paths in sources(root).items()
        if room in rooms
    }
    lines = {room: sum(f.lines for f in files.values()) for room, files in found.items()}
    chosen = {}
    for room, share in shares(lines, count).items():
        files = found[room]
        for _, name in sorted((t, name) for name, file in files.items() for t in file.tickets):
            for _ in range(min(PER_TICKET, share)):
                if files[name].take():
                    share -= 1
                    chosen[name] = files[name]
    return chosen
