"""OpenUSD reads the stage; the checks are the formulas of UsdLux's own documentation."""

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdValidation

import probe

VERSION = ".".join(map(str, Usd.GetVersion()[1:]))


def to_world(prim, vectors):
    matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0))
    return vectors @ matrix[:3, :3]


def lights(path):
    """Name → direction, ∫ L dω and angular radius of each distant light."""
    found = {}
    stage = Usd.Stage.Open(str(path))
    for prim in stage.Traverse():
        if not prim.IsA(UsdLux.DistantLight):
            continue
        light = UsdLux.DistantLight(prim)
        angle = np.radians(light.GetAngleAttr().Get()) / 2
        radiance = light.GetIntensityAttr().Get() * 2.0 ** light.GetExposureAttr().Get()
        radiance *= np.array(Gf.Vec3f(light.GetColorAttr().Get()))
        if light.GetNormalizeAttr().Get() and angle > 0:
            radiance /= np.pi * np.sin(angle) ** 2
        solid_angle = 4 * np.pi * np.sin(angle / 2) ** 2 if angle > 0 else 1
        # It emits along -Z.
        direction = to_world(prim, np.array([0.0, 0.0, 1.0]))
        found[prim.GetName()] = (direction, radiance * solid_angle, angle)
    return found


def dome(path):
    """The texture's resolved path and the world directions of u, v in it (u right, v down)."""
    stage = Usd.Stage.Open(str(path))
    for prim in stage.Traverse():
        if prim.IsA(UsdLux.DomeLight):
            light = UsdLux.DomeLight(prim)
            texture = light.GetTextureFileAttr().Get().resolvedPath

            def direction(u, v, prim=prim, stage=stage):  # a stage that nobody holds expires
                # Left longitude +π, right −π; longitude 0 is +Z, π/2 is +X; the top is +Y.
                longitude, latitude = np.pi * (1 - 2 * u), np.pi * (0.5 - v)
                across = np.cos(latitude)
                local = [across * np.sin(longitude), np.sin(latitude), across * np.cos(longitude)]
                return to_world(prim, np.stack(local, -1))

            return texture, direction
    return None


def errors(path):
    """What the validators of OpenUSD's schemas, geometry and light among them, say of the stage."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(path)))
    return [error.GetErrorAsString() for error in found]


def up_axis(path):
    return UsdGeom.GetStageUpAxis(Usd.Stage.Open(str(path)))
