"""Kernels of other programs beside Overcoat's on the same input: python3 kernels.py TIME_KERNELS

Prints median milliseconds on the wall and their ratio (above 1: Overcoat is faster), all on OMP_NUM_THREADS (2) threads
where the program has threads. A package that is missing is named and its line left out. Quadratic programs have no peer
here: the usual packages wrap the solver that Overcoat uses.
"""
import os, statistics, subprocess, sys, tempfile, time

os.environ.setdefault("OMP_NUM_THREADS", "2")
os.environ.setdefault("RAYON_NUM_THREADS", os.environ["OMP_NUM_THREADS"])
try:
    import numpy as np
except ImportError as missing:
    sys.exit(f"{missing}: nothing was compared. This needs numpy, and for its lines open3d, libigl, scipy, cholespy, PyMaxflow: pip install numpy open3d==0.19.0 libigl scipy cholespy PyMaxflow")

program = sys.argv[1]
folder = tempfile.mkdtemp()
text = subprocess.run([program, folder], check=True, capture_output=True, text=True).stdout
ours = {name: float(ms) for name, ms in (line.split() for line in text.splitlines())}
read = lambda name: np.load(f"{folder}/{name}.npy")
v, f, q = read("points").reshape(-1, 3), read("faces").reshape(-1, 3), read("queries").reshape(-1, 3)
print(f"{len(v)} vertices, {len(f)} triangles, {len(q)} queries")


def timed(run):
    """Median milliseconds of seven runs, after one that warms up."""
    laps = []
    for _ in range(8):
        began = time.perf_counter()
        run()
        laps.append(1e3 * (time.perf_counter() - began))
    return statistics.median(laps[1:])


def row(kernel, peer, make):
    """One line; `make` imports the peer and gives what is timed."""
    try:
        theirs = timed(make())
    except ImportError as missing:
        print(f"{kernel:28} {peer:28} not compared: {missing}")
        return
    print(f"{kernel:28} {peer:28} {theirs:9.2f} ms, ours {ours[kernel]:9.2f} ms, ratio {theirs / ours[kernel]:.2f}")


def open3d_closest():
    import open3d as o3d
    scene = o3d.t.geometry.RaycastingScene(nthreads=int(os.environ["OMP_NUM_THREADS"]))
    scene.add_triangles(v.astype(np.float32), f.astype(np.uint32))
    queries = o3d.core.Tensor(q.astype(np.float32))
    return lambda: scene.compute_closest_points(queries)


def igl_closest():
    import igl
    return lambda: igl.point_mesh_squared_distance(q, v, f.astype(np.int64))


def igl_winding():
    import igl
    return lambda: igl.fast_winding_number(v, f.astype(np.int64), q)


def matrix():
    import scipy.sparse as sparse
    return sparse.coo_matrix((read("values"), (read("rows"), read("columns"))), shape=(len(v), len(v)))


def cholespy_factor():
    from cholespy import CholeskySolverD, MatrixType
    a = matrix().tocsc().tocoo()
    row, column = a.row.astype(np.int32), a.col.astype(np.int32)
    return lambda: CholeskySolverD(len(v), row, column, a.data, MatrixType.COO)


def cholespy_solve():
    factor, x = cholespy_factor()(), np.zeros_like(v)
    return lambda: factor.solve(np.ascontiguousarray(v), x)


def scipy_factor():
    import scipy.sparse.linalg as linalg
    a = matrix().tocsc()
    return lambda: linalg.splu(a, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=dict(SymmetricMode=True))


def pymaxflow():
    import maxflow
    unary, edges = read("unary"), read("edges").reshape(-1, 3)

    def run():
        graph = maxflow.Graph[int](len(unary), len(edges))
        nodes = graph.add_nodes(len(unary))
        for node, cost in zip(nodes, unary.tolist()):
            graph.add_tedge(node, max(cost, 0), max(-cost, 0))
        graph.add_edges(edges[:, 0], edges[:, 1], edges[:, 2], edges[:, 2])
        graph.maxflow()

    return run


row("closest_point", "Open3D RaycastingScene", open3d_closest)
row("closest_point_with_prepare", "libigl", igl_closest)
row("winding_number_with_prepare", "libigl, fast", igl_winding)
row("max_flow", "PyMaxflow, with its graph", pymaxflow)
row("cholesky_prepare", "cholespy", cholespy_factor)
row("cholesky_prepare", "SciPy splu", scipy_factor)
row("cholesky_solve_3", "cholespy", cholespy_solve)
print(f"{'quadratic_program':28} {'no peer':28} {'':9}    ours {ours['quadratic_program']:9.2f} ms")
