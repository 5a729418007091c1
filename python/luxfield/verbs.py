"""The program's verbs as functions: files or objects in, a Result out.

Every function takes paths, or objects of this module in their place (a LightField, a scene, plan or lab as a dict),
the verb's options as keywords (`non_negative=True` is `--non-negative`, see `luxfield VERB --help` for all of
them), and `progress` (None, True, or a function that is called with each line). Without `output` the result is kept
in a temporary folder as long as the Result lives.
"""

import pathlib
import shutil
import tempfile
import weakref

from . import process, toml
from ._luxfield import LightField
from .files import read


class Result:
    """What a verb did.

    figures   the numbers of `--json`, a dict; also as attributes: `result.rel_rmse`
    text      what the program prints
    output    path of the file or folder that was written, or None
    """

    def __init__(self, figures, text, output=None, kept=None):
        self.figures, self.text, self.output, self._kept = figures, text, output, kept
        self._value = None

    @property
    def value(self):
        """What was written, read once: a LightField, Measurements, a Picture, an Environment ..."""
        if self._value is None and self.output is not None:
            self._value = read(self.output)
        return self._value

    def plot(self, *arguments, **options):
        """Draws what was written (with matplotlib)."""
        return self.value.plot(*arguments, **options)

    def __getattr__(self, name):
        figures = self.__dict__.get("figures") or {}
        if name in figures:
            return figures[name]
        raise AttributeError(f"the result has no {name!r}; it has {', '.join(sorted(figures))}")

    def __dir__(self):
        return [*super().__dir__(), *self.figures]

    def __repr__(self):
        return self.text.rstrip("\n")


class _Folder:
    """A folder of temporary files, which is gone once nobody holds this.

    names   (path, name) of each file that stands for an object, with what the caller calls the object
    """

    def __init__(self):
        self.names = []
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="luxfield-"))
        weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)

    def add(self, name, ending):
        path = self.path / (name + ending)
        self.names.append((path, name))
        return path


def _path(thing, folder, name):
    """The path of an argument, which may be a path, a Result, a LightField, or a dict for a TOML file."""
    if isinstance(thing, Result):
        if thing.output and thing._kept and thing._kept.path in pathlib.Path(thing.output).parents:
            folder.names.append((thing.output, name))
        return thing.output
    if isinstance(thing, LightField):
        path = folder.add(name, ".lf.exr")
        thing.write(path)
        return path
    if isinstance(thing, dict):
        path = folder.add(name, ".toml")
        path.write_text(toml.dumps(_files_of(thing, folder)))
        return path
    return thing


def _files_of(table, folder, count=None):
    """The dict with its LightFields written to files."""
    count = [0] if count is None else count

    def one(value):
        if isinstance(value, (LightField, Result)):
            count[0] += 1
            return str(_path(value, folder, f"field{count[0]}"))
        if isinstance(value, dict):
            return _files_of(value, folder, count)
        if isinstance(value, (list, tuple)):
            return [one(v) for v in value]
        return value

    return {key: one(value) for key, value in table.items()}


# Options that name files, in whose place objects may stand.
_FILES = {"plan", "lab", "scene", "uncertainty", "light_field", "sigma", "sigma_a", "sigma_b", "ask"}


def _option(name, value, folder):
    if name == "light_field" and isinstance(value, dict):  # of several luminaires
        return {lamp: _path(one, folder, f"{name}{k}") for k, (lamp, one) in enumerate(value.items())}
    return _path(value, folder, name) if name in _FILES else value


def _numbered(name, things):
    return {f"{name}{k}": thing for k, thing in enumerate(things)}


def _run(verb, inputs, output, ending, progress, options):
    """Runs a verb of inputs by name that writes `output`, a temporary file with this ending unless it is named, or
    nothing."""
    folder = _Folder()
    inputs = [_path(thing, folder, name) for name, thing in inputs.items()]
    options = {name: _option(name, value, folder) for name, value in options.items()}
    if ending is not None:
        output = pathlib.Path(output) if output is not None else folder.path / f"output{ending}"
        options["output"] = output
    figures, text = process.run(verb, *inputs, progress=progress, names=folder.names, **options)
    return Result(figures, text, output, folder)


def simulate(lab, *, plan, output=None, progress=None, **options):
    """The true light field of a simulated lab, as a plan's planes and basis show it.

    Options: non_negative. `value` is a LightField."""
    return _run("simulate", {"lab": lab}, output, ".lf.exr", progress, {"plan": plan, **options})


def plan(plan=None, *, lab, progress=None, **options):
    """A plan expanded: positions, exposures, time and bytes; or, with max_error="5%" and scene, the plan that lights
    the scene within that error (output names the .toml)."""
    return _run("plan", {} if plan is None else {"plan": plan}, None, None, progress, {"lab": lab, **options})


def capture(plan, session, *, lab, progress=None, **options):
    """Measures what a plan says, with a real or simulated lab, into a session folder.

    Options: resume, dry_run, accept_drift. Ctrl-C ends after the bracket at hand; `resume=True` goes on."""
    result = _run("capture", {"plan": plan, "session": session}, None, None, progress, {"lab": lab, **options})
    result.output = pathlib.Path(session)
    return result


def merge(session, *, output=None, progress=None, **options):
    """Exposure brackets to irradiance with its standard deviation.

    Takes a session (Measurements), or a list of pictures of one scene (a Picture). Options: calibration, flat_field,
    lamp_level ("first-reference" or "monitor"), estimator, exposure, estimate_exposures, skip_hashes."""
    pictures = isinstance(session, (list, tuple))
    inputs = _numbered("picture", session) if pictures else {"session": session}
    return _run("merge", inputs, output, ".exr" if pictures else ".meas.exr", progress, options)


def reconstruct(measurements, *, output=None, sigma=True, progress=None, **options):
    """Solves measurements for the light field.

    `value` is a LightField; with sigma (True, or a path) `sigma` is another one that holds the standard deviation of
    its C. Options: filter, non_negative, non_negative_metric, regularise, keep, double."""
    folder = _Folder()
    sigma = folder.path / "sigma.lf.exr" if sigma is True else sigma or None
    several = isinstance(measurements, (list, tuple))
    inputs = _numbered("measurements", measurements) if several else {"measurements": measurements}
    result = _run("reconstruct", inputs, output, ".lf.exr", progress, {"sigma": sigma, **options})
    result.sigma = None if sigma is None else LightField.read(sigma)
    return result


def budget(session, *, uncertainty=None, progress=None, **options):
    """Where the uncertainty of flux, radiance and irradiance of a session comes from.

    uncertainty is a budget.toml or a dict. Options: at=(x, y, z), report, calibration, flat_field, filter ..."""
    return _run("budget", {"session": session}, None, None, progress, {"uncertainty": uncertainty, **options})


def preprocess(light_field, *, output=None, progress=None, **options):
    """Sampling tables of a light field. Options: scene, max_error, receivers."""
    return _run("preprocess", {"light_field": light_field}, output, ".tab.exr", progress, options)


def render(scene, *, output=None, progress=None, **options):
    """Lights a scene: the path of a scene.toml, or a dict with its tables, whose luminaires' `file` may be a
    LightField.

    `value` is a Picture. Options: spp=64, or error="0.5%", or time="2s"; estimator, shadows, antialias, width, height,
    light_field (of all luminaires, or {name: light field}), light_groups, transparent, knob={...}, seed, png ..."""
    return _run("render", {"scene": scene}, output, ".exr", progress, options)


def relight(picture, *, scale, output=None, progress=None, **options):
    """Dims the lights of a picture that was rendered with light_groups: scale={"left lamp": 0.5}."""
    return _run("relight", {"picture": picture}, output, ".exr", progress, {"scale": scale, **options})


def sky(*, latitude, date, output=None, progress=None, **options):
    """The sun and the sky of a place and time as an Environment.

    date="2024-06-21". Options: longitude, time="11:15", turbidity, clouds, height, layout, unit ...; with day=True
    output names a folder of frames."""
    if options.get("day") and output is None:
        raise ValueError("day=True writes a folder of frames: name it in output")
    return _run("sky", {}, output, ".exr", progress, {"latitude": latitude, "date": date, **options})


def probe(probe, *, output=None, progress=None, **options):
    """Photographs of a mirroring ball, or through a fisheye, to an Environment (docs/formats/probe.md)."""
    return _run("probe", {"probe": probe}, output, ".exr", progress, options)


def import_rays(file, *, output=None, progress=None, **options):
    """A ray file to a light field. Options: flux, faces, rotate=(x, y, z), translate, delta, grid, lattice ..."""
    return _run("import", {"file": file}, output, ".lf.exr", progress, options)


def export(light_field, output, *, progress=None, **options):
    """A light field as a file of another program, by the ending of `output`: rays (.tm25ray, .dat, .sdf, .ltrf,
    .speos.ray), intensities (.ies, .ldt, .tm33.xml, .gldf) or pictures (.hdr, .exr).

    Options: rays=1000000, distance=2.0, sigma, view="fisheye", eye=(x, y, z), check=True ..."""
    return _run("export", {"light_field": light_field}, output, "", progress, options)


def photometry(light_field, *, sigma=None, ask=None, output=None, progress=None, **options):
    """Flux, intensity, beam, illuminance, luminance, colour and headlamps of a light field, with uncertainties.

    sigma (a LightField of standard deviations, or its path) makes them; the result of `reconstruct` brings its own. ask
    is an ask.toml or a dict: {"point": [{"position_m": [0, 0, 2]}]}. output names a page (.html), a certificate (.pdf,
    .cert.json), .json or .csv. Options: session, uncertainty (of a certificate), c_step, gamma_step."""
    if sigma is None and isinstance(light_field, Result):
        sigma = light_field.__dict__.get("sigma")
    options = {"sigma": sigma, "ask": ask, **options}
    if output is None:
        return _run("photometry", {"light_field": light_field}, None, None, progress, options)
    return _run("photometry", {"light_field": light_field}, output, "", progress, options)


def compare(a, b, *, progress=None, **options):
    """How far A is from the reference B: pictures, light fields, or environment maps (environment=64).

    Of light fields `result.photometry` has flux, intensity, beam, illuminance and colour of both; sigma_a and sigma_b
    make differences in units of their uncertainty."""
    return _run("compare", {"a": a, "b": b}, None, None, progress, options)


def info(file, *, progress=None, **options):
    """What a file, session or folder is and holds."""
    return _run("info", {"file": file}, None, None, progress, options)


def verify(session, *, progress=None, **options):
    """Checks every byte of a session. Options: salvage."""
    return _run("verify", {"session": session}, None, None, progress, options)


def report(session, *, output=None, progress=None, **options):
    """How a session went, as a page."""
    return _run("report", {"session": session}, output, ".html", progress, options)


__all__ = ["Result", "simulate", "plan", "capture", "merge", "reconstruct", "budget", "preprocess", "render",
           "relight", "sky", "probe", "import_rays", "export", "photometry", "compare", "info", "verify", "report"]
