"""What may not end the interpreter: too little memory, objects without a value. Each in a process of its own."""

import os
import subprocess
import sys

import numpy as np
import pytest

FIELD = """
import numpy as np, luxfield
field = luxfield.LightField(np.ones((1, 1, 2, 2), np.float32), grid=(1, 1), spacing_m=0.1, delta_m=1, texel_m=0.5,
                            basis="box")
sampler = luxfield.Sampler(field)
"""
# Beyond what the libraries take for themselves and their threads; 8 n^2 bytes of n = 300000 are 720 GB. The address
# sanitizer's own take terabytes; ASAN_OPTIONS bounds what it hands out (run).
LIMIT = "" if "libasan" in os.environ.get("LD_PRELOAD", "") else """
import resource
resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
"""


def run(code):
    """What a Python of its own prints, which has to live to its end."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, f"{done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.mark.parametrize("call", [
    "field.irradiance(along[:, None], along[None])",
    "field.radiance(along[:, None, :2], along[None, :, :2])",
    "sampler.sample(along[:, None], along[None], along[:1, :2])",
    "sampler.pdf(along[:, None], along[None], along[:1])",
    "sampler.radiance(along[:, None], along[None])",
    "field.intensity(np.broadcast_to(along[:1], (10**11, 3)))",
    "field.light_vector(np.broadcast_to(along[:1], (10**11, 3)))",
    "luxfield.LightField(np.broadcast_to(np.float32(1), (1, 1, 10**6, 10**6)), grid=(1, 1), spacing_m=0.1, delta_m=1,"
    " texel_m=0.5)",
    "luxfield._luxfield.basis_values('box', np.broadcast_to(0.5, 10**12))",
])
def test_what_memory_does_not_hold_raises(call):
    run(LIMIT + FIELD + f"""
along = np.ones((300000, 3))
try:
    {call}
    raise SystemExit("no error")
except MemoryError:
    pass
assert np.isfinite(field.irradiance([0, 0, 1.0], [0, 0, -1])).all()
""")


def test_shapes_whose_product_overflows_raise():
    """(2^22)^3 vectors are 0 modulo 2^64."""
    run(LIMIT + FIELD + """
along = np.ones((2**22, 3))
try:
    sampler.pdf(along[:, None, None], along[None, :, None], along[None, None])
    raise SystemExit("no error")
except (MemoryError, ValueError):
    pass
""")


def test_arguments_are_broadcast_without_copies():
    """Two arguments of 8 M vectors would take 128 MB each, the result is 64 MB."""
    grew = run(FIELD + """
import re
peak = lambda: 1024 * int(re.search(r'VmHWM:\\s+(\\d+)', open('/proc/self/status').read())[1])
few = np.zeros((2, 2))
field.radiance(few, few)
before = peak()
found = field.radiance(np.zeros((4000, 1, 2)), np.zeros((1, 2000, 2)))
print((peak() - before) / found.nbytes)
""")
    assert float(grew) < 1.5


def test_every_way_to_broadcast_finds_the_same_vectors(lambertian, seed):
    random = np.random.default_rng(seed)
    for shape, other in [((4, 1, 3), (1, 5, 1)), ((2, 1), (3, 1, 4)), ((), (2, 3)), ((1, 1), (1,)), ((3, 2), (3, 2)),
                         ((0, 3), (1, 3)), ((1, 4), (6, 1, 1))]:
        u, s = 0.02 * random.standard_normal((*shape, 2)), 0.5 * random.standard_normal((*other, 2))
        common = np.broadcast_shapes(shape, other)
        found = lambertian.radiance(u, s)
        assert found.shape == (*common, 1)
        copied = lambertian.radiance(np.broadcast_to(u, (*common, 2)).copy(), np.broadcast_to(s, (*common, 2)).copy())
        assert np.array_equal(found, copied)
        points, normals = np.insert(u, 2, 1.0, -1), np.insert(s, 2, -1.0, -1)
        assert np.array_equal(lambertian.irradiance(points, normals),
                              lambertian.irradiance(*[np.broadcast_to(a, (*common, 3)).copy() for a in (points, normals)]))


def test_an_object_of_new_alone_raises_whatever_is_asked_of_it():
    """Every class of the module, and every property and method of it."""
    run("""
from luxfield import _luxfield
AT = [0, 0, 1.0]
METHODS = {
    "LightField": {"write": ["/dev/null/x"], "radiance": [AT[:2]] * 2, "irradiance": [AT] * 2, "light_vector": [AT],
                   "intensity": [AT]},
    "Measurements": dict.fromkeys(["irradiance", "sigma", "count", "mask", "displacement_m"], [0, 0]),
    "Sampler": {"sample": [AT, AT, AT[:2]], "pdf": [AT] * 3, "radiance": [AT] * 2},
    "Environment": {"radiance": [AT]},
    "FileKind": {"__int__": [], "__index__": [], "__hash__": []},
}
classes = [thing for thing in vars(_luxfield).values() if isinstance(thing, type)]
assert {kind.__name__ for kind in classes} == set(METHODS)
for kind in classes:
    methods = {"__repr__": [], **METHODS[kind.__name__]}
    if kind is _luxfield.Sampler:
        del methods["__repr__"]  # Python's own
    properties = [name for name, member in vars(kind).items() if isinstance(member, property) and name[0] != "_"]
    known = {*methods, *properties, "read", "from_function", "plot", "plot_intensity"}
    missed = [name for name in vars(kind) if not name.startswith("_") and name not in known
              and not isinstance(vars(kind)[name], kind)]
    assert not missed, (kind, missed)
    for name in [*properties, *methods]:
        made = kind.__new__(kind)
        try:
            getattr(made, name)(*methods[name]) if name in methods else getattr(made, name)
            raise SystemExit(f"{kind.__name__}.{name} gives something")
        except TypeError as error:
            assert "holds nothing" in str(error), (kind, name, error)
try:
    _luxfield.Sampler(_luxfield.LightField.__new__(_luxfield.LightField))
    raise SystemExit("a sampler of nothing")
except TypeError as error:
    assert "holds nothing" in str(error)
""")
