"""Opens USD files in OpenUSD: runs all its validators, and skins the meshes by its own code.

usage: usd.py FILE.usd? ...      (pip install usd-core numpy)
"""
import sys

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdSkel, UsdValidation, Vt


def points_at(mesh, query, skinning, time):
    points = Vt.Vec3fArray(mesh.GetPointsAttr().Get(Usd.TimeCode(time)))
    if skinning is None or not skinning.HasJointInfluences():
        return np.array(points)
    transforms = query.ComputeSkinningTransforms(Usd.TimeCode(time))
    skinning.ComputeSkinnedPoints(transforms, points, Usd.TimeCode(time))
    return np.array(points)


def own_points(mesh, skeleton, query, time):
    """The same by the definition of linear blend skinning alone."""
    points = np.array(mesh.GetPointsAttr().Get())
    binding = UsdSkel.BindingAPI(mesh.GetPrim())
    count = binding.GetJointIndicesPrimvar().GetElementSize()
    joints = np.array(binding.GetJointIndicesPrimvar().Get()).reshape(-1, count)
    weights = np.array(binding.GetJointWeightsPrimvar().Get()).reshape(-1, count)
    bind = np.array(skeleton.GetBindTransformsAttr().Get())
    posed = np.array(query.ComputeJointSkelTransforms(Usd.TimeCode(time)))
    moves = np.linalg.inv(bind) @ posed
    at = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    return sum(weights[:, k, None] * np.einsum("vi,vij->vj", at, moves[joints[:, k]])[:, :3] for k in range(count))


faults = 0
for path in sys.argv[1:]:
    stage = Usd.Stage.Open(path)
    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    errors = context.Validate(stage)
    for error in errors:
        print("  ", error.GetErrorAsString())
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    skeleton = next(UsdSkel.Skeleton(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Skeleton))
    root = UsdSkel.Root(stage.GetDefaultPrim())
    cache = UsdSkel.Cache()
    cache.Populate(root, Usd.TraverseInstanceProxies())
    query = cache.GetSkelQuery(skeleton)
    times = np.linspace(stage.GetStartTimeCode(), stage.GetEndTimeCode(), 3).round()
    worst = 0.0
    for mesh in meshes:
        skinning = cache.GetSkinningQuery(mesh.GetPrim())
        for time in times:
            theirs = points_at(mesh, query, skinning, time)
            if skinning and skinning.HasJointInfluences():
                worst = max(worst, np.abs(theirs - own_points(mesh, skeleton, query, time)).max())
    worst *= UsdGeom.GetStageMetersPerUnit(stage)
    sampled = sum(mesh.GetPointsAttr().GetNumTimeSamples() > 1 for mesh in meshes)
    print(f"{path}: {len(errors)} faults, {len(meshes)} meshes ({sampled} with time samples), "
          f"{len(skeleton.GetJointsAttr().Get())} joints, times {times}, skinning differs by {1000 * worst:.4f} mm")
    faults += len(errors) + (worst > 1e-5)
sys.exit(1 if faults else 0)
