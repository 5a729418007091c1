"""What one does first with the installed module: a lamp, its lux, a picture. Run outside of the source.

    python3 use_module.py
"""
import numpy as np

import luxfield

lab, plan = luxfield.data_file("labs/small.toml"), luxfield.data_file("plans/small.toml")
lamp = luxfield.simulate(lab, plan=plan).value
lux = lamp.irradiance([[0, 0, 2.0]], [[0, 0, -1.0]])
assert np.isfinite(lux).all() and (lux > 0).all(), lux
picture = luxfield.render(luxfield.data_file("scenes/demo.toml"), light_field=lamp, spp=4, png="picture.png")
luminance = picture.value.pixels
assert np.isfinite(luminance).all() and luminance.max() > 0
with open("picture.png", "rb") as file:
    assert file.read(8) == b"\x89PNG\r\n\x1a\n"
print(f"{luxfield.__file__}: {lux[0, 0]:.4g} lx at 2 m, picture.png")
