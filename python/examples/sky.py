"""Sun and sky as an environment map through a day, and what a horizontal plane receives.

The figures of `sky` are integrals in closed form of the same model that the map shows.
"""

# %%
import pathlib
import sys

import matplotlib.pyplot as plt
import numpy as np

import luxfield

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
hours = [6, 9, 12, 15, 18]

# %% [markdown]
# `utc_offset` makes the times those of a clock in Berlin; `height` is that of the map, whose sun keeps its flux however
# few pixels it has.

# %%
skies = [luxfield.sky(latitude=52.5, longitude=13.4, date="2024-06-21", time=f"{h:02}:00", utc_offset=2, height=96)
         for h in hours]
print(skies[2])
total = np.array([s.global_horizontal_lx for s in skies])
diffuse = np.array([s.diffuse_horizontal_lx for s in skies])

# %% [markdown]
# A map is an `Environment`: its pixels are an array and `radiance` looks along directions. Integrated over the upper
# hemisphere by rows, without the sun's own pixels, it gives the diffuse part again.

# %%
noon = skies[2].value
rows, columns = noon.pixels.shape[1:]
polar = (np.arange(rows) + 0.5) * np.pi / rows
pixel = (np.cos(polar - np.pi / rows / 2) - np.cos(polar + np.pi / rows / 2)) * 2 * np.pi / columns
L = luxfield.luminance(noon.pixels)
up = np.maximum(np.cos(polar), 0)[:, None] * pixel[:, None]
sun = L > 1e6
print(f"sky without the sun's pixels {np.sum(np.where(sun, 0, L) * up):.0f} lx, stated {diffuse[2]:.0f} lx")

# %%
figure, (top, bottom) = plt.subplots(2, 1, figsize=(6.6, 6), constrained_layout=True)
noon.plot(top)
top.set_title("Berlin, 21 June, 12:00")
bottom.plot(hours, total / 1000, "o-", label="sun and sky")
bottom.plot(hours, diffuse / 1000, "s--", label="sky alone")
bottom.set_xlabel("time / h")
bottom.set_ylabel("horizontal illuminance / klx")
bottom.set_ylim(bottom=0)
bottom.legend(frameon=False)
bottom.grid(alpha=0.3)
figure.savefig(folder / "sky.png", dpi=110)
