"""One call of the Python module, drawn by a seed: arguments of any shape and type, spoilt files, odd
targets, objects that no constructor made."""

import os
import stat

import luxfield
from luxfield import _luxfield as compiled
import numpy as np

READERS = {
    "x.lf.exr": luxfield.LightField, "x.meas.exr": luxfield.Measurements, "sky.hdr": luxfield.Environment,
}  # fmt: skip


def array(random, last=3):
    """What somebody passes as points, directions or normals."""
    big = random.choice([7, 1000, 40000, 300000])
    shape = random.choice(
        [(last,), (1, last), (big, last), (big, 1, last), (1, big, last), (2, 3, last), (0, last), (last, big),
         (last - 1,), (), (1,) * 40 + (last,), (big,), (last, last, last)]
    )  # fmt: skip
    try:
        values = np.full(shape, 0.25) if len(shape) < 33 else np.zeros(last)
    except ValueError:
        values = np.zeros(last)
    act = random.randrange(14)
    if act == 0:
        return values.astype(random.choice(["f2", ">f8", "i1", "u8", "?", "c16", "f4"]))
    if act == 1 and values.size:
        values.flat[random.randrange(values.size)] = random.choice([np.nan, np.inf, -np.inf, 1e308, 1e-320])
    if act == 2:
        return values[..., ::-1]
    if act == 3:
        return np.broadcast_to(values, (2,) + values.shape) if values.ndim < 32 else values
    if act == 4:
        return random.choice([None, "x", [[0, 0, 1], [0, 1]], [0, 0, "1"], {"x": 1}, object(), b"012", range(3), 5])
    if act == 5:
        return np.array(["a", "b", "c"])
    if act == 6:
        return values.astype(object)
    if act == 7:
        return np.zeros(3, dtype=[("a", "f4")])
    if act == 8:
        values.flags.writeable = False
    return values


def lamp(random):
    if random.random() < 0.4:
        return luxfield.LightField.read("x.lf.exr")
    if random.random() < 0.2:
        return luxfield.LightField.__new__(luxfield.LightField)
    images, channels, rows, columns = (random.choice([0, 1, 2, 3, 4, 16]) for _ in range(4))
    if random.random() < 0.6:
        images, channels, rows, columns = 4, 1, 5, 6
    number = lambda usual: usual if random.random() < 0.8 else random.choice([0, -1, 1e300, np.nan, 1e-300, 10**30])  # noqa: E731
    return luxfield.LightField(
        array(random) if random.random() < 0.1 else np.ones((images, channels, rows, columns)),
        grid=random.choice([(2, 2)] * 6 + [(0, 4), (-2, -2), (2**31 - 1, 2**31 - 1), (1, 4)]),
        spacing_m=number(0.02), delta_m=number(0.3), texel_m=number(0.02),
        basis=random.choice(["bspline2"] * 4 + ["box", "quadratic", "x", ""]), basis_a=number(0.5),
        unit=random.choice(["lm", "W", "relative", "\x1b[31m"]),
        corner_m=random.choice([None, None, (0, 0), (np.nan, 1e308)]),
        provenance=random.choice([{}, {"a": "b"}, {"": "\0"}, {"x": "é" * 70000}]),
    )  # fmt: skip


def of_lamp(random):
    field = lamp(random)
    act = random.randrange(9)
    if act == 0:
        field.radiance(array(random, 2), array(random, 2))
    elif act < 4:
        field.irradiance(array(random), array(random))
    elif act == 4:
        field.light_vector(array(random))
    elif act == 5:
        field.intensity(array(random))
    elif act == 6:
        sampler = luxfield.Sampler(field)
        sampler.sample(array(random), array(random), array(random, random.choice([2, 4])))
        sampler.pdf(array(random), array(random), array(random))
    elif act == 7:
        repr(field), field.C, field.flux, field.grid, field.provenance, field.basis, field.top_left_m, field.unit
    else:
        write(random, field)


def write(random, field):
    """Only regular files are replaced, and those whole or not at all."""
    target = "o.lf.exr"
    act = random.randrange(7)
    if act == 0:
        os.mkfifo(target)
    elif act == 1:
        os.mkdir(target)
    elif act == 2:
        os.symlink(random.choice(["/dev/null", "/dev/full"]), target)
    elif act == 3:
        target = random.choice(["", "/", "nowhere/o.lf.exr", "x" * 300, "a\0b", "-o"])
    elif act == 4:
        with open(target, "w") as file:
            file.write("before")
    kind = stat.S_IFMT(os.lstat(target).st_mode) if act in (0, 1, 2, 4) else None
    try:
        field.write(target)
    except Exception:
        if kind == stat.S_IFREG:
            assert open(target).read() == "before", "a file that could not be written was changed"
        raise
    finally:
        if kind is not None and act != 4:
            assert stat.S_IFMT(os.lstat(target).st_mode) == kind, "what is no file was replaced"
        assert not [name for name in os.listdir(".") if name.startswith(".")], "a hidden file is left"


def of_file(random):
    name, kind = random.choice(list(READERS.items()))
    made = kind.__new__(kind) if random.random() < 0.3 else kind.read(name)
    for attribute in dir(made):
        if not attribute.startswith("_"):
            getattr(made, attribute)
    repr(made)
    if kind is luxfield.Measurements:
        i, j = (random.choice([0, 1, -1, 5, 2**31, 1.5, None]) for _ in range(2))
        made.irradiance(i, j), made.sigma(i, j), made.count(i, j), made.mask(i, j), made.displacement_m(i, j)
    if kind is luxfield.Environment:
        made.radiance(array(random))


def of_module(random):
    count = random.choice([0, 1, 5, -1, 10**5, 2**31, 2**63, 1.5, None])
    number = random.choice([0.5, 0, -1, np.nan, 1e300, None])
    basis = random.choice(["bspline2", "box", "quadratic", "", "x" * 10**6, None])
    random.choice(
        [
            lambda: compiled.gram_matrix(basis, count, number),
            lambda: compiled.basis_values(basis, array(random), number),
            lambda: compiled.basis_cells(basis),
            lambda: compiled.set_threads(count),
            lambda: compiled.what_is(random.choice(["x.lf.exr", "sky.hdr", "", ".", "-", "a\0b", "no"])),
            lambda: compiled.read_exr_layers("x.lf.exr"),
            lambda: compiled.read_exr_attributes("x.meas.exr"),
            lambda: compiled.read_hdr("sky.hdr"),
            lambda: type(luxfield.Sampler).__call__(luxfield.Sampler, lamp(random)),
            lambda: luxfield.Sampler.__new__(luxfield.Sampler).pdf(array(random), array(random), array(random)),
        ]
    )()


def of_verb(random):
    name = random.choice(["x.lf.exr", "x.meas.exr", "--help", "-x", "", "no", "a b", "\x1b[31m"])
    random.choice([luxfield.info, luxfield.photometry, luxfield.preprocess, luxfield.verify])(name)


def call(random):
    random.choice([of_lamp] * 6 + [of_file] * 3 + [of_module] * 2 + [of_verb])(random)
