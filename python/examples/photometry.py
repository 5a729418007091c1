"""The numbers of a data sheet from one measurement: flux, peak, beam angle, inverse-square distance, certificate.

The picture shows the intensity over angle and the uncertainty of what a data sheet states. The certificate, a PDF of
several pages, is written beside it.
"""

# %%
import pathlib
import sys
import tempfile

import matplotlib.pyplot as plt
import numpy as np

import luxfield

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
session = pathlib.Path(tempfile.mkdtemp()) / "small.session"
luxfield.capture(luxfield.data_file("plans/small.toml"), session, lab=luxfield.data_file("labs/small.toml"))
solved = luxfield.reconstruct(luxfield.merge(session, lamp_level="monitor"))

# %% [markdown]
# With the result of `reconstruct`, `photometry` knows sigma of every coefficient and states a standard uncertainty `_u`
# for every figure. Whatever else is wanted is asked by a dict.

# %%
asked = {"point": [{"name": "screen", "position_m": [0, 0, 2]}], "certificate": {"lamp": "small headlight"}}
found = luxfield.photometry(solved, ask=asked, output=folder / "photometry.pdf")
found = luxfield.photometry(solved, ask=asked)
print(found)
for name, unit in (("flux_lm", "lm"), ("intensity_axis_cd", "cd"), ("intensity_peak_cd", "cd"),
                   ("beam_angle_deg", "degrees")):
    value, u = getattr(found, name), getattr(found, name + "_u")
    print(f"{name:18} {value:10.5g} {unit}, k = 2: {2 * u:.2g} ({2 * u / value:.2%})")

# %%
lamp = solved.value
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2), constrained_layout=True)
lamp.plot_intensity(left)
left.set_title("intensity through the axis")
left.grid(alpha=0.3)
distances = sorted(float(e) for e in found.inverse_square_distance_m)
right.barh([f"within {e:g} %" for e in distances],
           [found.inverse_square_distance_m[key] for key in sorted(found.inverse_square_distance_m, key=float)],
           color="C0")
right.set_xlabel("distance / m")
right.set_title("inverse-square law holds on the axis from")
figure.savefig(folder / "photometry.png", dpi=110)
