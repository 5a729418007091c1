"""What the tests of the Python module share: a light field whose light is known in closed form."""

import os
import pathlib

import matplotlib
import numpy as np
import pytest

import luxfield

matplotlib.use("Agg")
SOURCE = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def source():
    return SOURCE


@pytest.fixture(scope="session")
def lambertian():
    """A square of 60 mm whose radiance is 1000 lm sr^-1 m^-2 in all directions that I, 4 m wide, shows: with box
    functions C = L cos^4(theta) / delta^2 would vary with u; between planes this far apart it is constant to 1e-3."""
    return luxfield.LightField.from_function(lambda u, s: np.full(np.broadcast_shapes(u.shape, s.shape)[:-1], 1000.0),
                                             grid=(4, 4), spacing_m=0.015, delta_m=1.0, texels=(200, 200),
                                             texel_m=0.02, basis="box", unit="lm")


@pytest.fixture(scope="session")
def small(tmp_path_factory, source):
    """The small lab's session, captured once, and its measurements and light field as Results."""
    folder = tmp_path_factory.mktemp("small")
    lab, plan = source / "data/labs/small.toml", source / "data/plans/small.toml"
    with pytest.warns(luxfield.LuxfieldWarning, match="outer filters"):
        captured = luxfield.capture(plan, folder / "session", lab=lab)
        measured = luxfield.merge(folder / "session", lamp_level="monitor")
        solved = luxfield.reconstruct(measured)
    truth = luxfield.simulate(lab, plan=plan)
    return {"session": folder / "session", "captured": captured, "measured": measured, "solved": solved,
            "truth": truth, "lab": lab, "plan": plan}


@pytest.fixture(scope="session")
def seed():
    value = int.from_bytes(os.environ.get("LUXFIELD_SEED", "1").encode(), "big") % 2**32
    print(f"seed {value} (LUXFIELD_SEED={os.environ.get('LUXFIELD_SEED', '')})")
    return value
