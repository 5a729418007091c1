"""luxfield: measures real luminaires as light fields and lights virtual scenes with them.

    import numpy as np
    import luxfield

    lamp = luxfield.read("lamp.lf.exr")                    # a LightField
    lamp.flux                                              # of each channel, lm
    lamp.irradiance([[0, 0, 2.0]], [[0, 0, -1]])           # lx at 2 m on the axis, facing the lamp

    luxfield.capture("plan.toml", "session", lab="lab.toml")
    measured = luxfield.merge("session")
    solved = luxfield.reconstruct(measured)
    solved.value.C                                         # [image, channel, row, column]
    solved.sigma.C                                         # its standard deviation
    luxfield.render("scene.toml", light_field=solved.value, error="1%").plot()

Lengths are metres, angles degrees. Data are numpy arrays over the objects' own memory. The verbs of the program
`luxfield` are functions (luxfield.verbs); errors are InputError, DeviceError and Interrupted with the same sentences.
"""

from . import errors
from ._luxfield import Environment, LightField, Measurements, Sampler, __version__, set_threads
from .errors import DeviceError, Error, InputError, Interrupted, LuxfieldWarning
from .files import Picture, read
from .lightfields import luminance
from .process import data_file
from .verbs import *  # noqa: F403
from .verbs import __all__ as _verbs

__all__ = ["DeviceError", "Environment", "Error", "InputError", "Interrupted", "LightField", "LuxfieldWarning",
           "Measurements", "Picture", "Sampler", "__version__", "data_file", "errors", "luminance", "read", "set_threads",
           *_verbs]
