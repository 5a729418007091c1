"""From which distance on is a far-field file of a lamp good enough?

An IES or EULUMDAT file treats the lamp as a point. The picture shows the error that this makes of the illuminance on
planes before a lamp, against their distance; the same lamp is written as EULUMDAT for programs that want one.
"""

# %%
import pathlib
import sys

import matplotlib.pyplot as plt
import numpy as np

import luxfield

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
lamp = luxfield.simulate(luxfield.data_file("labs/small.toml"), plan=luxfield.data_file("plans/small.toml")).value

# %% [markdown]
# The far field at the point x sees the intensity of its direction w over the distance squared,
#
#     E = I(w) cos(theta) / |x|^2.

# %%
distances = np.geomspace(0.1, 20, 24)
x, y = np.meshgrid(np.linspace(-0.35, 0.35, 15), np.linspace(-0.35, 0.35, 15))
directions = np.stack([x, y, np.ones_like(x)], axis=-1)
directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
intensity = lamp.intensity(directions)[..., 0]
rms, axis = [], []
for z in distances:
    points = directions * (z / directions[..., 2:])
    near = lamp.irradiance(points, [0, 0, -1])[..., 0]
    far = intensity * directions[..., 2]**3 / z**2
    rms.append(np.sqrt(np.mean((far - near)**2)) / np.sqrt(np.mean(near**2)))
    axis.append(far[7, 7] / near[7, 7] - 1)
for e in (0.05, 0.01):
    above = np.nonzero(np.array(rms) > e)[0]
    begins = distances[above[-1] + 1] if above.size and above[-1] + 1 < len(distances) else None
    print(f"good for {e:.0%} of a plane's rms illuminance from {begins:.2g} m on" if begins else
          f"not good for {e:.0%} within {distances[-1]:g} m")
luxfield.export(lamp, folder / "near_and_far.ldt")

# %%
figure, axes = plt.subplots(figsize=(6.6, 4.4), constrained_layout=True)
axes.loglog(distances, 100 * np.array(rms), label="rms over a plane of ±19°")
axes.loglog(distances, 100 * np.abs(axis), "--", label="on the axis")
axes.axhline(5, color="black", linewidth=0.8)
axes.text(distances[0], 5.3, "5 %", fontsize=9)
axes.set_xlabel("distance of the plane / m")
axes.set_ylabel("error of the far field / %")
axes.legend(frameon=False)
axes.grid(alpha=0.3, which="both")
figure.savefig(folder / "near_and_far.png", dpi=110)
