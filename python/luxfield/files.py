"""Reads every kind of file into what it holds."""

import pathlib

import numpy as np

from . import _luxfield, errors
from ._luxfield import Environment, FileKind, LightField, Measurements
from .lightfields import luminance


class Picture:
    """An OpenEXR picture.

    layers       every channel as an array [row, column], by name ("R", "irradiance.Y", "samples.Y" ...)
    attributes   the file's attributes
    """

    def __init__(self, layers, attributes):
        self.layers, self.attributes = layers, attributes

    @classmethod
    def read(cls, path):
        """Reads an .exr or .hdr."""
        if pathlib.Path(path).suffix == ".hdr":
            return cls(dict(zip("RGB", _luxfield.read_hdr(path))), {})
        return cls(_luxfield.read_exr_layers(path), _luxfield.read_exr_attributes(path))

    def __getitem__(self, name):
        return self.layers[name]

    @property
    def pixels(self):
        """The picture itself, [channel, row, column]: R, G, B or Y."""
        names = "RGB" if "R" in self.layers else "Y"
        return np.stack([self.layers[name] for name in names])

    def tone_mapped(self, exposure=None):
        """Values of a display, [row, column, 3] in 0 .. 1.

        1 - exp(-k L) of the luminance, its colour kept where it fits into the display; k = exposure, or such that
        the brightest fiftieth of what is lit lies above 0.8; then sRGB's curve."""
        pixels = np.clip(np.nan_to_num(self.pixels.astype(float)), 0, None)
        lit = luminance(pixels)
        if exposure is None:
            above = lit[lit > 0]
            exposure = -np.log(0.2) / np.percentile(above, 98) if above.size else 1.0
        scale = np.where(lit > 0, -np.expm1(-exposure * lit) / np.where(lit > 0, lit, 1), exposure)
        shown = np.broadcast_to(np.clip(pixels * scale, 0, 1), (3, *lit.shape))
        shown = np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * np.maximum(shown, 1e-9) ** (1 / 2.4) - 0.055)
        return np.moveaxis(shown, 0, -1)

    def plot(self, axes=None, exposure=None):
        """Draws the picture, tone-mapped."""
        if axes is None:
            import matplotlib.pyplot as plt

            axes = plt.subplots()[1]
        axes.imshow(self.tone_mapped(exposure))
        axes.set_axis_off()
        return axes

    def __repr__(self):
        rows, columns = next(iter(self.layers.values())).shape
        return f"<luxfield.Picture: {columns} x {rows}, layers {', '.join(self.layers)}>"


def _plot_environment(self, axes=None, exposure=None):
    """Draws the map, tone-mapped."""
    names = "RGB" if self.pixels.shape[0] == 3 else "Y"
    return Picture(dict(zip(names, self.pixels)), {}).plot(axes, exposure)


Environment.plot = _plot_environment


def read(path):
    """Reads a file into a LightField, Measurements, Environment or Picture, by its content."""
    path = pathlib.Path(path)
    if not path.exists():
        raise errors.InputError(f"{path}: is not there")
    kind, name = _luxfield.what_is(path)
    if kind == FileKind.LIGHT_FIELD:
        return LightField.read(path)
    if kind == FileKind.MEASUREMENTS:
        return Measurements.read(path)
    if kind == FileKind.RADIANCE_HDR:
        return Environment.read(path)
    if kind == FileKind.PICTURE:
        attributes = _luxfield.read_exr_attributes(path)
        if "luxfield:layout" in attributes or "envmap" in attributes:
            return Environment.read(path)
        return Picture.read(path)
    raise errors.InputError(f"{path}: is {name}, which Python has no class for; "
                            "luxfield.info(path) tells what it holds")
