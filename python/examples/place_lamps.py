"""Place and dim lamps so that a table is evenly lit: least squares over closed forms, with scipy.

The illuminance of a lamp is smooth in its place and free of noise, so that differences of it are good derivatives.
Three small panels hang 1.2 m above a table of 2.4 m x 0.8 m; their places along it and their levels are sought for 500 lx.
The picture shows the table before and after.
"""

# %%
import pathlib
import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares

import luxfield

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
lamp = luxfield.LightField.from_function(
    lambda u, s: 3000.0 * ((np.abs(u) < 0.06).all(-1)) + 0 * s[..., 0],  # a panel of 12 cm, 3000 cd/m^2
    grid=(6, 6), spacing_m=0.025, delta_m=0.3, texels=(36, 36), texel_m=0.05, unit="lm", samples=1)
above, target = 1.2, 500.0
x, y = np.meshgrid(np.linspace(-1.2, 1.2, 49), np.linspace(-0.4, 0.4, 17))

# %% [markdown]
# The lamps look down: luminaire z is downwards, u along the table. A point of the table in the frame of a lamp at
# (a, b) is (x - a, -(y - b), height).


# %%
def lit(parameters):
    """Illuminance of the table for (a, b, level) of each lamp."""
    E = 0
    for a, b, level in parameters.reshape(-1, 3):
        points = np.stack([x - a, -(y - b), np.full_like(x, above)], axis=-1)
        E = E + level * lamp.irradiance(points, [0, 0, -1])[..., 0]
    return E


def residuals(parameters):
    return (lit(parameters) / target - 1).ravel()


start = np.array([[-0.8, 0, 1], [0, 0, 1], [0.8, 0, 1]], dtype=float)
start[:, 2] *= target / lit(start.ravel()).mean()
found = least_squares(residuals, start.ravel(), bounds=(np.tile([-1.2, -0.4, 0], 3), np.tile([1.2, 0.4, np.inf], 3)),
                      x_scale=np.tile([0.1, 0.1, start[0, 2]], 3), diff_step=1e-4)
before, after = lit(start.ravel()), lit(found.x)
for name, E in (("before", before), ("after", after)):
    print(f"{name}: mean {E.mean():.0f} lx, least over mean {E.min() / E.mean():.2f}, "
          f"rms from 500 lx {np.sqrt(np.mean((E / target - 1)**2)):.1%}")
for a, b, level in found.x.reshape(-1, 3):
    print(f"lamp at {a:+.2f} m, {b:+.2f} m, level {level:.3f}")

# %%
figure, both = plt.subplots(2, 1, figsize=(7, 5.6), constrained_layout=True)
top = max(before.max(), after.max())
for axes, E, parameters, name in ((both[0], before, start, "before"), (both[1], after, found.x, "after")):
    drawn = axes.pcolormesh(x, y, E, cmap="cividis", vmin=0, vmax=top, shading="gouraud")
    axes.clabel(axes.contour(x, y, E, levels=[300, 400, 500, 600], colors="white", linewidths=0.8), fmt="%g")
    a, b, _ = parameters.reshape(-1, 3).T
    axes.plot(a, b, "o", color="C3", clip_on=False)
    axes.set_aspect("equal")
    axes.set_title(f"{name}: least over mean {E.min() / E.mean():.2f}")
    axes.set_ylabel("m")
both[1].set_xlabel("m")
figure.colorbar(drawn, ax=both, label="illuminance / lx")
figure.savefig(folder / "place_lamps.png", dpi=110)
