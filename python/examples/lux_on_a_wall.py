"""Lux on a wall, in closed form: 40 000 receivers of a light field at once, with isolux lines.

No samples and no noise: every receiver is the exact integral over the lamp's coefficients.
"""

# %%
import pathlib
import sys
import time

import matplotlib.pyplot as plt
import numpy as np

import luxfield

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
lamp = luxfield.simulate(luxfield.data_file("labs/small.toml"), plan=luxfield.data_file("plans/small.toml")).value
print(lamp, lamp.flux)

# %%
x, y = np.meshgrid(np.linspace(-2, 2, 200), np.linspace(-2, 2, 200))
wall = np.stack([x, y, np.full_like(x, 3)], axis=-1)
begin = time.process_time()
lux = lamp.irradiance(wall, [0, 0, -1])[..., 0]
print(f"{lux.size} receivers in {time.process_time() - begin:.2f} core-seconds")

# %% [markdown]
# The illuminance integrated over a wall that catches all light is the flux: a check of both.

# %%
cell = (x[0, 1] - x[0, 0]) * (y[1, 0] - y[0, 0])
caught = lux.sum() * cell
print(f"on the wall {caught:.0f} lm of {lamp.flux[0]:.0f} lm")

# %%
figure, axes = plt.subplots(figsize=(6.4, 5), constrained_layout=True)
drawn = axes.pcolormesh(x, y, lux, cmap="cividis", shading="gouraud")
lines = axes.contour(x, y, lux, levels=[1, 10, 50, 100, 200, 400], colors="white", linewidths=0.8)
axes.clabel(lines, fmt="%g lx", fontsize=8)
figure.colorbar(drawn, label="illuminance / lx")
axes.set_aspect("equal")
axes.set_xlabel("u / m")
axes.set_ylabel("v / m")
axes.set_title("a wall 3 m ahead")
figure.savefig(folder / "lux_on_a_wall.png", dpi=110)
