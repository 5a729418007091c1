"""A luxfield lamp as an emitter of Mitsuba 3, of what `luxfield export --to mitsuba -o lamp.xml` writes.

    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")          # or another llvm or cuda variant
    import luxfield_mitsuba                 # registers the emitter "luxfield"
    scene = mi.load_dict({"type": "scene", **luxfield_mitsuba.lamp("lamp.json"), ...})

or, in a scene in XML, <include filename="lamp.xml"/>. The lamp shines towards +z of its frame, which is that of the
rectangle that holds the emitter: (0, 0, 0) is the middle of the light field's frame (docs/axes.md), and the scene's unit
is the metre.

Emitted radiance is that of docs/theory.md 2,

    L = delta^2 / cos^4 sum C_ij(s) Phi_ij(u)

in the file's unit (cd/m^2 of a light field in lm), below zero where the measurement is. Directions are sampled by a
point on the lamp's face: a knot cell with a probability in proportion to its flux, and a place in it, uniformly.
"""

import json
import pathlib

import drjit as dr
import mitsuba as mi
import numpy as np


class Field:
    """A light field of a lamp's JSON and its atlas (docs/bridges.md), as arrays of the variant in use."""

    def __init__(self, folder, facts):
        self.delta = facts["delta_m"]
        grid, images = facts["grid"], facts["images"]
        self.width, self.height, self.spacing = grid["width"], grid["height"], grid["spacing_m"]
        self.u0, self.v0 = grid["u0_m"], grid["v0_m"]
        self.cells = facts["basis"]["cells"]
        self.columns, self.rows = images["columns"], images["rows"]
        self.s0, self.t1, self.ds, self.dt = (images[key] for key in ("s0_m", "t1_m", "ds_m", "dt_m"))
        pixels = np.array(mi.Bitmap(str(folder / facts["atlas"])), dtype=np.float32)[:, :, :3]
        if pixels.shape[:2] != (self.rows * self.height, self.columns * self.width):
            raise RuntimeError(f"{facts['atlas']}: has {pixels.shape[1]} x {pixels.shape[0]} pixels, and not those that "
                               "its JSON names; export the lamp again")
        self.pixels = [mi.Float(np.ascontiguousarray(pixels[:, :, k]).ravel()) for k in range(3)]
        self.cells_u, self.cells_v = self.width + len(self.cells) - 1, self.height + len(self.cells) - 1
        self.chosen = mi.DiscreteDistribution(self.flux_of_cells(pixels))

    def flux_of_cells(self, pixels):
        """Of each knot cell, v slowest: positive light's, and none in cells without any."""
        images = np.maximum(pixels.mean(axis=2), 0).reshape(self.rows, self.height, self.columns, self.width)
        image_sums = images.sum(axis=(0, 2), dtype=np.float64)
        whole = [sum(c / (power + 1) for power, c in enumerate(cell)) for cell in self.cells]
        flux = np.zeros((self.cells_v, self.cells_u))
        for b, along_v in enumerate(whole):
            for a, along_u in enumerate(whole):
                flux[b:b + self.height, a:a + self.width] += along_v * along_u * image_sums
        return mi.Float(flux.ravel().astype(np.float32))

    def cell_of(self, u, v):
        """Knot cell along u and v, and the ways through it."""
        x, y = (u - self.u0) / self.spacing, (v - self.v0) / self.spacing
        ku = dr.clip(mi.Int32(dr.floor(x)), 0, self.cells_u - 1)
        kv = dr.clip(mi.Int32(dr.floor(y)), 0, self.cells_v - 1)
        return ku, kv, x - ku, y - kv

    def basis_values(self, way):
        return [c[0] + way * (c[1] + way * c[2]) for c in self.cells]

    def radiance(self, u, v, direction, active):
        """Along `direction`, a unit vector of the lamp's frame, from (u, v, 0)."""
        active = active & (direction.z > 1e-6)
        slope = self.delta / dr.select(active, direction.z, 1)
        column = mi.Int32(dr.floor((u + slope * direction.x - self.s0) / self.ds))
        row = mi.Int32(dr.floor((self.t1 - v - slope * direction.y) / self.dt))
        active &= (column >= 0) & (column < self.columns) & (row >= 0) & (row < self.rows)
        ku, kv, fu, fv = self.cell_of(u, v)
        value = mi.Color3f(0)
        for b, along_v in enumerate(self.basis_values(fv)):
            for a, along_u in enumerate(self.basis_values(fu)):
                i, j = ku - a, kv - b
                there = active & (i >= 0) & (i < self.width) & (j >= 0) & (j < self.height)
                at = (row * self.height + j) * (self.columns * self.width) + column * self.width + i
                c = mi.Color3f(*(dr.gather(mi.Float, channel, mi.UInt32(dr.select(there, at, 0)), there)
                                 for channel in self.pixels))
                value += dr.select(there, along_u * along_v, 0) * c
        return dr.select(active, value * (self.delta**2 / dr.square(dr.square(direction.z))), 0)


class Luxfield(mi.Emitter):
    """Of a rectangle on a field's filter plane; parameters: filename (the JSON), field (0)."""

    def __init__(self, props):
        mi.Emitter.__init__(self, props)
        if not (mi.variant().startswith("llvm") or mi.variant().startswith("cuda")) or not mi.variant().endswith("rgb"):
            raise RuntimeError(f"the emitter 'luxfield' needs llvm_ad_rgb or cuda_ad_rgb, and not {mi.variant()}")
        path = pathlib.Path(props["filename"])
        if not path.is_file():
            path = pathlib.Path(str(mi.file_resolver().resolve(str(path))))
        self.field = Field(path.parent, json.loads(path.read_text())["fields"][props.get("field", 0)])
        self.m_flags = mi.EmitterFlags.Surface | mi.EmitterFlags.SpatiallyVarying
        self.frame = None

    def axes(self):
        """Middle of the rectangle, its axes (unit vectors), and the place of its middle on F."""
        if self.frame is None:
            f = self.field
            middle = self.get_shape().eval_parameterization(mi.Point2f(0.5, 0.5))
            half = 0.5 * f.spacing
            self.frame = (mi.Point3f(middle.p), mi.Vector3f(dr.normalize(middle.dp_du)),
                          mi.Vector3f(dr.normalize(middle.dp_dv)), mi.Vector3f(middle.n),
                          f.u0 + half * f.cells_u, f.v0 + half * f.cells_v)
        return self.frame

    def radiance(self, p, direction, active):
        """Towards `direction`, of the scene, from a point p of the rectangle."""
        middle, along_u, along_v, normal, u, v = self.axes()
        way = p - middle
        local = mi.Vector3f(dr.dot(direction, along_u), dr.dot(direction, along_v), dr.dot(direction, normal))
        return self.field.radiance(u + dr.dot(way, along_u), v + dr.dot(way, along_v), local, active)

    def sample_place(self, sample, active):
        """A place on the rectangle and its density per area."""
        middle, along_u, along_v, _, u, v = self.axes()
        f = self.field
        cell, rest, share = f.chosen.sample_reuse_pmf(sample.x, active)
        ku, kv = mi.Float(cell % f.cells_u), mi.Float(cell // f.cells_u)
        p = (middle + along_u * (f.u0 + (ku + rest) * f.spacing - u) + along_v * (f.v0 + (kv + sample.y) * f.spacing - v))
        return p, share / f.spacing**2

    def density_at(self, p, active):
        middle, along_u, along_v, _, u, v = self.axes()
        f = self.field
        ku, kv, _, _ = f.cell_of(u + dr.dot(p - middle, along_u), v + dr.dot(p - middle, along_v))
        return f.chosen.eval_pmf_normalized(mi.UInt32(kv * f.cells_u + ku), active) / f.spacing**2

    def eval(self, si, active=True):
        return self.radiance(si.p, si.to_world(si.wi), active)

    def sample_direction(self, it, sample, active=True):
        p, density = self.sample_place(sample, active)
        normal = self.axes()[3]
        ds = dr.zeros(mi.DirectionSample3f)
        ds.p, ds.n, ds.time = p, normal, it.time
        to_lamp = p - it.p
        squared = dr.squared_norm(to_lamp)
        ds.dist = dr.sqrt(squared)
        ds.d = to_lamp / ds.dist
        cosine = -dr.dot(ds.d, normal)
        good = active & (cosine > 0) & (density > 0)
        ds.pdf = dr.select(good, density * squared / dr.select(good, cosine, 1), 0)
        ds.delta = False
        ds.emitter = mi.EmitterPtr(self)
        weight = dr.select(good, self.radiance(p, -ds.d, good) / dr.select(good, ds.pdf, 1), 0)
        return ds, weight

    def pdf_direction(self, it, ds, active=True):
        cosine = -dr.dot(ds.d, ds.n)
        good = active & (cosine > 0)
        return dr.select(good, self.density_at(ds.p, good) * dr.square(ds.dist) / dr.select(good, cosine, 1), 0)

    def eval_direction(self, it, ds, active=True):
        return self.radiance(ds.p, -ds.d, active & (dr.dot(ds.d, ds.n) < 0))

    def sample_ray(self, time, sample1, sample2, sample3, active=True):
        """From the lamp, as particle tracers ask: a place, and a direction by the cosine."""
        p, density = self.sample_place(sample2, active)
        _, along_u, along_v, normal, _, _ = self.axes()
        local = mi.warp.square_to_cosine_hemisphere(sample3)
        direction = along_u * local.x + along_v * local.y + normal * local.z
        ray = mi.Ray3f(p, direction, time, mi.sample_wavelength(sample1)[0]) if mi.is_spectral else mi.Ray3f(p, direction)
        weight = self.radiance(p, direction, active & (density > 0)) * dr.pi / dr.select(density > 0, density, 1)
        return ray, weight

    def bbox(self):
        return self.get_shape().bbox()

    def to_string(self):
        return f"Luxfield[{self.field.width} x {self.field.height} images of {self.field.columns} x {self.field.rows}]"


mi.register_emitter("luxfield", lambda props: Luxfield(props))


def lamp(filename, to_world=None):
    """The shapes of a lamp's JSON file, by name, for the dictionary of a scene; `to_world` is a rigid transform."""
    shapes = {}
    for number, field in enumerate(json.loads(pathlib.Path(filename).read_text())["fields"]):
        grid, n = field["grid"], len(field["basis"]["cells"])
        half_u, half_v = (0.5 * (grid[key] + n - 1) * grid["spacing_m"] for key in ("width", "height"))
        place = mi.ScalarTransform4f(np.array([*field["luminaire_from_field"], 0, 0, 0, 1], float).reshape(4, 4))
        place = place.translate([grid["u0_m"] + half_u, grid["v0_m"] + half_v, 0]).scale([half_u, half_v, 1])
        shapes[f"{pathlib.Path(filename).stem}_{number}"] = {
            "type": "rectangle", "to_world": place if to_world is None else to_world @ place,
            "emitter": {"type": "luxfield", "filename": str(filename), "field": number}}
    return shapes
