"""OpenUSD's own checker on a layer, and what the layer says of the light: prints JSON.

    python check_usd.py lamp.usda
"""

import json
import sys

from pxr import Gf, Usd, UsdGeom, UsdLux, UsdValidation


def problems(stage):
    """Of all validators, which usdchecker runs."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    return [f"{error.GetName()}: {error.GetMessage()}" for error in UsdValidation.ValidationContext(validators).Validate(stage)]


def main(path):
    stage = Usd.Stage.Open(path)
    root = stage.GetDefaultPrim()
    face = next(prim for prim in stage.Traverse() if prim.IsA(UsdLux.RectLight))
    light, shaping = UsdLux.RectLight(face), UsdLux.ShapingAPI(face)
    place = UsdGeom.XformCache().GetLocalToWorldTransform(face)

    def asset(attribute):
        value = attribute.Get()
        return value.resolvedPath if value else ""

    print(json.dumps({
        "problems": problems(stage),
        "shines_towards": list(place.TransformDir(Gf.Vec3d(0, 0, -1))),
        "c0": list(place.TransformDir(Gf.Vec3d(1, 0, 0))),
        "c90": list(place.TransformDir(Gf.Vec3d(0, 1, 0))),
        "middle": list(place.Transform(Gf.Vec3d(0, 0, 0))),
        "width": light.GetWidthAttr().Get(),
        "height": light.GetHeightAttr().Get(),
        "has_shaping": face.HasAPI(UsdLux.ShapingAPI),
        "profile": asset(shaping.GetShapingIesFileAttr()),
        "light_field": asset(root.GetAttribute("luxfield:lightField")),
        "meters_per_unit": UsdGeom.GetStageMetersPerUnit(stage),
    }))


main(sys.argv[1])
