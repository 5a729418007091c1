"""Numbers with error bars: what the noise of a capture leaves of the illuminance on a wall, beside the truth.

A simulated lab knows its lamp, so that measured and true illuminance can be compared with the stated uncertainties.
The picture shows both: what scatters from frame to frame is the smallest part here. This lab's grid is coarse for its
lamp, which the error budget states in a row of its own.
"""

# %%
import pathlib
import sys
import tempfile

import matplotlib.pyplot as plt
import numpy as np

import luxfield

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
lab, plan = luxfield.data_file("labs/small.toml"), luxfield.data_file("plans/small.toml")

# %%
session = pathlib.Path(tempfile.mkdtemp()) / "small.session"
luxfield.capture(plan, session, lab=lab)
solved = luxfield.reconstruct(luxfield.merge(session, lamp_level="monitor"))
truth = luxfield.simulate(lab, plan=plan).value

# %% [markdown]
# `photometry` carries the standard deviation of every coefficient through to what is asked. Points are metres in the
# luminaire's frame: the filter plane is z = 0 and light travels towards +z. That is the noise alone; `budget`
# adds what a whole session has in common, as far as it is stated, and what the basis cannot hold.

# %%
x = np.linspace(-0.9, 0.9, 25)
wall = np.stack([x, np.zeros_like(x), np.full_like(x, 2.0)], axis=-1)
asked = {"point": [{"name": f"x{k}", "position_m": list(map(float, p))} for k, p in enumerate(wall)]}
points = luxfield.photometry(solved, ask=asked).points
E = np.array([p["illuminance_lx"] for p in points])
u = np.array([p["illuminance_lx_u"] for p in points])
E_true = truth.irradiance(wall, [0, 0, -1])[:, 0]
print(f"largest relative standard uncertainty: {np.max(u / E):.2%}")
print(f"rms difference from the truth: {np.sqrt(np.mean((E - E_true)**2)) / E_true.mean():.2%} of the mean")


# %%
def whole_uncertainty(place):
    """Standard uncertainty of the illuminance at a place by the error budget, lx."""
    return luxfield.budget(session, at=tuple(map(float, place))).quantities[1]["sigma"]


whole = {k: whole_uncertainty(wall[k]) for k in range(0, 25, 4)}
for k, sigma in whole.items():
    print(f"x = {x[k]:+.1f} m: {E[k]:6.1f} lx, noise {u[k]:4.1f} lx, whole budget {sigma:4.1f} lx, "
          f"difference from the truth {E[k] - E_true[k]:+5.1f} lx")

# %%
figure, (top, bottom) = plt.subplots(2, 1, figsize=(7, 6), sharex=True, constrained_layout=True,
                                     gridspec_kw={"height_ratios": [2, 1]})
top.plot(x, E_true, color="black", linewidth=1, label="truth")
top.errorbar(x, E, yerr=1.96 * u, fmt="o", markersize=3, capsize=2, color="C0", label="measured, 95 % of its noise")
top.set_ylabel("illuminance 2 m ahead / lx")
top.legend(frameon=False)
bottom.axhline(0, color="black", linewidth=1)
bottom.errorbar(x[list(whole)], (E - E_true)[list(whole)], yerr=1.96 * np.array(list(whole.values())), fmt="none",
                elinewidth=6, ecolor="0.85", label="95 % of the budget")
bottom.errorbar(x, E - E_true, yerr=1.96 * u, fmt="o", markersize=3, capsize=2, color="C0", label="95 % of its noise")
bottom.set_ylim(-200, 200)
bottom.legend(frameon=False, fontsize=8, ncols=2, loc="upper right")
bottom.set_xlabel("place on the wall / m")
bottom.set_ylabel("difference / lx")
figure.savefig(folder / "error_bars.png", dpi=110)
