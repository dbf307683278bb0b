"""Open3D beside Overcoat on the same frames: python3 fusion.py MEASURE_FUSION FOLDER

Prints milliseconds a frame, of all threads' processor time and on the wall, and their ratios. Processor time is what to
go by where other programs run. Open3D is *given* the true poses for integration, and neighbouring frames for its ICP, both
with background and floor cut off; Overcoat's integration averages colours, too, and its tracking figure includes prediction
and integration of the frame.
"""
import json, os, re, subprocess, sys, time

os.environ.setdefault("OMP_NUM_THREADS", "2")
try:
    import numpy as np
    import open3d as o3d
    import open3d.core as o3c
except ImportError as missing:
    sys.exit(f"{missing}: nothing was compared. Open3D and numpy must be in this Python: pip install open3d==0.19.0, which needs Python 3.8 to 3.12")

program, folder = sys.argv[1:3]
VOXEL, FAR, FLOOR, REACH = 0.004, 2.6, 0.02, 1.1  # metres: ours by default; before the wall; above the floor; from the axis


class Watch:
    """Processor and wall seconds of what runs between two looks."""

    def __init__(self):
        self.laps = []

    def __enter__(self):
        self.began = time.process_time(), time.perf_counter()

    def __exit__(self, *_):
        self.laps.append((time.process_time() - self.began[0], time.perf_counter() - self.began[1]))

    def mean_ms(self):
        return 1e3 * np.mean(self.laps, axis=0)


def ours():
    text = subprocess.run([program, folder, "--tracking", "0.005"], check=True, capture_output=True, text=True).stdout
    a_frame = {n: np.array([float(cpu), float(wall)]) for n, wall, cpu in re.findall(r"(\w+) +[\d.]+ ms, ([\d.]+) a frame, ([\d.]+) of processor time", text)}
    whole = re.search(r"whole with cleaning ([\d.]+) s, ([\d.]+) of processor time", text).groups()
    return a_frame["Integrated"], a_frame["Tracked"], whole


def frames():
    camera = json.load(open(f"{folder}/camera.json"))
    pairs = [l.split() for l in open(f"{folder}/associations.txt") if l.strip() and not l.startswith("#")]
    poses = [[float(n) for n in l.split()] for l in open(f"{folder}/groundtruth.txt") if not l.startswith("#")]
    depths = [np.asarray(o3d.io.read_image(f"{folder}/{p[3]}")).copy() for p in pairs]
    rows, columns = np.indices(depths[0].shape)
    extrinsics = []
    for d, (_, x, y, z, qx, qy, qz, qw) in zip(depths, poses):
        pose = np.eye(4)
        pose[:3, :3] = o3d.geometry.get_rotation_matrix_from_quaternion([qw, qx, qy, qz])
        pose[:3, 3] = [x, y, z]
        extrinsics.append(np.linalg.inv(pose))
        z = d / camera["depth_scale"]
        seen = np.stack([(columns - camera["cx"]) / camera["fx"] * z, (rows - camera["cy"]) / camera["fy"] * z, z], -1)
        world = seen @ pose[:3, :3].T + pose[:3, 3]
        d[(z > FAR) | (world[..., 1] < FLOOR) | (np.hypot(world[..., 0], world[..., 2]) > REACH)] = 0
    return camera, depths, extrinsics


def integrate(camera, depths, extrinsics):
    k = o3c.Tensor(np.array([[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1.0]]))
    grid = o3d.t.geometry.VoxelBlockGrid(("tsdf", "weight"), (o3c.float32, o3c.float32), ((1), (1)), VOXEL, 8, 40000, o3c.Device("CPU:0"))
    scale, watch = float(camera["depth_scale"]), Watch()
    for depth, extrinsic in zip(depths, extrinsics):
        image, pose = o3d.t.geometry.Image(o3c.Tensor(depth)), o3c.Tensor(extrinsic)
        with watch:
            blocks = grid.compute_unique_block_coordinates(image, k, pose, scale, FAR, 5.0)
            grid.integrate(blocks, image, k, pose, scale, FAR, 5.0)
    return watch.mean_ms()


def icp(camera, depths):
    intrinsic = o3d.camera.PinholeCameraIntrinsic(camera["width"], camera["height"], camera["fx"], camera["fy"], camera["cx"], camera["cy"])

    def cloud(depth, normals):
        points = o3d.geometry.PointCloud.create_from_depth_image(o3d.geometry.Image(depth), intrinsic, depth_scale=float(camera["depth_scale"]), depth_trunc=FAR)
        if normals:
            points.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(0.02, 20))
        return points

    r, watch = o3d.pipelines.registration, Watch()
    for before, after in list(zip(depths, depths[1:]))[:20]:
        with watch:
            target, source = cloud(before, True), cloud(after, False)
            r.registration_icp(source, target, 0.05, np.eye(4), r.TransformationEstimationPointToPlane(), r.ICPConvergenceCriteria(1e-6, 1e-6, 20))
    return watch.mean_ms()


def told(what, theirs, ours, name):
    ratio = theirs / ours
    print(f"{what} | Open3D {name} {theirs[0]:.1f} ms of processor time ({theirs[1]:.1f} on the wall) | ours {ours[0]:.1f} ({ours[1]:.1f}) | {ratio[0]:.1f} x ({ratio[1]:.1f})")


camera, depths, extrinsics = frames()
theirs = integrate(camera, depths, extrinsics), icp(camera, depths)
integrated, tracked, whole = ours()
print(f"Open3D {o3d.__version__}, {len(depths)} frames")
told("integrate a frame", theirs[0], integrated, "VoxelBlockGrid")
told("track a frame", theirs[1], tracked, "ICP with normals")
print(f"whole scan, cleaning included | ours {whole[1]} s of processor time ({whole[0]} on the wall)")
