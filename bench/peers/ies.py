"""LM-63 photometric files, type C without tilt, as far as lamps of peers need them.

read(path) gives {"polar_deg": [...], "azimuth_deg": [...], "candela": [a row for each azimuth]} over
the angles that the file lists. Between them intensity is bilinear in both angles; beyond the last
polar angle it is 0; azimuths of a quarter or a half are mirrored (ANSI/IES LM-63-19, 5.13).
"""

import bisect
import pathlib

from refused import Refused


def read(path):
    text = pathlib.Path(path).read_text(errors="replace")
    if not text.startswith("IESNA"):
        raise Refused(f"{path}: is no LM-63 file (.ies)")
    head, _, rest = text.partition("TILT=")
    tilt, _, rest = rest.partition("\n")
    if tilt.strip() != "NONE":
        raise Refused(f"{path}: TILT={tilt.strip()}: lamps without tilt only")
    numbers = iter(float(word) for word in rest.replace(",", " ").split())

    def take(count):
        return [next(numbers) for _ in range(count)]

    _, _, multiplier, polar, azimuth, kind = take(6)
    take(4)  # unit and size of the opening: points have none
    ballast, _, _ = take(3)
    if kind != 1:
        raise Refused(f"{path}: photometry of type C only")
    polar_deg, azimuth_deg = take(int(polar)), take(int(azimuth))
    if azimuth_deg[-1] not in (0, 90, 180, 360):
        raise Refused(f"{path}: azimuths end at {azimuth_deg[-1]:g} degrees: 0, 90, 180 or 360 only")
    candela = [[multiplier * ballast * value for value in take(int(polar))] for _ in azimuth_deg]
    return {"polar_deg": polar_deg, "azimuth_deg": azimuth_deg, "candela": candela}


def _place(knots, x):
    """Index k and share t with x = (1 - t) knots[k] + t knots[k + 1]."""
    k = min(max(bisect.bisect_right(knots, x) - 1, 0), len(knots) - 2)
    return k, (x - knots[k]) / (knots[k + 1] - knots[k])


def intensity(distribution, polar, azimuth):
    """Candela in a direction, degrees."""
    polars, azimuths, rows = (distribution[key] for key in ("polar_deg", "azimuth_deg", "candela"))
    if not polars[0] <= polar <= polars[-1]:
        return 0.0
    k, t = _place(polars, polar)

    def of_row(row):
        return (1 - t) * row[k] + t * row[k + 1]

    last = azimuths[-1]
    if last == 0:
        return of_row(rows[0])
    azimuth %= 360
    if last < 360:
        azimuth = min(azimuth, 360 - azimuth)
    if last == 90:
        azimuth = min(azimuth, 180 - azimuth)
    j, s = _place(azimuths, azimuth)
    return (1 - s) * of_row(rows[j]) + s * of_row(rows[j + 1])


def write_dense(path, distribution, polar_step, azimuth_step):
    """The same over all directions, at steps so small that how a reader interpolates does not matter.

    Cycles takes what lies beyond the first and the last azimuth for dark: these two intervals are narrow.
    """
    polars = [polar_step * k for k in range(round(180 / polar_step) + 1)]
    azimuths = [azimuth_step * k for k in range(round(360 / azimuth_step) + 1)]
    azimuths = [azimuths[0], 0.01, *azimuths[1:-1], 359.99, azimuths[-1]]
    lines = ["IESNA:LM-63-2002", "TILT=NONE", f"1 -1 1 {len(polars)} {len(azimuths)} 1 2 0 0 0", "1 1 0",
             " ".join(f"{p:g}" for p in polars), " ".join(f"{a:g}" for a in azimuths)]
    lines += [" ".join(f"{intensity(distribution, p, a):.7g}" for p in polars) for a in azimuths]
    pathlib.Path(path).write_text("\n".join(lines) + "\n")


def spot(distribution):
    """(candela, beam, cutoff) in degrees, if intensity is even up to the beam and falls linearly to 0; else None."""
    polars, rows = distribution["polar_deg"], distribution["candela"]
    if len(rows) != 1 or len(polars) < 3 or polars[0] != 0:
        return None
    row = rows[0]
    lit = [k for k, value in enumerate(row) if value > 0]
    if lit != list(range(len(lit))) or not 0 < len(lit) < len(row) or any(row[k] != row[0] for k in lit):
        return None
    return row[0], polars[lit[-1]], polars[len(lit)]
