"""PyTorch beside Overcoat on the same body and the same points: python3 fit.py TIME_FIT FOLDER

FOLDER holds a body of about 10 000 vertices with 24 joints in SMPL's order: body10k.npz with v (V,3) and f (F,3), metres,
Y up, and body10k_skin.npz with J (24,3), idx (V,4) and w (V,4), the skin weights. To it come 15 made-up directions of
shape of 8 mm each. The target is that body in a random shape and pose; 20 000 points of its surface, its vertices and the
middles of as many edges as are left, with 2 mm of noise in all directions, are what either side is given.

Overcoat reads a mesh, so for it the points are joined by the target's own triangles, split where an edge has a point of
its own. It is told nothing of where the body stands and finds heading and arms itself; PyTorch starts, as it must, close
by, from the body at rest in the origin. Both know the same model: same vertices, weights, joints and directions.
Printed are seconds, of the processor and on the wall, their ratios, and the distance of each vertex from its truth.
"""
import os, re, subprocess, sys, tempfile, time

os.environ.setdefault("OMP_NUM_THREADS", "2")
try:
    import numpy as np
    import torch
    from scipy.spatial import cKDTree
except ImportError as missing:
    sys.exit(f"{missing}: nothing was compared. PyTorch, SciPy and numpy must be in this Python: pip install torch scipy numpy")

program, folder = sys.argv[1:3]
torch.set_num_threads(2)
PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21]
COMPONENTS, POINTS, NOISE = 15, 20_000, 0.002  # metres
UNKNOWNS = COMPONENTS + 3 + 3 * 23  # shape, place, and all joints but the last, which moves nothing seen


def made_model(rng):
    """The arrays of a model in the SMPL layout."""
    body, skin = np.load(f"{folder}/body10k.npz"), np.load(f"{folder}/body10k_skin.npz")
    v, f, joints = body["v"].astype(np.float64), body["f"].astype(np.int64), skin["J"].astype(np.float64)
    weights = np.zeros((len(v), 24))
    np.put_along_axis(weights, skin["idx"].astype(np.int64), skin["w"].astype(np.float64), 1)
    waves, phases = rng.normal(0, 3, (COMPONENTS, 3, 3)), rng.uniform(0, 6, (COMPONENTS, 3))
    dirs = np.stack([np.sin(v @ waves[k] + phases[k]) for k in range(COMPONENTS)], -1) * 0.008
    # Each joint is a sum of the vertices that it moves, moved by as little as puts it where it is.
    regressor = (weights / weights.sum(0)).T
    known = np.vstack([v.T, np.ones(len(v))])
    for j, row in enumerate(regressor):
        lack = np.append(joints[j], 1.0) - known @ row
        row += row * (known.T @ np.linalg.solve((known * row) @ known.T, lack))
    tree = np.array([PARENTS, range(24)])
    return dict(v_template=v, shapedirs=dirs, J_regressor=regressor, kintree_table=tree, weights=weights, f=f)


def rotations(r):
    angle = (r * r).sum(-1, keepdim=True).add(1e-12).sqrt()
    k, z = r / angle, torch.zeros_like(r[:, 0])
    cross = torch.stack([z, -k[:, 2], k[:, 1], k[:, 2], z, -k[:, 0], -k[:, 1], k[:, 0], z], -1).view(-1, 3, 3)
    angle = angle[..., None]
    return torch.eye(3) + torch.sin(angle) * cross + (1 - torch.cos(angle)) * (cross @ cross)


class Body:
    """Linear blend skinning of a shaped body, in PyTorch."""

    def __init__(self, arrays):
        t = lambda a: torch.from_numpy(np.ascontiguousarray(a, dtype=np.float32))
        self.v, self.dirs, self.weights = t(arrays["v_template"]), t(arrays["shapedirs"]), t(arrays["weights"])
        regressor = arrays["J_regressor"]
        self.joints = t(regressor @ arrays["v_template"])
        self.joint_dirs = t(np.einsum("jn,nck->jck", regressor, arrays["shapedirs"]))
        self.f = torch.from_numpy(arrays["f"])

    def posed(self, x):
        shape, place = x[:COMPONENTS], x[COMPONENTS : COMPONENTS + 3]
        turns = rotations(torch.cat([x[COMPONENTS + 3 :], torch.zeros(3)]).view(24, 3))
        v, joints = self.v + self.dirs @ shape, self.joints + self.joint_dirs @ shape
        turned, at = [turns[0]], [joints[0]]
        for j in range(1, 24):
            p = PARENTS[j]
            turned.append(turned[p] @ turns[j])
            at.append(at[p] + turned[p] @ (joints[j] - joints[p]))
        turned, at = torch.stack(turned), torch.stack(at)
        at = at - (turned @ joints[..., None])[..., 0]
        blended = (self.weights @ torch.cat([turned, at[..., None]], -1).view(24, 12)).view(-1, 3, 4)
        return (blended[:, :, :3] @ v[..., None])[..., 0] + blended[:, :, 3] + place

    def normals(self, v):
        n, f = torch.zeros_like(v), self.f
        cross = torch.linalg.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
        for k in range(3):
            n.index_add_(0, f[:, k], cross)
        return n / n.norm(dim=1, keepdim=True).clamp_min(1e-12)


def sampled(v, f, rng):
    """20 000 points of a surface, vertices and middles of edges, and the triangles that join them."""
    edges = np.unique(np.sort(np.vstack([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), axis=1), axis=0)
    split = edges[np.sort(rng.permutation(len(edges))[: POINTS - len(v)])]
    points = np.vstack([v, v[split].mean(1)])
    middle = {(a, b): len(v) + k for k, (a, b) in enumerate(split.tolist())}
    faces = []
    for corners in f.tolist():
        # Around the triangle, with the middles between its corners.
        ring, cut = [], []
        for k in range(3):
            a, b = corners[k], corners[(k + 1) % 3]
            m = middle.get((min(a, b), max(a, b)))
            ring += [a] if m is None else [a, m]
            cut.append(m)
        if None not in cut:
            (a, b, c), (ab, bc, ca) = corners, cut
            faces += [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        elif all(m is None for m in cut):
            faces.append(corners)
        else:
            # A fan from a middle leaves no triangle flat.
            start = next(i for i, p in enumerate(ring) if p >= len(v))
            ring = ring[start:] + ring[:start]
            faces += [[ring[0], ring[i], ring[i + 1]] for i in range(1, len(ring) - 1)]
    return points, np.array(faces)


def write_ply(path, points, faces):
    head = "ply\nformat binary_little_endian 1.0\n"
    head += f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = np.zeros(len(faces), dtype=[("n", "u1"), ("v", "<i4", 3)])
    rows["n"], rows["v"] = 3, faces
    with open(path, "wb") as file:
        file.write(head.encode() + points.astype("<f4").tobytes() + rows.tobytes())


def read_points(path, count):
    with open(path, "rb") as file:
        while file.readline().strip() != b"end_header":
            pass
        return np.frombuffer(file.read(12 * count), "<f4").reshape(-1, 3)


def timed(work):
    began = time.process_time(), time.perf_counter()
    found = work()
    return found, (time.process_time() - began[0], time.perf_counter() - began[1])


def prior():
    parts = torch.full((COMPONENTS,), 0.02), torch.zeros(6), torch.full((UNKNOWNS - COMPONENTS - 6,), 0.05)
    return torch.cat(parts) * 0.1


def levenberg_marquardt(body, scan, iterations):
    """Exact Jacobians by forward differentiation, closest points, point to plane with a little point to point."""
    x, seen, stiff, count = torch.zeros(UNKNOWNS), scan.numpy(), prior(), len(body.v)
    jacobian = torch.func.jacfwd(body.posed)
    for iteration in range(iterations):
        with torch.no_grad():
            y, j = body.posed(x), jacobian(x)
            near = torch.from_numpy(cKDTree(y.numpy()).query(seen, workers=2)[1])
            n, d = body.normals(y)[near], y[near] - scan
            to_point = 0.03 if iteration > 3 else 0.5
            robust = 1 / (1 + (d.norm(dim=1) / 0.05) ** 2)
            rows = torch.einsum("nc,nck->nk", n, j[near]) * robust.sqrt()[:, None]
            r = (d * n).sum(1) * robust.sqrt()
            weight = torch.zeros(count).index_add_(0, near, robust).repeat_interleave(3)
            pull = torch.zeros(count, 3).index_add_(0, near, d * robust[:, None])
            flat, of_prior = j.reshape(-1, UNKNOWNS), stiff**2 * len(scan) * 1e-3
            h = rows.T @ rows + to_point * (flat * weight[:, None]).T @ flat + torch.diag(of_prior)
            b = rows.T @ r + to_point * flat.T @ pull.reshape(-1) + of_prior * x
            x = x - torch.linalg.solve(h + 1e-3 * torch.eye(UNKNOWNS), b)
    return x


def adam(body, scan, iterations=200, again=5):
    """The usual way: automatic differentiation, closest points looked up anew every few steps."""
    x, seen, stiff = torch.zeros(UNKNOWNS, requires_grad=True), scan.numpy(), prior()
    optimiser = torch.optim.Adam([x], lr=0.03)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, iterations, 1e-3)
    for iteration in range(iterations):
        optimiser.zero_grad()
        y = body.posed(x)
        if iteration % again == 0:
            with torch.no_grad():
                near = torch.from_numpy(cKDTree(y.detach().numpy()).query(seen, workers=2)[1])
                n = body.normals(y)[near]
        d, to_point = y[near] - scan, 0.1 if iteration > 20 else 1.0
        loss = ((d * n).sum(1) ** 2).mean() * 1e4 + to_point * (d**2).sum(1).mean() * 1e3 + ((stiff * x) ** 2).sum()
        loss.backward()
        optimiser.step()
        schedule.step()
    return x.detach()


def told(name, secs, off):
    mean, p95, most = off.mean(), np.quantile(off, 0.95), off.max()
    print(f"{name:16} | {secs[0]:7.2f} s of processor time, {secs[1]:7.2f} on the wall | vertices off by {mean:.2f} mm on average, {p95:.2f} at 95 %, {most:.1f} at most", flush=True)


rng = np.random.default_rng(0)
arrays = made_model(rng)
body = Body(arrays)
truth = torch.zeros(UNKNOWNS)
dice = torch.Generator().manual_seed(1)
truth[:COMPONENTS] = torch.randn(COMPONENTS, generator=dice)
truth[COMPONENTS : COMPONENTS + 3] = torch.tensor([0.03, -0.02, 0.04])
truth[COMPONENTS + 3 :] = torch.randn(UNKNOWNS - COMPONENTS - 3, generator=dice) * 0.12
with torch.no_grad():
    target = body.posed(truth).numpy()
points, faces = sampled(target, arrays["f"], rng)
points = points + rng.normal(0, NOISE, points.shape)
scan = torch.from_numpy(points.astype(np.float32))
off = lambda v: 1e3 * np.linalg.norm(v - target, axis=1)

print(f"PyTorch {torch.__version__}, {len(target)} vertices, {len(points)} points, {UNKNOWNS} unknowns")
with tempfile.TemporaryDirectory() as there:
    np.savez(f"{there}/model.npz", **arrays)
    write_ply(f"{there}/scan.ply", points, faces)
    text = subprocess.run([program, f"{there}/scan.ply", "--model", f"{there}/model.npz", "--repeat", "5", "-o", f"{there}/fitted.ply"], check=True, capture_output=True, text=True).stdout
    wall, processor = map(float, re.search(r": ([\d.]+) s, ([\d.]+) s of processor", text).groups())
    ours = (processor, wall)
    told("Overcoat", ours, off(read_points(f"{there}/fitted.ply", len(target))))
print(text.strip())
for name, work in [
    ("LM, 12 rounds", lambda: levenberg_marquardt(body, scan, 12)),
    ("LM, 25 rounds", lambda: levenberg_marquardt(body, scan, 25)),
    ("Adam, 200 rounds", lambda: adam(body, scan)),
]:
    x, secs = timed(work)
    with torch.no_grad():
        told(name, secs, off(body.posed(x).numpy()))
    print(f"{'':16} | {secs[0] / ours[0]:.1f} x the processor time of Overcoat, {secs[1] / ours[1]:.1f} x on the wall")
