"""Light a scene that is built in code, to an error that is asked for.

`error="3%"` measures the device, chooses the estimator and its samples, and states the error that is left.
"""

# %%
import pathlib
import sys

import matplotlib.pyplot as plt
import numpy as np

import luxfield

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
lamp = luxfield.simulate(luxfield.data_file("labs/small.toml"), plan=luxfield.data_file("plans/small.toml"),
                         non_negative=True)

# %% [markdown]
# A scene is a dict with the tables of scene.toml; a luminaire's `file` may be a light field. Metres, z up.

# %%
scene = {
    "camera": {"position": [0.6, -2.2, 1.3], "look_at": [0, 1.2, 0.35], "vertical_fov_deg": 45,
               "width": 400, "height": 300},
    "material": [{"name": "floor", "albedo": [0.5, 0.5, 0.5], "kind": "ggx", "roughness": 0.3},
                 {"name": "wall", "albedo": [0.7, 0.66, 0.6]},
                 {"name": "post", "albedo": [0.6, 0.25, 0.1]}],
    "quad": [{"corner": [-3, -3, 0], "edge_u": [6, 0, 0], "edge_v": [0, 6, 0], "material": "floor"},
             {"corner": [-3, 2.5, 0], "edge_u": [6, 0, 0], "edge_v": [0, 0, 3], "material": "wall"},
             {"corner": [-0.35, 1.2, 0], "edge_u": [0.25, 0.1, 0], "edge_v": [0, 0, 0.7], "material": "post"}],
    "luminaire": [{"name": "headlight", "file": lamp, "position": [0, -1, 0.6], "look_at": [0, 2, 0.4]}],
}
lit = luxfield.render(scene, error="3%", seed=1)
print(lit)

# %% [markdown]
# Each layer of the picture is an array. Here: what the eye sees, and the same in false colour.

# %%
picture = lit.value
print(picture)
L = luxfield.luminance(picture.pixels)
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.9), constrained_layout=True)
picture.plot(left)
left.set_title("tone-mapped")
shown = right.imshow(np.maximum(L, 1e-2), cmap="cividis", norm="log")
figure.colorbar(shown, ax=right, label="luminance / cd m⁻²", shrink=0.85)
right.set_axis_off()
right.set_title(f"luminance, mean {L.mean():.1f} cd/m²")
figure.savefig(folder / "light_a_scene.png", dpi=110)
