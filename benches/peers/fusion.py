"""Open3D beside Overcoat on the same frames: python3 fusion.py MEASURE_FUSION FOLDER

Prints milliseconds a frame, of all threads' processor time and on the wall, and their ratios. Processor time is what to
go by where other programs run. Both integrate the same frames into voxels of the same size with the same truncation, once depths
alone and once with colours. Open3D is *given* the true poses for integration, and neighbouring frames for its ICP, both with
background and floor cut off; Overcoat's tracking figure includes prediction and integration of the frame.
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
VOXEL, TRUNCATION = 0.004, 0.02  # metres: ours by default
FAR, FLOOR, REACH = 2.6, 0.02, 1.1  # metres: before the wall; above the floor; from the axis
BLOCK, ROOM = 8, 40000  # voxels along a block's side, as ours; blocks that its table has room for


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


def ours(*options):
    text = subprocess.run([program, folder, *options], check=True, capture_output=True, text=True).stdout
    a_frame = {n: np.array([float(cpu), float(wall)]) for n, wall, cpu in re.findall(r"(\w+) +[\d.]+ ms, ([\d.]+) a frame, ([\d.]+) of processor time", text)}
    whole = re.search(r"whole with cleaning ([\d.]+) s, ([\d.]+) of processor time", text).groups()
    return a_frame["Integrated"], a_frame["Tracked"], whole, re.search(r"(\d+) blocks", text)[1]


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
    colors = [np.asarray(o3d.io.read_image(f"{folder}/{p[1]}")).copy() for p in pairs]
    return camera, depths, colors, extrinsics


def integrate(camera, depths, colors, extrinsics):
    """Milliseconds a frame, and blocks in the end; without colours if there are none."""
    k = o3c.Tensor(np.array([[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1.0]]))
    names, channels = (("tsdf", "weight", "color"), ((1), (1), (3))) if colors else (("tsdf", "weight"), ((1), (1)))
    grid = o3d.t.geometry.VoxelBlockGrid(names, (o3c.float32,) * len(names), channels, VOXEL, BLOCK, ROOM, o3c.Device("CPU:0"))
    scale, watch, truncation = float(camera["depth_scale"]), Watch(), TRUNCATION / VOXEL
    for i, (depth, extrinsic) in enumerate(zip(depths, extrinsics)):
        image, pose = o3d.t.geometry.Image(o3c.Tensor(depth)), o3c.Tensor(extrinsic)
        color = o3d.t.geometry.Image(o3c.Tensor(colors[i])) if colors else None
        with watch:
            blocks = grid.compute_unique_block_coordinates(image, k, pose, scale, FAR, truncation)
            if colors:
                grid.integrate(blocks, image, color, k, k, pose, scale, FAR, truncation)
            else:
                grid.integrate(blocks, image, k, pose, scale, FAR, truncation)
    return watch.mean_ms(), grid.hashmap().size()


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


camera, depths, colors, extrinsics = frames()
same_size = colors[0].shape[:2] == depths[0].shape
plain, blocks = integrate(camera, depths, None, extrinsics)
colored, _ = integrate(camera, depths, colors, extrinsics) if same_size else (None, None)
tracked = icp(camera, depths)
our_plain, _, _, our_blocks = ours("--no-color")
our_colored, our_tracked, whole, _ = ours()
print(f"Open3D {o3d.__version__}, {len(depths)} frames of {camera['width']} x {camera['height']}, voxels of {1e3 * VOXEL:.0f} mm in blocks of {BLOCK}^3, truncation {1e3 * TRUNCATION:.0f} mm; blocks in the end: {blocks}, ours {our_blocks}")
print(f"threads: Open3D {os.environ['OMP_NUM_THREADS']}, ours {os.environ.get('RAYON_NUM_THREADS', os.cpu_count())}")
told("integrate a frame, depths", plain, our_plain, "VoxelBlockGrid")
if same_size:
    told("integrate a frame, depths and colours", colored, our_colored, "VoxelBlockGrid")
told("track a frame", tracked, our_tracked, "ICP with normals")
print(f"whole scan, cleaning included | ours {whole[1]} s of processor time ({whole[0]} on the wall)")
