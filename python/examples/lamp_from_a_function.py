"""A light field of one's own: a disc that shines evenly, and its illuminance beside the closed form.

A Lambertian disc of radius R and radiance L gives at the distance z on its axis, facing it,

    E(z) = pi L R^2 / (R^2 + z^2).

The picture shows how the error of the light field falls as its spacing gets finer, for points from 5 cm on.
"""

# %%
import pathlib
import sys

import matplotlib.pyplot as plt
import numpy as np

import luxfield

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
R, L = 0.03, 1000.0  # m, cd / m^2


def disc(u, s):
    """Radiance of the ray through u on the filter plane, the same towards every s on the image plane."""
    return np.where((u**2).sum(-1) < R**2, L, 0.0) + 0 * s[..., 0]


# %% [markdown]
# The basis is a grid of W x W tensor B-splines on the filter plane; each coefficient image has 41 x 41 texels on the
# image plane, `delta_m` ahead.

# %%
z = np.geomspace(0.05, 2, 40)
axis = np.stack([0 * z, 0 * z, z], axis=-1)
closed_form = np.pi * L * R**2 / (R**2 + z**2)
figure, axes = plt.subplots(figsize=(6.4, 4.4), constrained_layout=True)
for W in (3, 5, 9):
    lamp = luxfield.LightField.from_function(disc, grid=(W, W), spacing_m=0.08 / W, delta_m=0.2, texels=(41, 41),
                                             texel_m=0.02, unit="lm", samples=1)
    error = lamp.irradiance(axis, [0, 0, -1])[:, 0] / closed_form - 1
    print(f"{W} x {W}: {1e3 * lamp.spacing_m:.1f} mm apart, flux {lamp.flux[0]:.3f} lm, "
          f"error at 5 cm {error[0]:+.2%}, at 2 m {error[-1]:+.2%}")
    axes.semilogx(z, 100 * error, label=f"{W} × {W} basis functions")
axes.axhline(0, color="black", linewidth=0.8)
axes.set_xlabel("distance on the axis / m")
axes.set_ylabel("error of the illuminance / %")
axes.legend(frameon=False)
axes.grid(alpha=0.3)
figure.savefig(folder / "lamp_from_a_function.png", dpi=110)
