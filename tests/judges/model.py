"""The light field of docs/theory.md section 2 and what a rig measures of it (section 3), in double
precision.

    L(u -> s) = delta^2 / cos^4(theta) * sum_ij C_ij(s) Phi_ij(u)

Everything is evaluated from the definitions: bases by the recursion of B-splines, integrals by
Gauss-Legendre rules between the points where an integrand is not smooth. Shapes: C and E are
(H, W, rows, columns, channels), row 0 at the largest t, as in the files.
"""

from dataclasses import dataclass, field

import numpy as np

import exr

SUPPORT_CELLS = {"box": 1, "bilinear": 2, "quadratic": 2, "bspline2": 3}


def bspline(order, x):
    """The B-spline of an order on knots 0, 1, ..., order (Cox and de Boor)."""
    if order == 1:
        return np.where((x >= 0) & (x < 1), 1.0, 0.0)
    return (x * bspline(order - 1, x) + (order - x) * bspline(order - 1, x - 1)) / (order - 1)


def basis_value(name, a, x):
    """The 1-D basis function on its support [0, n], x in spacings."""
    if name == "quadratic":
        d = np.abs(x - 1)
        return np.where(d < 1, (1 - d) * (1 - a * d), 0.0)
    return bspline(SUPPORT_CELLS[name], x)


def gauss(breaks, nodes):
    """Nodes and weights of a Gauss-Legendre rule on each interval between sorted breaks."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    low, high = np.asarray(breaks[:-1])[:, None], np.asarray(breaks[1:])[:, None]
    return ((low + high) / 2 + (high - low) / 2 * x).ravel(), ((high - low) / 2 * w).ravel()


@dataclass
class Geometry:
    """Planes, grid of basis functions and lattice of texels: the attributes of the files."""

    delta: float
    basis: str
    width: int
    height: int
    u0: float
    v0: float
    h: float
    s0: float
    t1: float
    ds: float
    dt: float
    columns: int
    rows: int
    a: float = 0.5
    unit: str = "lm"

    def __post_init__(self):
        self.n = SUPPORT_CELLS[self.basis]

    def phi_u(self, u):
        """(W, points): every 1-D function along u."""
        return np.array(
            [basis_value(self.basis, self.a, (u - self.u0) / self.h - i) for i in range(self.width)]
        )

    def phi_v(self, v):
        return np.array(
            [
                basis_value(self.basis, self.a, (v - self.v0) / self.h - j)
                for j in range(self.height)
            ]
        )

    def knots_u(self):
        return self.u0 + self.h * np.arange(self.width + self.n)

    def knots_v(self):
        return self.v0 + self.h * np.arange(self.height + self.n)

    def column(self, s):
        """Column of s, or -1 beside the lattice."""
        c = np.floor((s - self.s0) / self.ds).astype(int)
        return np.where((c >= 0) & (c < self.columns), c, -1)

    def row(self, t):
        r = np.floor((self.t1 - t) / self.dt).astype(int)
        return np.where((r >= 0) & (r < self.rows), r, -1)

    def texel_centres(self):
        return (
            self.s0 + (np.arange(self.columns) + 0.5) * self.ds,
            self.t1 - (np.arange(self.rows) + 0.5) * self.dt,
        )

    def gram(self, axis):
        """<Phi_i, Phi_m> along "u" or "v"."""
        knots = self.knots_u() if axis == "u" else self.knots_v()
        x, w = gauss(knots, 4)
        phi = self.phi_u(x) if axis == "u" else self.phi_v(x)
        return (phi * w) @ phi.T

    def attributes(self, kind):
        named = {
            "luxfield:kind": kind,
            "luxfield:version": 1,
            "luxfield:unit": self.unit,
            "luxfield:delta_m": self.delta,
            "luxfield:basis": self.basis,
            "luxfield:basis_width": self.width,
            "luxfield:basis_height": self.height,
            "luxfield:u0_m": self.u0,
            "luxfield:v0_m": self.v0,
            "luxfield:spacing_m": self.h,
            "luxfield:s0_m": self.s0,
            "luxfield:t1_m": self.t1,
            "luxfield:ds_m": self.ds,
            "luxfield:dt_m": self.dt,
        }
        if self.basis == "quadratic":
            named["luxfield:basis_a"] = self.a
        return named


@dataclass
class LightField:
    geometry: Geometry
    c: np.ndarray = field(repr=False)  # (H, W, rows, columns, channels)

    def density(self, u, v, s, t):
        """E(u -> s) = sum C_ij(s) Phi_ij(u), W m^-4: (points, channels)."""
        g = self.geometry
        column, row = g.column(s), g.row(t)
        inside = (column >= 0) & (row >= 0)
        texels = self.c[:, :, row, column]  # (H, W, points, channels)
        value = np.einsum("jp,ip,jipc->pc", g.phi_v(v), g.phi_u(u), texels)
        return np.where(inside[:, None], value, 0.0)

    def radiance(self, u, v, s, t):
        g = self.geometry
        cos2 = g.delta**2 / (g.delta**2 + (u - s) ** 2 + (v - t) ** 2)
        return g.delta**2 / cos2[:, None] ** 2 * self.density(u, v, s, t)

    def flux(self):
        """The integral of E over both planes, per channel."""
        g = self.geometry
        xu, wu = gauss(g.knots_u(), 4)
        xv, wv = gauss(g.knots_v(), 4)
        return np.einsum("j,i,jirck->k", g.phi_v(xv) @ wv, g.phi_u(xu) @ wu, self.c) * g.ds * g.dt

    def irradiance(self, p, normal, nodes=4):
        """Irradiance at p (luminaire frame, z > 0) with a unit normal: the integral over F of

            L(u -> s) cos(theta) max(0, n.w) / r^2,      w the direction from p to u, r their distance

        between knots, borders of texels as seen from p, and the horizon n.w = 0, where the rule is
        broken.
        """
        g = self.geometry
        z = p[2]
        if z <= 0:
            return np.zeros(self.c.shape[-1])
        # The ray from u to p crosses I at s = u + (p - u) delta / z, so a border s of a texel is
        # seen at this u:
        back = lambda border, at: (
            (border - at * g.delta / z) / (1 - g.delta / z) if z != g.delta else np.empty(0)
        )
        borders_u = back(g.s0 + g.ds * np.arange(g.columns + 1), p[0])
        borders_v = back(g.t1 - g.dt * np.arange(g.rows + 1), p[1])
        u_breaks, v_breaks = self._breaks(g.knots_u(), borders_u), self._breaks(
            g.knots_v(), borders_v
        )
        # Horizon: n.(u - p) = nx (u - px) + ny (v - py) - nz z > 0.
        nx, ny, nz = normal
        offset = -nx * p[0] - ny * p[1] - nz * z
        if (
            abs(ny) > 1e-12 and abs(nx) > 1e-12
        ):  # where the horizon crosses a break of v, the outer integrand has a kink
            crossings = -(offset + ny * v_breaks) / nx
            u_breaks = self._breaks(u_breaks, crossings)
        elif abs(nx) > 1e-12:
            u_breaks = self._breaks(u_breaks, np.array([-offset / nx]))
        total = np.zeros(self.c.shape[-1])
        for u, weight in zip(*gauss(u_breaks, nodes)):
            inner = v_breaks
            if abs(ny) > 1e-12:
                inner = self._breaks(v_breaks, np.array([-(offset + nx * u) / ny]))
            v, w = gauss(inner, nodes)
            d = np.stack([u - p[0] + 0 * v, v - p[1], np.full_like(v, -z)])
            r = np.sqrt((d**2).sum(0))
            cosine = np.maximum(0.0, (d * np.asarray(normal)[:, None]).sum(0) / r)
            s, t = u + (p[0] - u) * g.delta / z, v + (p[1] - v) * g.delta / z
            total += (
                weight * (w * (z / r) * cosine / r**2) @ self.radiance(np.full_like(v, u), v, s, t)
            )
        return total

    @staticmethod
    def _breaks(within, more):
        """Sorted breaks, with those of `more` that lie strictly between the first and the last of
        `within`."""
        more = more[(more > within[0]) & (more < within[-1])]
        return np.unique(np.concatenate([within, more]))

    def write(self, path):
        g, channels = self.geometry, "Y" if self.c.shape[-1] == 1 else "RGB"
        parts = []
        for j in range(g.height):
            for i in range(g.width):
                planes = {
                    name: self.c[j, i, :, :, k].astype(np.float32)
                    for k, name in enumerate(channels)
                }
                parts.append(
                    exr.Part(
                        f"C.{j:02d}.{i:02d}",
                        planes,
                        g.attributes("light-field") if not parts else {},
                    )
                )
        exr.write(path, parts)


def geometry_of(attributes, columns, rows):
    a = {k.removeprefix("luxfield:"): v for k, v in attributes.items()}
    return Geometry(
        a["delta_m"],
        a["basis"],
        a["basis_width"],
        a["basis_height"],
        a["u0_m"],
        a["v0_m"],
        a["spacing_m"],
        a["s0_m"],
        a["t1_m"],
        a["ds_m"],
        a["dt_m"],
        columns,
        rows,
        a.get("basis_a", 0.5),
        a["unit"],
    )


def _stack(parts, prefix, channels):
    """(H, W, rows, columns, channels) from parts PREFIX.JJ.II."""
    by_name = {p.name: p for p in parts}
    g = geometry_of(
        by_name[f"{prefix}.00.00"].attributes, *next(iter(parts[0].channels.values())).shape[::-1]
    )
    images = [
        [
            np.stack([by_name[f"{prefix}.{j:02d}.{i:02d}"].channels[name] for name in channels], -1)
            for i in range(g.width)
        ]
        for j in range(g.height)
    ]
    return g, np.array(images, float)


def read_light_field(path):
    parts = exr.read(path)
    names = parts[0].channels
    g, c = _stack(parts, "C", ["Y"] if "Y" in names else ["R", "G", "B"])
    return LightField(g, c)


def read_fields(path):
    """[(LightField, luminaire_from_field)] of a file of several fields, or of one in its own frame."""
    parts = exr.read(path)
    if "luxfield:fields" not in parts[0].attributes and parts[0].name.startswith("C."):
        return [(read_light_field(path), np.eye(4)[:3])]
    fields = []
    for k in range(parts[0].attributes["luxfield:fields"]):
        own = [p for p in parts if p.name.startswith(f"{k}.")]
        names = ["Y"] if "Y" in own[0].channels else ["R", "G", "B"]
        for part in own:
            part.name = part.name.split(".", 1)[1]
        g, c = _stack(own, "C", names)
        first = next(p for p in own if p.name == "C.00.00").attributes
        pose = np.array(
            [[first[f"luxfield:luminaire_from_field.{r}{q}"] for q in range(4)] for r in range(3)]
        )
        fields.append((LightField(g, c), pose))
    return fields


def read_measurements(path):
    """Geometry, E and sigma."""
    parts = exr.read(path)
    colours = ["Y"] if "E.Y" in parts[0].channels else ["R", "G", "B"]
    g, e = _stack(parts, "E", [f"E.{c}" for c in colours])
    _, faint = _stack(parts, "E", [f"undetected.{c}" for c in colours])
    _, sigma = _stack(parts, "E", [f"sigma.{c}" for c in colours])
    return g, np.where(np.isnan(e), faint, e), sigma


def write_measurements(path, g, e, sigma, scale=1.0):
    """E (H, W, rows, columns, channels) as a .meas.exr behind prints of the basis itself."""
    channels = "Y" if e.shape[-1] == 1 else "RGB"
    parts = []
    for j in range(g.height):
        for i in range(g.width):
            planes = {
                "count": np.ones((g.rows, g.columns), np.float32),
                "mask": np.zeros((g.rows, g.columns), np.uint32),
            }
            for k, name in enumerate(channels):
                planes[f"E.{name}"] = e[j, i, :, :, k].astype(np.float32)
                planes[f"sigma.{name}"] = sigma[j, i, :, :, k].astype(np.float32)
                planes[f"undetected.{name}"] = np.zeros((g.rows, g.columns), np.float32)
            attributes = g.attributes("measurements") | {
                "luxfield:filter": "basis",
                "luxfield:filter_scale": scale,
            }
            parts.append(exr.Part(f"E.{j:02d}.{i:02d}", planes, attributes if not parts else {}))
    exr.write(path, parts)


def measure(g, density, nodes=6, extra_u=(), extra_v=()):
    """E_ij(s) of docs/theory.md 3 at the texels' centres: the integral of L cos^4 / delta^2 Phi_ij
    du, where

        density(u, v, s, t) = L(u -> s) cos^4(theta) / delta^2

    is a lamp's own, jumping at extra_u and extra_v at most. Shape (H, W, rows, columns, 1)."""
    u, wu = gauss(LightField._breaks(g.knots_u(), np.asarray(extra_u, float)), nodes)
    v, wv = gauss(LightField._breaks(g.knots_v(), np.asarray(extra_v, float)), nodes)
    phi_u, phi_v = g.phi_u(u) * wu, g.phi_v(v) * wv
    s, t = g.texel_centres()
    e = np.empty((g.height, g.width, g.rows, g.columns, 1))
    for row in range(g.rows):
        for column in range(g.columns):
            values = density(u[None, :], v[:, None], s[column], t[row])
            e[:, :, row, column, 0] = phi_v @ values @ phi_u.T
    return e
