"""The conformance sheet: what other programs light with exported lamps, beside the exact illuminance.

    luxfield export lamp.lf.exr -o lamp.rad --check                                    # of one program
    ./run foreign sheet lamp.lf.exr ... -o FOLDER [--program radiance] [--receivers 500] [--columns 11] [--seed 1]

Of each lamp: illuminance on three planes of COLUMNS x COLUMNS places, near, middle and far, and at so many receivers in
its light from 0.05 to 10 m, by Radiance, Blender, Mitsuba and a reader of the glTF extension, with standard errors of
their sampling; or by the programs named. FOLDER gets sheet.html and sheet.json. A lamp in lm, of one field. A program
that is missing is said to be; exit status 1 where a program that samples deviates at a receiver by more than 0.5 % and 5 standard errors, or the
mean over the receivers of any by more than 0.5 % and 3.
"""

import argparse
import base64
import html
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import exr

NEAREST_M, FARTHEST_M = 0.05, 10
PLANES_M = (("near", 0.1), ("middle", 1.0), ("far", 10.0))
# export --to, the file, the judge and its settings.
PROGRAMS = {
    "Radiance": ("radiance", "lamp.rad", "judge_radiance.py", ["12", "4"]),
    "Blender": ("blender", "lamp.json", "judge_blender.py", ["2048", "12"]),
    "Mitsuba": ("mitsuba", "lamp.xml", "judge_mitsuba.py", ["1024", "12"]),
    "glTF": ("gltf", "lamp.glb", "judge_gltf.py", []),
}
LARGEST_DEVIATION = 0.005
# Of 500 receivers with 12 runs each Student's t is beyond 5 at a fifth of one, were nothing else allowed.
LARGEST_BEYOND_IN_SIGMA = 5


class Lamp:
    """Where a lamp's light is, of its atlas."""

    def __init__(self, folder):
        field, = json.loads((folder / "lamp.json").read_text())["fields"]
        grid, images, n = field["grid"], field["images"], len(field["basis"]["cells"])
        self.delta = field["delta_m"]
        self.u_half = 0.5 * grid["spacing_m"] * np.array([grid["width"] + n - 1, grid["height"] + n - 1])
        self.u_middle = np.array([grid["u0_m"], grid["v0_m"]]) + self.u_half
        pixels = exr.read(folder / field["atlas"])[0].channels["G"]
        light = np.maximum(pixels.reshape(images["rows"], grid["height"], images["columns"], grid["width"]), 0).sum((1, 3))
        rows, columns = np.mgrid[:images["rows"], :images["columns"]]
        self.texel = np.array([images["ds_m"], images["dt_m"]])
        self.s = np.stack([images["s0_m"] + (columns + 0.5) * images["ds_m"],
                           images["t1_m"] - (rows + 0.5) * images["dt_m"]], axis=-1).reshape(-1, 2)
        self.share = light.ravel() / light.sum()
        self.s_middle = self.share @ self.s
        self.s_width = np.sqrt(self.share @ (self.s - self.s_middle)**2)

    def receivers(self, count, rng):
        """In the light: along rays of the lamp, with normals up to 45 degrees off its axis."""
        z = NEAREST_M * (FARTHEST_M / NEAREST_M)**rng.uniform(size=count)
        u = self.u_middle + self.u_half * rng.uniform(-1, 1, (count, 2))
        s = self.s[rng.choice(len(self.s), count, p=self.share)] + self.texel * rng.uniform(-0.5, 0.5, (count, 2))
        positions = np.column_stack([u + (s - u) * z[:, None] / self.delta, z])
        tilt, around = rng.uniform(0, math.pi / 4, count), rng.uniform(0, 2 * math.pi, count)
        return positions, np.column_stack([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), -np.cos(tilt)])

    def plane(self, z, columns):
        """Places on a plane at that height over most of the beam, rows from the top."""
        middle = self.u_middle + (self.s_middle - self.u_middle) * z / self.delta
        half = 2 * self.s_width * z / self.delta + self.u_half * abs(1 - z / self.delta)**0.5
        steps = (np.arange(columns) + 0.5) / columns * 2 - 1
        x, y = np.meshgrid(middle[0] + half[0] * steps, middle[1] - half[1] * steps)
        positions = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)])
        return positions, np.tile([0.0, 0.0, -1.0], (x.size, 1))


def exact(luxfield, lamp, folder, positions, normals):
    text = "".join(f"[[point]]\nposition_m = {list(map(float, p))}\nnormal = {list(map(float, n))}\n"
                   for p, n in zip(positions, normals))
    (folder / "ask.toml").write_text(text)
    subprocess.run([luxfield, "photometry", str(lamp), "--ask", str(folder / "ask.toml"), "-o", str(folder / "exact.json"),
                    "--quiet"], check=True, stdout=subprocess.DEVNULL)
    return np.array([point["illuminance_lx"] for point in json.loads((folder / "exact.json").read_text())["points"]])


def judged(luxfield, lamp, folder, name):
    """(illuminance, sigma, program) or a sentence that says why there is none."""
    to, file, judge, settings = PROGRAMS[name]
    answer = folder / f"{to}.answer.json"
    answer.unlink(missing_ok=True)
    run = subprocess.run([luxfield, "export", str(lamp), "--to", to, "-o", str(folder / file), "--quiet"],
                         capture_output=True, text=True)
    if run.returncode:
        return run.stderr.strip()
    print(f"sheet: {lamp.name}: {name} is asked, which takes minutes", file=sys.stderr, flush=True)
    run = subprocess.run([sys.executable, "-B", str(HERE / judge), file, "receivers.json", answer.name, *settings],
                         cwd=folder, capture_output=True, text=True)
    if not answer.is_file():
        return f"{name} did not answer: {(run.stderr or run.stdout).strip().splitlines()[-1:]}"
    said = json.loads(answer.read_text())
    return np.array(said["illuminance"]), np.array(said["sigma"]), said["program"]


def deviations(found, sigma, true):
    """Of receivers: in shares of the true value, or of a thousandth of the brightest's where it is less."""
    unit = np.maximum(true, 1e-3 * true.max())
    return (found - true) / unit, sigma / unit


def figures(found, sigma, true, z):
    """Receivers of like distances have like values: the unit is taken in ten ranges of distance."""
    part, noise = np.zeros_like(true), np.zeros_like(true)
    bins = np.digitize(np.log(z), np.linspace(math.log(NEAREST_M), math.log(FARTHEST_M), 11)[1:-1])
    for k in np.unique(bins):
        part[bins == k], noise[bins == k] = deviations(found[bins == k], sigma[bins == k], true[bins == k])
    beyond = np.maximum(np.abs(part) - LARGEST_DEVIATION, 0)
    return {"receivers": len(true), "mean": float(part.mean()), "mean_sigma": float(np.sqrt((noise**2).sum()) / len(true)),
            "median_size": float(np.median(np.abs(part))), "largest": float(np.abs(part).max()),
            "median_sigma": float(np.median(noise)),
            "largest_beyond_half_a_percent_in_sigma": float((beyond / np.maximum(noise, 1e-9)).max()) if noise.any() else None,
            "share_within_half_a_percent_and_3_sigma": float((np.abs(part) <= LARGEST_DEVIATION + 3 * noise).mean())}


def agrees(facts):
    beyond = facts["largest_beyond_half_a_percent_in_sigma"]
    return bool(abs(facts["mean"]) <= LARGEST_DEVIATION + 3 * facts["mean_sigma"] and
                (beyond is None or beyond <= LARGEST_BEYOND_IN_SIGMA))


def png(pixels):
    """A picture of (rows, columns, 3) bytes, as a data URL."""
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    data = (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
    return "data:image/png;base64," + base64.b64encode(data).decode()


def grey(values, top):
    level = np.clip(values / top, 0, 1)**(1 / 2.2) * 255
    return np.repeat(level[:, :, None], 3, axis=2).astype(np.uint8)


def signed(values, top):
    """White at 0, red above, blue below."""
    level = np.clip(values / top, -1, 1)[:, :, None]
    red, blue = np.array([178, 24, 43.]), np.array([33, 102, 172.])
    return np.where(level > 0, 255 + level * (red - 255), 255 - level * (blue - 255)).astype(np.uint8)


def picture(pixels, text):
    big = pixels.repeat(12, axis=0).repeat(12, axis=1)
    return f'<figure><img src="{png(big)}" alt="{html.escape(text)}"><figcaption>{html.escape(text)}</figcaption></figure>'


def page(sheet, maps):
    parts = ["<!doctype html><meta charset=utf-8><title>Conformance sheet</title><style>body{font:15px sans-serif;"
             "max-width:80em;margin:2em auto;padding:0 1em}table{border-collapse:collapse}td,th{padding:.2em .7em;"
             "border-bottom:1px solid #ccc;text-align:right}td:first-child,th:first-child{text-align:left}figure{display:"
             "inline-block;margin:.3em;width:116px;font-size:12px;vertical-align:top}img{width:116px;image-rendering:pixelated}"
             "</style><h1>Conformance sheet</h1>"
             "<p>Illuminance by other programs of lamps that luxfield exported, beside the exact one. Deviations are in "
             "shares of the exact value, or of a thousandth of the brightest at like distances where that is more; sigma "
             "is the standard error of the program's sampling. Of glTF the file is read by a reader of its page.</p>"]
    for lamp in sheet["lamps"]:
        parts.append(f"<h2>{html.escape(lamp['lamp'])}</h2><table><tr><th>program<th>receivers<th>mean deviation<th>"
                     "median size<th>median sigma<th>largest<th>within 0.5 % and 3 sigma</tr>")
        for name, facts in lamp["programs"].items():
            if "missing" in facts:
                parts.append(f"<tr><td>{name}<td colspan=6>{html.escape(facts['missing'])}</tr>")
                continue
            f = facts["receivers"]
            parts.append(f"<tr><td>{html.escape(facts['program'])}<td>{f['receivers']}<td>{100 * f['mean']:+.3f} &plusmn; "
                         f"{100 * f['mean_sigma']:.3f} %<td>{100 * f['median_size']:.2f} %<td>{100 * f['median_sigma']:.2f} "
                         f"%<td>{100 * f['largest']:.1f} %<td>{100 * f['share_within_half_a_percent_and_3_sigma']:.1f} %</tr>")
        parts.append("</table>" + maps[lamp["lamp"]])
    return "\n".join(parts)


def sheet_of(luxfield, lamp, folder, arguments):
    subprocess.run([luxfield, "export", str(lamp), "--to", "blender", "-o", str(folder / "lamp.json"), "--quiet"], check=True,
                   stdout=subprocess.DEVNULL)
    light = Lamp(folder)
    places = [light.receivers(arguments.receivers, np.random.default_rng(arguments.seed))]
    places += [light.plane(z, arguments.columns) for _, z in PLANES_M]
    positions, normals = (np.concatenate(part) for part in zip(*places))
    true = exact(luxfield, lamp, folder, positions, normals)
    (folder / "receivers.json").write_text(json.dumps({"position_m": positions.tolist(), "normal": normals.tolist()}))
    count, side = arguments.receivers, arguments.columns
    slices = {name: slice(count + k * side**2, count + (k + 1) * side**2) for k, (name, _) in enumerate(PLANES_M)}
    facts, maps = {}, []
    for name, part in slices.items():
        plane = true[part].reshape(side, side)
        maps.append(f"<h3>{name}: {dict(PLANES_M)[name]:g} m, up to {plane.max():.4g} lx</h3>")
        maps.append(picture(grey(plane, plane.max()), "exact"))
        maps.append(f"<!--{name}-->")
    text = "".join(maps)
    for name in arguments.programs:
        said = judged(luxfield, lamp, folder, name)
        if isinstance(said, str):
            print(f"sheet: {lamp.name}: {said}", file=sys.stderr)
            facts[name] = {"missing": said}
            continue
        found, sigma, program = said
        facts[name] = {"program": program if name != "glTF" else "glTF: " + program,
                       "receivers": figures(found[:count], sigma[:count], true[:count], positions[:count, 2]), "planes": {}}
        facts[name]["agrees"] = agrees(facts[name]["receivers"])
        for plane_name, part in slices.items():
            top = true[part].max()
            off = (found[part] - true[part]) / top
            facts[name]["planes"][plane_name] = {
                "distance_m": dict(PLANES_M)[plane_name], "largest_exact_lx": float(top),
                "rms_of_brightest": float(np.sqrt((off**2).mean())), "largest_of_brightest": float(np.abs(off).max()),
                "median_sigma_of_brightest": float(np.median(sigma[part]) / top)}
            text = text.replace(f"<!--{plane_name}-->", picture(grey(found[part].reshape(side, side), top), name) +
                                picture(signed(off.reshape(side, side), 0.01),
                                        f"off by, of the brightest: red +1 %, blue -1 %; rms {100 * np.sqrt((off**2).mean()):.2f} %") +
                                f"<!--{plane_name}-->")
        print(f"sheet: {lamp.name}: {program}: mean {100 * facts[name]['receivers']['mean']:+.3f} %, median size "
              f"{100 * facts[name]['receivers']['median_size']:.2f} %", file=sys.stderr, flush=True)
    return facts, text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lamps", nargs="+", type=pathlib.Path, metavar="lamp.lf.exr")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    parser.add_argument("--luxfield", default="luxfield", help="the program (default: that of the PATH)")
    parser.add_argument("--program", dest="programs", action="append", choices=[to for to, *_ in PROGRAMS.values()],
                        help="only this one; can be repeated (default: all)")
    parser.add_argument("--receivers", type=int, default=500)
    parser.add_argument("--columns", type=int, default=11)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    arguments.programs = [name for name, (to, *_) in PROGRAMS.items() if to in (arguments.programs or [to])]
    arguments.output.mkdir(parents=True, exist_ok=True)
    sheet, maps, good = {"seed": arguments.seed, "lamps": []}, {}, True
    for lamp in arguments.lamps:
        name = lamp.name.removesuffix(".lf.exr")
        with tempfile.TemporaryDirectory(prefix="luxfield-sheet-") as work:
            facts, maps[name] = sheet_of(arguments.luxfield, lamp.resolve(), pathlib.Path(work), arguments)
        sheet["lamps"].append({"lamp": name, "programs": facts})
        good &= all(f["agrees"] for f in facts.values() if "missing" not in f)
    (arguments.output / "sheet.json").write_text(json.dumps(sheet, indent=1) + "\n")
    (arguments.output / "sheet.html").write_text(page(sheet, maps) + "\n")
    print(f"sheet: {arguments.output / 'sheet.html'}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
