"""How to sample a measured lamp: the noise of three strategies at receivers near and far.

At a receiver x with normal n the irradiance is an integral over directions, estimated by the mean of
f(w) / p(w) over samples drawn with density p. Three densities are compared with the closed form:

- uniform over the rectangle of the filter plane that the basis covers;
- by the flux of the basis functions: one of them is chosen in proportion to its flux, then a point of its support;
- `luxfield.Sampler`: from the light field's own cells, the density that a renderer's plugin uses.
"""

# %%
import pathlib
import sys

import matplotlib.pyplot as plt
import numpy as np

import luxfield

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
lamp = luxfield.simulate(luxfield.data_file("labs/small.toml"), plan=luxfield.data_file("plans/small.toml"),
                         non_negative=True).value
sampler = luxfield.Sampler(lamp)
random = np.random.default_rng(1)
N = 4000

# %% [markdown]
# All three return weights whose mean is the irradiance. A ray from the receiver meets the filter plane z = 0 at u and
# comes from there; `sampler.radiance` is what it carries.

# %%
normal = np.array([0.0, 0.0, -1.0])
corner = np.array(lamp.corner_m)
size = -2 * corner  # the supports of the basis lie about the axis


def lit_from(x, u, p):
    """Weights of points u on the filter plane that are drawn with density p per square metre."""
    d = np.concatenate([u, np.zeros((N, 1))], axis=1) - x
    r = np.linalg.norm(d, axis=1)
    cos = -d[:, 2] / r  # at the receiver and at the filter plane alike: they are parallel
    return sampler.radiance(x, d / r[:, None])[:, 0] * cos**2 / r**2 / p


def uniform(x):
    return lit_from(x, corner + random.random((N, 2)) * size, 1 / size.prod())


W, H = lamp.grid
flux = lamp.C[:, 0].sum(axis=(1, 2))
share = (flux / flux.sum()).reshape(H, W)
support = 3 * lamp.spacing_m  # of a quadratic B-spline


def by_flux(x):
    image = random.choice(W * H, N, p=share.ravel())
    low = corner + lamp.spacing_m * np.stack([image % W, image // W], axis=1)
    u = low + random.random((N, 2)) * support
    at = (u[:, None] - corner) / lamp.spacing_m  # in spacings
    i, j = np.arange(W), np.arange(H)
    inside_u = (at[:, :, 0] >= i) & (at[:, :, 0] < i + 3)
    inside_v = (at[:, :, 1] >= j) & (at[:, :, 1] < j + 3)
    return lit_from(x, u, np.einsum("nj,ni,ji->n", inside_v, inside_u, share) / support**2)


def from_the_light_field(x):
    return sampler.sample(np.broadcast_to(x, (N, 3)), normal, random.random((N, 2)))["weight"][:, 0]


# %%
strategies = {"uniform on the filter plane": uniform, "by the flux of the basis functions": by_flux,
              "from the light field": from_the_light_field}
distances = np.geomspace(0.1, 10, 12)
figure, axes = plt.subplots(figsize=(6.6, 4.4), constrained_layout=True)
for name, strategy in strategies.items():
    noise = []
    for z in distances:
        x = np.array([0.02, 0.01, z])
        exact = lamp.irradiance(x, normal)[0]
        weights = strategy(x)
        mean, error = weights.mean(), weights.std() / np.sqrt(N)
        assert abs(mean - exact) < 5 * error + 1e-3 * exact, f"{name} is biased at {z:.2f} m"
        noise.append(weights.std() / exact)
    print(f"{name}: relative standard deviation of one sample {noise[0]:.3g} near, {noise[-1]:.3g} far")
    axes.loglog(distances, noise, "o-", markersize=3, label=name)
axes.set_xlabel("distance of the receiver / m")
axes.set_ylabel("relative standard deviation of one sample")
axes.legend(frameon=False)
axes.set_ylim(0.1, 10)
axes.grid(alpha=0.3)
figure.savefig(folder / "sampling_strategies.png", dpi=110)
