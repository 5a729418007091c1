"""Measure a lamp in a simulated lab: capture exposure brackets behind filters, merge them, solve for the light field.

The picture shows what the camera measured behind each filter, and the coefficient images C that the solver made of it.
"""

# %%
import pathlib
import sys
import tempfile

import matplotlib.pyplot as plt
import numpy as np

import luxfield

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# %% [markdown]
# `capture` moves the stage, takes brackets and reference frames, and keeps every frame in a session folder. It can be
# stopped at any time and goes on with `resume=True`. This lab is a simulation; a lab of real devices is another file.

# %%
session = pathlib.Path(tempfile.mkdtemp()) / "small.session"
captured = luxfield.capture(luxfield.data_file("plans/small.toml"), session,
                            lab=luxfield.data_file("labs/small.toml"), progress=True)
print(captured)

# %% [markdown]
# `merge` makes one irradiance image of each bracket, with its standard deviation; `reconstruct` solves
#
#     sum_mn <Phi_ij, Phi_mn> C_mn(s) = E_ij(s).

# %%
measured = luxfield.merge(session, lamp_level="monitor")
solved = luxfield.reconstruct(measured)
print(measured)
print(solved)

# %%
lamp = solved.value
W, H = lamp.grid
figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), constrained_layout=True)
rows = [np.hstack([measured.value.irradiance(i, j)[0] for i in range(W)]) for j in reversed(range(H))]
drawn = left.imshow(np.vstack(rows), cmap="cividis")
figure.colorbar(drawn, ax=left, label="E / lx", shrink=0.8)
left.set_title(f"irradiance behind {W} × {H} filters")
left.set_xticks([])
left.set_yticks([])
lamp.plot(right)
figure.savefig(folder / "measure_a_lamp.png", dpi=110)
