"""Open3D beside Overcoat on the same frames: python3 fusion.py MEASURE_FUSION FOLDER

Prints wall milliseconds a frame and the ratio. Open3D is *given* the true poses for integration, and neighbouring frames
with the background cut off for its ICP; Overcoat's tracking figure includes prediction and integration of the frame.
"""
import json, os, re, subprocess, sys, time
import numpy as np

os.environ.setdefault("OMP_NUM_THREADS", "2")
import open3d as o3d
import open3d.core as o3c

program, folder = sys.argv[1:3]
VOXEL, FAR = 0.004, 2.6  # metres: ours by default; between the person and the wall


def median_ms(secs):
    return 1e3 * float(np.median(secs))


def ours():
    text = subprocess.run([program, folder, "--tracking", "0.005"], check=True, capture_output=True, text=True).stdout
    a_frame = dict(re.findall(r"(\w+) +[\d.]+ ms, ([\d.]+) a frame", text))
    whole = float(re.search(r"whole with cleaning ([\d.]+) s", text).group(1))
    return float(a_frame["Integrated"]), float(a_frame["Tracked"]), whole


def frames():
    camera = json.load(open(f"{folder}/camera.json"))
    pairs = [l.split() for l in open(f"{folder}/associations.txt") if l.strip() and not l.startswith("#")]
    poses = [[float(n) for n in l.split()] for l in open(f"{folder}/groundtruth.txt") if not l.startswith("#")]
    depths = [np.asarray(o3d.io.read_image(f"{folder}/{p[3]}")).copy() for p in pairs]
    for d in depths:
        d[d > FAR * camera["depth_scale"]] = 0
    extrinsics = []
    for _, x, y, z, qx, qy, qz, qw in poses:
        pose = np.eye(4)
        pose[:3, :3] = o3d.geometry.get_rotation_matrix_from_quaternion([qw, qx, qy, qz])
        pose[:3, 3] = [x, y, z]
        extrinsics.append(np.linalg.inv(pose))
    return camera, depths, extrinsics


def integrate(camera, depths, extrinsics):
    k = o3c.Tensor(np.array([[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1.0]]))
    grid = o3d.t.geometry.VoxelBlockGrid(("tsdf", "weight"), (o3c.float32, o3c.float32), ((1), (1)), VOXEL, 8, 40000, o3c.Device("CPU:0"))
    secs = []
    for depth, extrinsic in zip(depths, extrinsics):
        image, pose = o3d.t.geometry.Image(o3c.Tensor(depth)), o3c.Tensor(extrinsic)
        began = time.perf_counter()
        blocks = grid.compute_unique_block_coordinates(image, k, pose, camera["depth_scale"], FAR, 5.0)
        grid.integrate(blocks, image, k, pose, camera["depth_scale"], FAR, 5.0)
        secs.append(time.perf_counter() - began)
    return median_ms(secs)


def icp(camera, depths):
    intrinsic = o3d.camera.PinholeCameraIntrinsic(camera["width"], camera["height"], camera["fx"], camera["fy"], camera["cx"], camera["cy"])

    def cloud(depth, normals):
        points = o3d.geometry.PointCloud.create_from_depth_image(o3d.geometry.Image(depth), intrinsic, depth_scale=float(camera["depth_scale"]), depth_trunc=FAR)
        if normals:
            points.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(0.02, 20))
        return points

    secs = []
    for before, after in list(zip(depths, depths[1:]))[:20]:
        began = time.perf_counter()
        target, source = cloud(before, True), cloud(after, False)
        r = o3d.pipelines.registration
        r.registration_icp(source, target, 0.05, np.eye(4), r.TransformationEstimationPointToPlane(), r.ICPConvergenceCriteria(1e-6, 1e-6, 20))
        secs.append(time.perf_counter() - began)
    return median_ms(secs)


camera, depths, extrinsics = frames()
theirs = integrate(camera, depths, extrinsics), icp(camera, depths)
integrated, tracked, whole = ours()
print(f"integrate a frame | Open3D VoxelBlockGrid {theirs[0]:.1f} ms | ours {integrated:.1f} ms | {theirs[0] / integrated:.1f} x")
print(f"track a frame | Open3D ICP with normals {theirs[1]:.1f} ms | ours {tracked:.1f} ms | {theirs[1] / tracked:.1f} x")
print(f"whole scan of {len(depths)} frames | ours {whole:.2f} s")
