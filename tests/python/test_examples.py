"""Every example runs, draws a picture that is not empty, says what is true, and is a notebook too."""

import ast
import os
import re
import subprocess
import sys

import matplotlib.pyplot as plt
import pytest

from conftest import SOURCE

sys.path.insert(0, str(SOURCE / "docs/site"))
import notebooks  # noqa: E402

SCRIPTS = sorted((SOURCE / "python/examples").glob("*.py"))


def number(pattern, text):
    return float(re.search(pattern, text)[1])


def table_is_more_even(said):
    assert number(r"after: .* over mean ([\d.]+)", said) > 0.1 + number(r"before: .* over mean ([\d.]+)", said)


def wall_catches_the_flux(said):
    caught, flux = map(float, re.search(r"on the wall (\d+) lm of (\d+) lm", said).groups())
    assert caught == pytest.approx(flux, rel=0.005)


def finer_discs_are_nearer(said):
    far = [abs(float(e)) for e in re.findall(r"at 2 m ([-+][\d.]+)%", said)]
    assert len(far) == 3 and far[2] < far[1] < far[0] and far[2] < 1


def budget_holds_the_truth(said):
    pairs = re.findall(r"whole budget +([\d.]+) lx, difference from the truth +([-+][\d.]+) lx", said)
    assert len(pairs) == 7 and all(abs(float(off)) < 3 * float(sigma) for sigma, off in pairs)


def light_field_samples_best(said):
    near = [float(s) for s in re.findall(r"one sample ([\d.]+) near", said)]
    assert len(near) == 3 and near[2] < min(near[:2]) / 2


def sky_integrates(said):
    found, stated = map(float, re.search(r"pixels (\d+) lx, stated (\d+) lx", said).groups())
    assert found == pytest.approx(stated, rel=0.01)


def far_field_is_good_from(said):
    assert 1 < number(r"good for 5% .* from ([\d.]+) m", said) < 20


TRUE = {"place_lamps": table_is_more_even, "lux_on_a_wall": wall_catches_the_flux,
        "lamp_from_a_function": finer_discs_are_nearer, "error_bars": budget_holds_the_truth,
        "sampling_strategies": light_field_samples_best, "sky": sky_integrates,
        "near_and_far": far_field_is_good_from}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_an_example_runs_and_draws(script, tmp_path):
    if script.stem == "place_lamps":
        pytest.importorskip("scipy")
    done = subprocess.run([sys.executable, script, tmp_path], capture_output=True, text=True,
                          env=os.environ | {"MPLBACKEND": "Agg", "TMPDIR": str(tmp_path)})
    assert done.returncode == 0, done.stderr
    picture = plt.imread(tmp_path / f"{script.stem}.png")
    assert picture.shape[1] > 500 and picture[..., :3].std() > 0.05
    if script.stem in TRUE:
        TRUE[script.stem](done.stdout)


def test_there_are_ten():
    assert len(SCRIPTS) == 10


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_an_example_is_a_notebook(script, tmp_path):
    text = script.read_text()
    made = notebooks.notebook(text)
    code = ["".join(cell["source"]) for cell in made["cells"] if cell["cell_type"] == "code"]
    words = ["".join(cell["source"]) for cell in made["cells"] if cell["cell_type"] == "markdown"]
    assert words[0].startswith("# ") and "sys.argv" not in "".join(code)
    # The cells together are the script, but for where its files go.
    body = ast.parse(text.replace(notebooks.FOLDER, 'folder = pathlib.Path(".")')).body[1:]
    assert [ast.dump(node) for cell in code for node in ast.parse(cell).body] == [ast.dump(node) for node in body]
    assert notebooks.write(script, tmp_path).name == f"{script.stem}.ipynb"
