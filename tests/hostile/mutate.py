"""Mutations that know what kind of file they spoil: most of what they make is read beyond the first
check, which random bytes alone seldom are."""

import hashlib
import json
import os
import re
import stat
import struct
import sys
import zlib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/judges"), str(ROOT / "bridges/judges")]
import exr  # noqa: E402

NUMBERS = [
    0, -0.0, 1, -1, 2, 3, 0.5, 1e-12, -1e-12, 255, 65535, 65536, 2**31 - 1, 2**31, -(2**31), 2**32,
    2**53, 2**63 - 1, -(2**63), 1e6, 1e12, 1e30, 1e38, 1e39, 1e300, -1e300, 1e-300, 5e-324,
]  # fmt: skip
TEXTS = [
    "", "x", "nan", "inf", "-inf", "../../../etc/passwd", "/dev/zero", "/dev/null", "/", ".", "..",
    "\x1b[31mred\x1b[0m", "\x1b]0;title\x07", "a\nluxfield: done", "\x9b1m", "\u202eabc", "\0", "é" * 300,
    "%s%n%x", "{}{0}", "A" * 5000, "=cmd|' /C calc'!A0", "@SUM(1)", "a\rb", "\u2066x\u2069\u200f", "e\u0301" * 200,
    " ".join(f"Sentence {k} of a long condition." for k in range(320)), "\u5b57" * 2000, "bspline2", "box", "lensless", "lens", "<script>alert(1)</script>",
]  # fmt: skip


def number(random):
    return random.choice(NUMBERS) * random.choice([1, 1, 1, 1.0000001, 0.5, 3])


def value(random, depth=0):
    """Any JSON value."""
    kind = random.randrange(9 if depth < 3 else 6)
    if kind < 3:
        return number(random)
    if kind == 3:
        return random.choice(TEXTS)
    if kind == 4:
        return random.choice([True, False, None])
    if kind == 5:
        return random.randrange(-3, 70000)
    if kind == 6:
        return [value(random, depth + 1) for _ in range(random.randrange(5))]
    if kind == 7:
        return {random.choice(TEXTS): value(random, depth + 1) for _ in range(random.randrange(3))}
    return [[number(random)] * random.randrange(1, 9)] * random.randrange(1, 9)


def near(random, old):
    """A value that is often of the old one's type."""
    if random.random() < 0.3:
        return value(random)
    if isinstance(old, bool):
        return not old
    if isinstance(old, int):
        return random.choice([old + 1, old - 1, -old, 0, old * 1000, int(number(random))])
    if isinstance(old, float):
        return random.choice([-old, 0.0, old * 1e6, old * 1e-6, float(number(random))])
    if isinstance(old, str):
        return random.choice([old[:-1], old + "x", old.upper(), random.choice(TEXTS)])
    if isinstance(old, list):
        return random.choice(
            [[], old * 2, old[:-1], old[::-1], [value(random)], old + [value(random)]]
        )
    return value(random)


def tree(random, root):
    """Changes, drops, doubles or adds one value of parsed JSON, in place; returns it."""
    places = []

    def walk(node):
        for key in node.keys() if isinstance(node, dict) else range(len(node)):
            places.append((node, key))
            if isinstance(node[key], (dict, list)) and node[key]:
                walk(node[key])

    if isinstance(root, (dict, list)):
        walk(root)
    if not places:
        return value(random)
    node, key = random.choice(places)
    act = random.randrange(8)
    if act < 5:
        node[key] = near(random, node[key])
    elif act == 5:
        del node[key]
    elif act == 6 and isinstance(node, list):
        node.append(node[key])
    else:
        other, other_key = random.choice(places)
        node[key] = json.loads(json.dumps(other[other_key]))
    return root


def of_bytes(random, data):
    """Bits, bytes, runs; cut off, doubled, filled."""
    data = bytearray(data)
    for _ in range(random.choice([1, 1, 1, 2, 5, 30])):
        if not data:
            break
        at = random.randrange(len(data))
        act = random.randrange(8)
        if act == 0:
            data[at] ^= 1 << random.randrange(8)
        elif act == 1:
            data[at] = random.choice([0, 1, 0x7F, 0x80, 0xFF, random.randrange(256)])
        elif act == 2:
            data[at : at + 4] = struct.pack(
                random.choice("<>") + "i", random.choice([0, -1, 2**31 - 1, 65536])
            )
        elif act == 3:
            data[at : at + 4] = struct.pack(
                "<f", random.choice([0, float("nan"), float("inf"), 1e38, -1])
            )
        elif act == 4:
            del data[at : at + random.choice([1, 4, 100])]
        elif act == 5:
            data[at:at] = data[max(0, at - random.randrange(1, 200)) : at]
        elif act == 6:
            del data[at:]
        else:
            data[at : at + 16] = bytes(16)
    return bytes(data)


def of_lines(random, data):
    """Texts whose lines are records of words: OBJ, PLY, TOML, headers."""
    lines = data.decode("latin1").split("\n")
    for _ in range(random.choice([1, 1, 2, 4])):
        at = random.randrange(len(lines))
        act = random.randrange(7)
        words = re.findall(r"\s+|[^\s,=\[\]]+|.", lines[at])
        if act < 3 and words:
            token = str(value(random)) if random.random() < 0.4 else str(number(random))
            words[random.randrange(len(words))] = token
            lines[at] = "".join(words)
        elif act == 3:
            del lines[at]
        elif act == 4:
            lines.insert(at, lines[random.randrange(len(lines))])
        elif act == 5:
            lines[at] = lines[at] * random.choice([2, 50])
        else:
            lines[at] = lines[at][: random.randrange(len(lines[at]) + 1)]
        if not lines:
            break
    return "\n".join(lines).encode("latin1", "replace")


def toml_value(new):
    if isinstance(new, bool):
        return str(new).lower()
    if isinstance(new, dict) or new is None:
        return "{}"
    if isinstance(new, str):
        return json.dumps(new)
    if isinstance(new, list):
        return "[" + ", ".join(toml_value(item) for item in new) + "]"
    return repr(new)


def of_toml(random, data):
    """One key's value, or lines."""
    text = data.decode("utf8", "replace")
    keys = list(re.finditer(r"(?m)^([ \t]*[\w.\"]+[ \t]*=[ \t]*)([^#\n]*)", text))
    if not keys or random.random() < 0.2:
        return of_lines(random, data)
    for _ in range(random.choice([1, 1, 1, 2, 3])):
        key = random.choice(keys)
        old = key[2].strip()
        try:
            old = json.loads(old)
        except ValueError:
            pass
        new = key[1] + toml_value(near(random, old))
        text = text.replace(key[0], new, 1)
    return text.encode("utf8", "replace")


def of_json(random, data):
    try:
        root = json.loads(data)
    except ValueError:
        return of_bytes(random, data)
    for _ in range(random.choice([1, 1, 2])):
        root = tree(random, root)
    return json.dumps(root, indent=2).encode("utf8", "replace") + b"\n"


def of_glb(random, data):
    """A value of the JSON, the codes of a table deflated anew, or any bytes."""
    length = struct.unpack_from("<I", data, 12)[0]
    text, binary = data[20 : 20 + length], data[28 + length :]
    act = random.randrange(4)
    if act == 0:
        return of_bytes(random, data)
    if act < 3:
        text = of_json(random, text)
    else:
        root = json.loads(text)
        view = random.choice(root["bufferViews"])
        most = random.choice([10**3, 10**5, 10**7, 4 * 10**8])
        codes = zlib.compress(bytes(most) if random.random() < 0.5 else random.randbytes(10**5), 1)
        view |= {"byteOffset": len(binary), "byteLength": len(codes)}
        text, binary = json.dumps(root).encode(), binary + codes
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body


def of_exr_header(random, data):
    """An attribute of the first header: twice, gone, of another type or size; or a larger window."""
    attributes, at = [], 8
    while data[at] != 0:
        name_end = data.index(b"\0", at)
        type_end = data.index(b"\0", name_end + 1)
        (size,) = struct.unpack_from("<i", data, type_end + 1)
        value = data[type_end + 5 : type_end + 5 + size]
        attributes.append([data[at:name_end], data[name_end + 1 : type_end], size, value])
        at = type_end + 5 + size
    one = random.choice(attributes)
    act = random.randrange(6)
    if act == 0:
        attributes.append(list(random.choice(attributes)))
    elif act == 1:
        attributes.remove(one)
    elif act == 2:
        one[1] = random.choice(attributes)[1]
    elif act == 3:
        one[2] = random.choice([0, 1, 3, 4, 16, one[2] - 1, one[2] + 1, one[2] + 37, 2**31 - 1])
    elif act == 4:
        one[3] += bytes(random.choice([1, 4, 37]))
        one[2] = random.choice([one[2], len(one[3])])
    else:
        wide = struct.pack("<4i", 0, 0, 2 ** random.randrange(28), 2 ** random.randrange(20))
        for other in attributes:
            if other[0] == b"dataWindow":
                other[3] = wide
    text = b"".join(
        name + b"\0" + kind + b"\0" + struct.pack("<i", size) + value
        for name, kind, size, value in attributes
    )
    return data[:8] + text + data[at:]


def of_exr(random, path):
    """Pixels and attributes of parts, rewritten whole; or the bytes of the header; or any bytes."""
    data = path.read_bytes()
    act = random.randrange(5)
    if act == 4:
        try:
            return of_exr_header(random, data)
        except (ValueError, IndexError, struct.error):  # spoilt before
            return of_bytes(random, data)
    if act == 0:
        return of_bytes(random, data)
    if act == 1:
        head = random.randrange(60, 1500)
        return of_bytes(random, data[:head]) + data[head:]
    try:
        parts = exr.read(path)
    except Exception:
        return of_bytes(random, data)
    part = random.choice(parts)
    name = random.choice(list(part.channels))
    plane = part.channels[name]
    if act == 2 or not part.attributes:
        rows, columns = plane.shape
        plane = plane.copy()
        bad = random.choice([float("nan"), float("inf"), -1, 1e38, 0, -0.0, 1e-38])
        if plane.dtype.kind == "u":
            bad = random.choice([0, 1, 2**32 - 1])
        if random.random() < 0.5:
            plane[random.randrange(rows), random.randrange(columns)] = bad
        else:
            plane[:] = bad
        part.channels[name] = plane
    else:
        attributes = [
            key for key in part.attributes if isinstance(part.attributes[key], (int, float, str))
        ]
        if not attributes:
            return of_bytes(random, data)
        key = random.choice(attributes)
        if random.random() < 0.15:
            del part.attributes[key]
        else:
            old = part.attributes[key]
            new = (
                of_json(random, old.encode()).decode()
                if isinstance(old, str) and old[:1] == "{"
                else near(random, old)
            )
            if isinstance(new, int) and not -(2**31) <= new < 2**31:
                new = float(new)
            part.attributes[key] = new if isinstance(new, (int, float, str)) else "x"
    if random.random() < 0.1:
        random.choice([parts.pop, parts.reverse, lambda: parts.append(part)])()
    kept = ("channels", "compression", "dataWindow", "displayWindow", "lineOrder", "name", "type")
    for other in parts:
        other.attributes = {
            k: v for k, v in other.attributes.items()
            if k not in kept + ("chunkCount", "pixelAspectRatio", "screenWindowCenter", "screenWindowWidth")
            and isinstance(v, (int, float, str))
        }  # fmt: skip
    if not parts:
        return b""
    scratch = path.with_name("scratch.exr")
    try:
        exr.write(scratch, parts)
        return scratch.read_bytes()
    except Exception:  # what this writer cannot express
        return of_bytes(random, data)
    finally:
        scratch.unlink(missing_ok=True)


def of_png(random, data):
    """A chunk's fields, with a checksum that fits."""
    chunks, at = [], 8
    while at + 8 <= len(data):
        size = struct.unpack_from(">I", data, at)[0]
        chunks.append([data[at + 4 : at + 8], bytearray(data[at + 8 : at + 8 + size])])
        at += 12 + size
    if random.random() < 0.2 or not chunks:
        return of_bytes(random, data)
    chunk = random.choice(chunks)
    if chunk[0] == b"IHDR" and random.random() < 0.7:
        field = random.randrange(7)
        if field < 2:
            sizes = [0, 1, 3, 1000, 20000, 65535, 2**31 - 1]
            chunk[1][4 * field : 4 * field + 4] = struct.pack(">I", random.choice(sizes))
        else:
            chunk[1][6 + field] = random.choice([0, 1, 2, 3, 4, 6, 8, 16, 255])
    elif random.random() < 0.3:
        chunks.insert(
            random.randrange(len(chunks) + 1),
            [random.choice([b"PLTE", b"tRNS", b"IDAT", b"zTXt"]), bytearray(30)],
        )
    else:
        chunk[1] = bytearray(of_bytes(random, bytes(chunk[1])))
    out = data[:8]
    for name, body in chunks:
        out += (
            struct.pack(">I", len(body))
            + name
            + bytes(body)
            + struct.pack(">I", zlib.crc32(name + bytes(body)))
        )
    return out


def crc32c(data, table=[]):
    if not table:
        for byte in range(256):
            for _ in range(8):
                byte = (byte >> 1) ^ (0x82F63B78 if byte & 1 else 0)
            table.append(byte)
    crc = 0xFFFFFFFF
    for byte in data:
        crc = (crc >> 8) ^ table[(crc ^ byte) & 0xFF]
    return crc ^ 0xFFFFFFFF


def reseal(folder, records):
    """Writes journal and manifest so that all hashes fit (docs/formats/session.md)."""
    sha256 = lambda data: hashlib.sha256(data).hexdigest()  # noqa: E731
    previous, lines = "0" * 64, []
    for sequence, record in enumerate(records):
        fields = {k: v for k, v in record.items() if k not in ("seq", "prev", "type", "crc32c")}
        head = (
            f'{{"seq":{sequence},"prev":"{previous}","type":{json.dumps(record.get("type", "x"))}'
        )
        if fields:
            head += (
                ","
                + json.dumps(fields, separators=(",", ":"), sort_keys=True, ensure_ascii=False)[
                    1:-1
                ]
            )
        line = head.encode("utf8", "replace")
        line += f',"crc32c":"{crc32c(line):08x}"}}'.encode()
        previous = sha256(line)
        lines.append(line)
    (folder / "journal.jsonl").write_bytes(b"\n".join(lines) + b"\n")
    files = []
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and name not in ("LOCK", "manifest.json"):
            files.append(
                {"bytes": path.stat().st_size, "file": name, "sha256": sha256(path.read_bytes())}
            )
    if not (folder / "manifest.json").exists():
        return
    manifest = {"files": files, "journal_head": previous}
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=2, sort_keys=True) + "\n")


def of_session(random, folder):
    """Whatever is mutated, the hashes fit afterwards, so that readers see it; now and then they do not."""
    records = [json.loads(line) for line in (folder / "journal.jsonl").read_bytes().splitlines()]
    act = random.randrange(8)
    if act < 2:
        name = ["plan.json", "session.json"][act]
        data = of_json(random, (folder / name).read_bytes())
        (folder / name).write_bytes(data)
        for record in records:
            if name[:-5] + "_sha256" in record:
                record[name[:-5] + "_sha256"] = hashlib.sha256(data).hexdigest()
    elif act < 4:
        tree(random, records[random.randrange(len(records))])
        records = [r for r in records if isinstance(r, dict)]
    elif act == 4:
        at = random.randrange(len(records))
        random.choice(
            [lambda: records.pop(at), lambda: records.insert(at, records[at]), records.reverse]
        )()
    elif act == 5:
        frames = sorted(folder.rglob("*.tif"))
        frame = random.choice(frames)
        head = random.choice([200, 10**9])
        data = frame.read_bytes()
        data = of_bytes(random, data[:head]) + data[head:]
        frame.write_bytes(data)
        for record in records:
            if record.get("file") == frame.relative_to(folder).as_posix():
                record["sha256"] = hashlib.sha256(data).hexdigest()
                if "bytes" in record:
                    record["bytes"] = len(data)
    elif act == 6:
        frames = sorted(folder.rglob("*.tif"))
        one, other = random.choice(frames), random.choice(frames)
        random.choice(
            [
                lambda: one.unlink(),
                lambda: one.write_bytes(other.read_bytes()),
                lambda: one.write_bytes(b""),
            ]
        )()
        return
    else:
        path = random.choice(sorted(p for p in folder.rglob("*") if p.is_file()))
        path.write_bytes(of_bytes(random, path.read_bytes()))
        return
    reseal(folder, records)


def job_names(job):
    """The names of a job's shards that follow from what it says (docs/formats/job.md)."""
    for number, shard in enumerate(job["shards"]):
        content = {key: job[key] for key in ("verb", "words", "whole", "luxfield")}
        content |= {"first": shard["first"], "last": shard["last"]}
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
        shard["name"] = f"{number:04}-{hashlib.sha256(text.encode()).hexdigest()[:16]}"


def fit(folder, name, files):
    """Makes a shard's manifest fit files of shards/."""
    path = folder / "shards" / f"{name}.json"
    manifest = json.loads(path.read_bytes())
    manifest["files"] = [
        {"file": file, "bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        for file in files
        for data in [(folder / "shards" / file).read_bytes()]
    ]
    path.write_text(json.dumps(manifest, indent=2))


def of_job(random, folder):
    """A job's folder: what it says, its manifests, its pieces under other names, cut short, foreign."""
    shards = folder / "shards"
    manifests = sorted(p for p in shards.glob("*.json") if not p.name.endswith(".failed.json"))
    pieces = sorted(shards.glob("*.exr"))
    job = json.loads((folder / "job.json").read_bytes())
    act = random.randrange(12)
    if act < 2 or not manifests or not pieces:
        (folder / "job.json").write_bytes(of_json(random, (folder / "job.json").read_bytes()))
    elif act < 4:  # ranges, whose names fit
        ranges = job["shards"]
        for _ in range(random.choice([1, 1, 2])):
            at = random.randrange(len(ranges)) if ranges else 0
            how = random.randrange(4)
            if how == 0 and ranges:
                del ranges[at]
            elif how == 1 and ranges:
                ranges[at][random.choice(["first", "last"])] = random.choice(
                    [near(random, 1), *range(-3, 12)]
                )
            elif how == 2:
                job["length"] = ranges[-1]["last"] if ranges else 0
            else:
                random.choice([ranges.reverse, ranges.clear, lambda: ranges.extend(ranges[:1])])()
        if random.random() < 0.7:
            job_names(job)
        (folder / "job.json").write_text(json.dumps(job, indent=2))
    elif act == 4:  # anything, whose names fit
        tree(random, job)
        try:
            job_names(job)
        except (KeyError, TypeError, AttributeError, UnicodeError):
            pass
        (folder / "job.json").write_bytes(json.dumps(job, indent=2).encode("utf8", "replace"))
    elif act == 5:
        path = random.choice(manifests)
        path.write_bytes(of_json(random, path.read_bytes()))
    elif act == 6:  # a manifest of other files, with their right hashes
        others = [p.name for p in pieces] + [f"../../{p.name}" for p in folder.parent.glob("*.exr")]
        chosen = random.sample(others, min(len(others), random.randrange(3)))
        fit(folder, random.choice(manifests).stem, chosen)
    elif act < 9:  # pieces exchanged, cut short, or foreign, whose manifests fit
        one, other = random.choice(pieces), random.choice(pieces)
        first, second = one.read_bytes(), other.read_bytes()
        foreign = [p.read_bytes() for p in folder.parent.glob("*.exr") if p.is_file()] or [b""]
        how = random.randrange(4)
        if how == 0:
            one.write_bytes(second)
            other.write_bytes(first)
        elif how == 1:
            one.write_bytes(first[: random.randrange(len(first))])
        elif how == 2:
            one.write_bytes(random.choice(foreign))
        else:
            one.write_bytes(second)
        if random.random() < 0.8:
            for manifest in manifests:
                files = [f["file"] for f in json.loads(manifest.read_bytes())["files"]]
                fit(folder, manifest.stem, files)
    elif act == 9:
        path = random.choice(pieces)
        path.write_bytes(of_bytes(random, path.read_bytes()))
    elif act == 10:
        odd(random, random.choice(pieces + manifests + [folder / "job.json", shards]))
    else:
        random.choice(pieces + manifests).unlink()


def of_cache(random, folder):
    """An entry, or the folder itself, as a crash, a disk or somebody else leaves it."""
    store = folder / "luxfield" / "store"
    entries = sorted(path for path in store.iterdir() if path.is_file())
    entry, other = random.choice(entries), random.choice(entries)
    random.choice(
        [
            lambda: entry.write_bytes(of_bytes(random, entry.read_bytes())),
            lambda: entry.write_bytes(entry.read_bytes()[: random.randrange(entry.stat().st_size)]),
            lambda: entry.write_bytes(other.read_bytes()),
            lambda: odd(random, entry),
            lambda: store.chmod(random.choice([0, 0o500, 0o777])),
            lambda: os.chown(store, 65534, 65534) if os.getuid() == 0 else store.chmod(0o777),
            lambda: odd(random, store),
        ]
    )()


def odd(random, path):
    """In place of the file something that is none, or that holds nothing."""
    if path.is_dir():
        os.rename(path, path.with_name("away"))
    else:
        path.unlink()
    act = random.randrange(8)
    if act == 0:
        os.mkfifo(path)
    elif act == 1:
        path.mkdir()
    elif act == 2:
        path.symlink_to(
            random.choice(["/dev/zero", "/dev/null", "/dev/full", "/dev/random", "/proc/self/mem"])
        )
    elif act == 3:
        path.symlink_to(path.name)
    elif act == 4:
        path.symlink_to("nowhere")
    elif act == 5:
        os.mknod(path, stat.S_IFSOCK | 0o600)
    elif act == 6:
        path.write_bytes(b"")
    else:
        path.write_bytes(random.choice([b"\0" * 4096, b"[" * 100000, b"\xff" * 300, b"\n" * 5000]))


OF_DATA = {
    "toml": of_toml, "json": of_json, "png": of_png, "obj": of_lines, "mtl": of_lines, "ply": of_lines,
    "gltf": of_json, "hdr": lambda r, d: random_of(r, of_lines, of_bytes)(r, d), "glb": of_glb,
}  # fmt: skip


def random_of(random, *choices):
    return random.choice(choices)


def spoil(random, path):
    """Mutates a file or a session in place."""
    if random.random() < 0.04:
        return odd(random, path)
    if path.is_dir():
        known = {"job.json": of_job, "journal.jsonl": of_session, "luxfield": of_cache}
        return next((of for name, of in known.items() if (path / name).exists()), odd)(random, path)
    kind = path.suffix[1:]
    if kind == "exr":
        path.write_bytes(of_exr(random, path))
    else:
        act = OF_DATA.get(kind, of_bytes) if random.random() < 0.85 else of_bytes
        path.write_bytes(act(random, path.read_bytes()))
