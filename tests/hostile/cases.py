"""What a case runs: verbs, the files of the corpus that it gives them and may spoil, what they write."""

from dataclasses import dataclass, field


@dataclass
class Template:
    weight: int
    words: str
    inputs: str  # copied into the case's folder, as NAME=OTHER; the first `spoilt` may be spoilt
    outputs: str = ""
    spoilt: int = 1
    before: str = ""  # what is run first, unspoilt
    made: str = ""  # by that, which may be spoilt, too
    then: str = ""  # what is run after a success
    right: str = ""  # NAME=OTHER: an output that, if it is there, is that file of the corpus to the byte
    program: str = "luxfield"  # or "reload", "python", "node" (hostile.py)
    keeps: str = ""  # a session that is left as it is where nothing is spoilt


def job(verb, shards):
    """What does a whole job of the corpus' VERB.job.toml."""
    runs = "".join(f"; shard run job {n}" for n in range(shards))
    return f"shard plan {verb}.job.toml -o job" + runs


JOBS = [
    # Inputs, what a job of them is gathered to, what the verb itself writes.
    ("merge", "s", 3, "o.meas.exr=x.meas.exr"),
    ("reconstruct", "x.meas.exr", 3, "o.lf.exr=x.lf.exr o.sigma.lf.exr=x.sigma.lf.exr"),
    ("preprocess", "x.lf.exr", 2, "o.tab.exr=x.tab.exr"),
]


def of_jobs():
    templates = []
    for verb, input_, shards, right in JOBS:
        inputs, outputs = f"{verb}.job.toml {input_}", " ".join(r.split("=")[0] for r in right.split())
        whole = dict(spoilt=0, before=job(verb, shards), made="job", right=right)
        templates += [
            Template(2, f"shard plan {verb}.job.toml -o job", inputs, "job/job.json", spoilt=2),
            Template(5, "shard gather job", inputs, outputs, **whole),
            Template(3, "shard run job 1", inputs, outputs, then="shard gather job", **whole),
            Template(2, "shard status job --hashes --json o.json", inputs, outputs + " o.json", then="shard gather job",
                     **whole),
            Template(1, "shard submit job --engine slurm --only-write", inputs, **whole),
        ]  # fmt: skip
    return templates


MESH = "m.obj m.mtl m.ply m.gltf m.bin t.png"
QUALITY = "lamp.csv camera.csv q.cal.json"
TEMPLATES = [
    # A file of every kind, looked at.
    Template(10, "info x.lf.exr --json o.json", "x.lf.exr", "o.json"),
    Template(6, "info x.meas.exr", "x.meas.exr"),
    Template(5, "info x.tab.exr", "x.tab.exr"),
    Template(4, "info sky.exr", "sky.exr"),
    Template(5, "info sky.hdr --layout latitude-longitude", "sky.hdr"),
    Template(4, "info r.tm25ray", "r.tm25ray"),
    Template(5, "info lamp.ies --json o.json", "lamp.ies", "o.json"),
    Template(5, "info lamp.ldt", "lamp.ldt"),
    Template(4, "info lamp.xml", "lamp.xml"),
    Template(4, "info x.gldf", "x.gldf"),
    Template(3, "info x.dat", "x.dat"),
    Template(3, "info lt.txt", "lt.txt"),
    Template(2, "info q.flat.exr", "q.flat.exr"),
    Template(3, "info day", "day"),
    Template(6, "info s", "s"),
    Template(7, "info bare.toml", f"bare.toml {MESH}", spoilt=7),
    Template(3, "info lit.toml", f"lit.toml x.lf.exr sky.hdr {MESH}", spoilt=3),
    Template(3, "info far.toml --json o.json", f"far.toml {MESH}", "o.json"),
    # Plans and labs.
    Template(8, "plan plan.toml --lab lab.toml --json o.json", "plan.toml lab.toml", "o.json", spoilt=2),
    Template(4, "plan sensor.plan.toml --lab sensor.lab.toml", "sensor.plan.toml sensor.lab.toml", spoilt=2),
    Template(6, "capture plan.toml o --lab lab.toml --dry-run", "plan.toml lab.toml", spoilt=2),
    Template(3, "capture plan.toml o.session --lab lab.toml", "plan.toml lab.toml", spoilt=2),
    Template(3, "simulate lab.toml --plan plan.toml -o o.lf.exr", "lab.toml plan.toml", "o.lf.exr", spoilt=2),
    Template(2, "devices lab.toml", "lab.toml"),
    Template(2, "filter print --lab lab.toml --dpi 60 -o o", "lab.toml", "o.tif o.pdf o.sheet.json"),
    # Sessions.
    Template(8, "verify s --json o.json", "s", "o.json"),
    Template(6, "report s -o o.html", "s", "o.html"),
    Template(8, "merge s -o o.meas.exr", "s", "o.meas.exr"),
    Template(4, "merge s -o o.meas.exr --lamp-level monitor --skip-hashes --json o.json", "s", "o.meas.exr o.json"),
    Template(3, "merge s -o o.meas.exr --calibration q.cal.json", "q.cal.json s", "o.meas.exr", spoilt=2),
    Template(2, "merge s -o o.meas.exr --flat-field q.flat.exr", "q.flat.exr s", "o.meas.exr"),
    Template(5, "budget s --uncertainty budget.toml --report o.html", "budget.toml s", "o.html", spoilt=2),
    Template(3, "capture plan.toml u --lab lab.toml --resume", "u plan.toml lab.toml", spoilt=3),
    Template(2, "verify u --salvage", "u", keeps="u"),
    Template(3, "verify s --salvage", "s", keeps="s"),
    Template(3, "calibrate sensor q -o o.cal.json --report o.html", "q", "o.cal.json o.html"),
    Template(2, "calibrate flat-field q -o o.flat.exr", "q", "o.flat.exr"),
    Template(2, "calibrate glare s -o o.cal.json", "s", "o.cal.json"),
    Template(2, "calibrate geometry s -o o.cal.json", "s", "o.cal.json"),
    Template(2, "filter measure s -o o.filter.exr", "s", "o.filter.exr"),
    Template(2, "filter measure --sheet f.sheet.json --light short.exr --print long.exr -o o.filter.exr",
             "f.sheet.json short.exr long.exr", "o.filter.exr", spoilt=3),
    # Light fields and pictures.
    Template(8, "reconstruct x.meas.exr -o o.lf.exr --sigma o.sigma.lf.exr", "x.meas.exr", "o.lf.exr o.sigma.lf.exr"),
    Template(6, "preprocess x.lf.exr -o o.tab.exr", "x.lf.exr", "o.tab.exr"),
    Template(2, "preprocess x.lf.exr -o o.tab.exr --scene lit.toml --receivers 20",
             f"lit.toml x.lf.exr sky.hdr {MESH}", "o.tab.exr o.lf.exr", spoilt=9),
    Template(4, "photometry x.lf.exr -o o.html --json o.json", "x.lf.exr", "o.html o.json"),
    Template(5, "compare x.lf.exr y.lf.exr --json o.json", "x.lf.exr x.lf.exr=y.lf.exr", "o.json", spoilt=2),
    Template(4, "compare sky.exr y.exr -d o.exr", "sky.exr sky.exr=y.exr", "o.exr", spoilt=2),
    Template(5, "import r.tm25ray -o o.lf.exr --grid 5 5 --lattice 8 8 --faces beam", "r.tm25ray", "o.lf.exr"),
    Template(3, "import x.ltrf -o o.lf.exr --grid 5 5 --lattice 8 8 --faces beam", "x.ltrf", "o.lf.exr"),
    Template(3, "import x.speos.ray -o o.lf.exr --grid 5 5 --lattice 8 8 --faces beam --signed", "x.speos.ray", "o.lf.exr"),
    Template(3, "export x.lf.exr -o o.dat --rays 500", "x.lf.exr", "o.dat"),
    Template(2, "export x.lf.exr -o o.rad", "x.lf.exr", "o.rad o.rad.cal o.rad.dat"),
    Template(2, "export x.lf.exr -o o.pbrt", "x.lf.exr", "o.pbrt o.pbrt.far.pbrt o.pbrt.far.exr"),
    Template(3, "export x.lf.exr -o o.ldt --plane-step 45 --angle-step 15", "x.lf.exr", "o.ldt"),
    Template(2, "export x.lf.exr -o o.hdr --size 9 7 --samples 1", "x.lf.exr", "o.hdr"),
    Template(4, "merge a.png b.png c.png --exposure 0.1 0.4 1.6 --calibration r.cal.json -o o.exr",
             "a.png b.png r.cal.json c.png", "o.exr", spoilt=3),
    Template(2, "calibrate response a.png b.png c.png --exposure 0.1 0.4 1.6 --samples 200 -o o.cal.json",
             "a.png b.png c.png", "o.cal.json", spoilt=3),
    Template(3, "probe probe.toml -o o.exr --face-size 8", "probe.toml short.exr long.exr", "o.exr", spoilt=3),
    Template(1, "render lit.toml -o o.exr --estimator windowed --spp 2 --shadows none --png o.png",
             f"lit.toml x.lf.exr sky.hdr {MESH}", "o.exr o.png", spoilt=9),
    Template(3, "render far.toml -o o.exr --spp 4 --shadows none", f"far.toml lamp.ies lamp.ldt lamp.xml {MESH}", "o.exr",
             spoilt=4),
    Template(1, "render lit.toml -o o.exr --spp 2 --tables x.tab.exr --shadows none",
             f"lit.toml x.tab.exr x.lf.exr sky.hdr {MESH}", "o.exr", spoilt=3),
    Template(2, "view lit.toml --record path.toml -o o --preview", f"path.toml lit.toml x.lf.exr sky.hdr {MESH}",
             "o", spoilt=3),
    Template(3, "relight groups.exr --scale environment=0.5 -o o.exr --json o.json", "groups.exr", "o.exr o.json"),
    Template(2, "sky -o o.hdr --latitude 48 --date 2024-06-21 --height 32", "", "o.hdr", spoilt=0),
    # Documents of what was asked: all text is in them.
    Template(5, "photometry x.lf.exr --sigma x.sigma.lf.exr --ask ask.toml -o o.pdf", f"ask.toml x.lf.exr x.sigma.lf.exr {QUALITY}",
             "o.pdf"),
    Template(3, "photometry x.lf.exr --ask ask.toml -o o.html --json o.json", f"ask.toml {QUALITY} x.lf.exr", "o.html o.json",
             spoilt=5),
    Template(2, "photometry x.lf.exr --ask ask.toml -o o.csv", f"ask.toml x.lf.exr {QUALITY}", "o.csv"),
    Template(2, "photometry x.lf.exr --sigma x.sigma.lf.exr --ask ask.toml --session s --uncertainty budget.toml -o o.pdf",
             f"ask.toml budget.toml s x.sigma.lf.exr x.lf.exr {QUALITY}", "o.pdf", spoilt=4),
    Template(2, "photometry x.lf.exr --sigma x.sigma.lf.exr --ask ask.toml -o o.cert.json",
             f"ask.toml x.sigma.lf.exr x.lf.exr {QUALITY}", "o.cert.json", spoilt=3),
    # A cache that somebody spoilt costs time and changes nothing.
    Template(2, "render small.toml -o o.exr --estimator volume --shadows none", "cache small.toml x.lf.exr", "o.exr",
             right="o.exr=small.exr"),
    Template(2, "cache --json o.json", "cache", "o.json"),
    Template(1, "cache --size 1KiB", "cache"),
    Template(1, "cache --clear", "cache"),
    # Files that are written while the window shows them; lamps in a page; the Python module.
    Template(1, "reload small.toml small.toml x.lf.exr", "small.toml x.lf.exr", spoilt=2, program="reload"),
    Template(1, "reload x.lf.exr x.lf.exr", "x.lf.exr", program="reload"),
    Template(4, "lamp.glb", "lamp.glb", program="node"),
    Template(8, "", "x.lf.exr x.meas.exr sky.hdr", spoilt=3, program="python"),
    Template(1, "bench --help", "", spoilt=0),
    Template(2, "devices", "", spoilt=0),
    *of_jobs(),
]  # fmt: skip


def leave_out(program):
    """The cases of a program that cannot run here; the others draw other numbers then."""
    TEMPLATES[:] = [template for template in TEMPLATES if template.program != program]


WORDS = [
    "", "-", "--", "--json", "--help", "nan", "inf", "-1", "0", "1e300", "99999999999999999999", "x", "/dev/full",
    "/nonexistent/x", ".", "\x1b[31m", "\u00e9" * 300, "--seed", "--threads", "4097", "s", "x.lf.exr", "plan.toml",
    "--quiet=maybe", "rendr", "--sppp", "1%", "5", "a" * 5000,
]  # fmt: skip


def argue(random, words):
    """Words of the command line, mistaken."""
    words = list(words)
    for _ in range(random.choice([1, 1, 2])):
        at = random.randrange(len(words) + 1)
        act = random.randrange(5)
        if act == 0:
            words.insert(at, random.choice(WORDS))
        elif act == 1 and words:
            del words[min(at, len(words) - 1)]
        elif act == 2 and words:
            words[min(at, len(words) - 1)] = random.choice(WORDS)
        elif act == 3 and words:
            one, other = random.randrange(len(words)), random.randrange(len(words))
            words[one], words[other] = words[other], words[one]
        elif words:
            word = words[min(at, len(words) - 1)]
            cut = random.randrange(len(word) + 1)
            words[min(at, len(words) - 1)] = word[:cut] + random.choice(["", "x", word[cut:][::-1]])
    return [word.replace("\0", "") for word in words]


STREAMS = (
    ["/dev/null"] * 6 + ["closed", "/dev/zero"],
    ["out"] * 8 + ["closed", "clogged", "/dev/full"],
    ["err"] * 9 + ["closed", "/dev/full"],
)


@dataclass
class Case:
    """Everything that one seed decides before the files are spoilt."""

    template: Template
    words: list
    streams: dict
    limits: dict
    spoil: list = field(default_factory=list)


def draw(random, of=""):
    """A case, of templates whose words begin so or whose program it is."""
    templates = [t for t in TEMPLATES if t.words.startswith(of) or of == t.program]
    template = random.choices(templates, [t.weight for t in templates])[0]
    if template.program != "luxfield":
        names = template.inputs.split()[: template.spoilt]
        spoil = random.sample(names, random.randrange(template.program == "reload", len(names) + 1))
        words = ["python", random.getrandbits(48)] if template.program == "python" else template.words.split()
        return Case(template, words, {"stdin": "/dev/null", "stdout": "out", "stderr": "err"}, {}, spoil)
    words = template.words.split()
    streams, limits, spoil = {"stdin": "/dev/null", "stdout": "out", "stderr": "err"}, {}, []
    act = random.random()
    names = template.inputs.split()[: template.spoilt] + template.made.split()
    if act < 0.72 and names:
        spoil = random.sample(names, min(len(names), random.choice([1, 1, 1, 2])))
    elif act < 0.84 or not names:
        words = argue(random, words)
    elif act < 0.92:
        for name, choices in zip(streams, STREAMS):
            streams[name] = random.choice(choices)
    else:
        limits = random.choice(
            [{"fsize": random.choice([0, 100, 4096, 50000])}, {"nofile": random.choice([3, 4, 6, 10, 30])},
             {"space": random.choice([0, 10**6, 3 * 10**7, 10**8, 3 * 10**8])}]
        )  # fmt: skip
    return Case(template, words + ["--quiet"] * (random.random() < 0.97), streams, limits, spoil)
