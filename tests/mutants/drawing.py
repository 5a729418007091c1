"""Which mutants are made: drawn by seed over the lines of all rooms and of the kernels."""

import pathlib
import random

import mistakes

ROOMS = [
    "core",
    "lightfield",
    "hal",
    "capture",
    "reconstruct",
    "scene",
    "preprocess",
    "render",
    "kernels",
    "study",
    "cli",
    "device_bench",
]
LEAST_OF_A_ROOM = 5
PER_FILE = 3  # a file that is drawn gives three lines, so that fewer files are compiled


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
    """The mistakes of a file in random order, of which some are taken, one a line."""

    def __init__(self, root, path, seed):
        self.text = (pathlib.Path(root) / path).read_text()
        by_line = {}
        for mistake in mistakes.in_text(path, self.text):
            by_line.setdefault(mistake.line, []).append(mistake)
        chance = random.Random(f"{seed} {path}")
        self.lines = len(by_line)
        self.waiting = [
            chance.choice(by_line[line]) for line in chance.sample(sorted(by_line), len(by_line))
        ]
        self.taken = []

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
        chance = random.Random(f"{seed} {room}")
        files = found[room]
        names, weights = list(files), [f.lines for f in files.values()]
        while share > 0 and any(f.waiting for f in files.values()):
            name = chance.choices(names, weights)[0]
            for _ in range(min(PER_FILE, share)):
                if files[name].take():
                    share -= 1
                    chosen[name] = files[name]
    return chosen
