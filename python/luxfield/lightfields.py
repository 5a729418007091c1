"""Light fields from functions, and how they are drawn."""

import numpy as np

from ._luxfield import LUMINANCE_WEIGHTS, LightField, basis_cells, basis_values, gram_matrix


def from_function(radiance, *, grid, spacing_m, delta_m, texels, texel_m, basis="bspline2", unit="relative",
                  nodes=8, samples=2):
    """The light field nearest to a function of rays: its projection onto the basis.

    radiance   called with u [..., 2] on F and s [..., 2] on I, metres, broadcast against each other; returns
               [...] or [..., channel] with 1 or 3 channels
    grid       (W, H), basis functions along u and v
    texels     (columns, rows) on I
    nodes      Gauss-Legendre nodes in each knot cell and axis
    samples    points in each texel and axis, whose mean the texel is

    At each point s of I the coefficients C are those that are nearest to E(u) = L cos^4(theta) / delta^2 over F:
    sum_m <Phi_i, Phi_m> C_m = integral of E Phi_i du, under the condition that flux and first moments over F are
    kept along each axis, as `reconstruct` keeps them. Light beside the grid is lost.
    """
    W, H = grid
    columns, rows = texels
    n = basis_cells(basis)
    places, weights = np.polynomial.legendre.leggauss(nodes)
    places, weights = (places + 1) / 2, weights / 2

    def axis(count):
        """Positions of the nodes, and what takes values there to coefficients, [count, nodes]."""
        at = np.arange(count + n - 1)[:, None] + places  # in spacings from the support's lower end
        position = ((at - 0.5 * (count + n - 1)) * spacing_m).ravel()
        values = np.stack([basis_values(basis, at - i) for i in range(count)]).reshape(count, -1)
        weight = np.tile(weights * spacing_m, count + n - 1)
        inverse = np.linalg.inv(gram_matrix(basis, count, spacing_m))
        nearest = inverse @ (values * weight)
        moments = np.stack([weight, weight * position])[:min(2, count)]  # of a function at the nodes
        of_basis = moments @ values.T
        missing = moments - of_basis @ nearest
        return position, nearest + inverse @ of_basis.T @ np.linalg.solve(of_basis @ inverse @ of_basis.T, missing)

    u, along_u = axis(W)
    v, along_v = axis(H)
    points = np.stack(np.meshgrid(u, v), axis=-1)  # [v, u, 2]
    offset = (np.arange(samples) + 0.5) / samples
    C = None
    for row in range(rows):
        total = 0
        for dy in offset:
            t = (0.5 * rows - row - dy) * texel_m
            for dx in offset:
                s = np.stack([(np.arange(columns) + dx - 0.5 * columns) * texel_m, np.full(columns, t)], axis=-1)
                d = points[None] - s[:, None, None]
                cos = delta_m / np.sqrt(delta_m**2 + (d**2).sum(-1))
                L = np.asarray(radiance(points[None], s[:, None, None]), dtype=float)
                L = np.broadcast_to(L[..., None], (*cos.shape, 1)) if L.ndim <= 3 else L
                E = L * (cos**4 / delta_m**2)[..., None]
                total = total + np.einsum("jv,svuc,iu->jisc", along_v, E, along_u)
        total = total / samples**2
        if C is None:
            C = np.empty((W * H, total.shape[-1], rows, columns), np.float32)
        C[:, :, row, :] = total.reshape(W * H, columns, -1).transpose(0, 2, 1)
    return LightField(C, grid=grid, spacing_m=spacing_m, delta_m=delta_m, texel_m=texel_m, basis=basis, unit=unit)


def _axes(axes):
    import matplotlib.pyplot as plt  # only who draws needs it

    return plt.subplots()[1] if axes is None else axes


def luminance(values, axis=0):
    """The luminance of 1 or 3 channels of linear Rec. 709 along an axis."""
    values = np.asarray(values)
    if values.shape[axis] == 1:
        return np.take(values, 0, axis)
    return np.tensordot(np.array(LUMINANCE_WEIGHTS), values, (0, axis))


def plot_light_field(self, axes=None):
    """Draws the coefficient images as a contact sheet, as seen from the receivers: image (0, 0) below left."""
    axes = _axes(axes)
    W, H = self.grid
    images = luminance(self.C, axis=1)
    height, width = images.shape[1:]
    gap = max(1, width // 32)
    sheet = np.full((H * (height + gap) - gap, W * (width + gap) - gap), np.nan)
    for j in range(H):
        for i in range(W):
            top = (H - 1 - j) * (height + gap)
            left = i * (width + gap)
            sheet[top:top + height, left:left + width] = images[j * W + i]
    most = np.nanpercentile(sheet, 99.5)
    drawn = axes.imshow(sheet, cmap="cividis", vmin=0, vmax=most if most > 0 else 1)
    axes.figure.colorbar(drawn, ax=axes, label=f"C / ({self.unit} sr⁻¹ m⁻⁴)", extend="both")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(f"{W} × {H} coefficient images")
    return axes


def plot_intensity(self, axes=None):
    """Draws the far-field intensity through the axis, horizontally and vertically."""
    axes = _axes(axes)
    angle = np.linspace(-80, 80, 321)
    sin, cos = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    for name, d in (("horizontal", (sin, 0 * sin, cos)), ("vertical", (0 * sin, sin, cos))):
        axes.plot(angle, luminance(self.intensity(np.stack(d, axis=-1)), axis=-1), label=name)
    axes.set_xlabel("angle to the axis / °")
    axes.set_ylabel("intensity / cd" if self.unit == "lm" else f"intensity / ({self.unit} sr⁻¹)")
    axes.legend(frameon=False)
    return axes


LightField.from_function = staticmethod(from_function)
LightField.plot = plot_light_field
LightField.plot_intensity = plot_intensity
