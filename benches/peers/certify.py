#!/usr/bin/env python3
"""Checks an exported figure with an independent library: no layer intersects itself or another layer.

usage: certify.py FIGURE.glb [...]        needs `pip install ipctk numpy`

Reads the 32-bit positions as they are in the file. Prints per layer and pair of layers how many edges pass through
triangles, as ipctk's exact test finds them. Exit code 1 if there is any."""
import json
import struct
import sys

import numpy as np

try:
    import ipctk
except ImportError:
    sys.exit("certify.py needs the package ipctk: pip install ipctk")

COMPONENTS = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def layers_of(path):
    """(name, V x 3 positions, F x 3 faces) per layer."""
    data = open(path, "rb").read()
    (length,) = struct.unpack("<I", data[12:16])
    header = json.loads(data[20 : 20 + length])
    binary = data[28 + length :]

    def accessor(k):
        a = header["accessors"][k]
        view = header["bufferViews"][a["bufferView"]]
        kind, width = COMPONENTS[a["componentType"]], WIDTHS[a["type"]]
        start = view.get("byteOffset", 0) + a.get("byteOffset", 0)
        stride = view.get("byteStride", 0) or np.dtype(kind).itemsize * width
        raw = np.frombuffer(binary, np.uint8, count=stride * (a["count"] - 1) + np.dtype(kind).itemsize * width, offset=start)
        rows = np.lib.stride_tricks.as_strided(raw, (a["count"], np.dtype(kind).itemsize * width), (stride, 1))
        return np.ascontiguousarray(rows).view(kind).reshape(a["count"], width)

    found = []
    for node in header["nodes"]:
        if "mesh" not in node:
            continue
        mesh = header["meshes"][node["mesh"]]
        points, faces, first = [], [], 0
        for part in mesh["primitives"]:
            positions = accessor(part["attributes"]["POSITION"])
            points.append(positions)
            faces.append(accessor(part["indices"]).reshape(-1, 3).astype(np.int64) + first)
            first += len(positions)
        points, faces = np.vstack(points).astype(np.float64), np.vstack(faces)
        # Vertices doubled along texture seams are one vertex of the surface.
        points, inverse = np.unique(points, axis=0, return_inverse=True)
        faces = inverse.reshape(-1)[faces]
        sound = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
        found.append((node.get("name", "?"), points, faces[sound].astype(np.int32)))
    return found


def crossings(points, faces, which=None):
    """Number of (edge, triangle) that intersect; `which` restricts to an edge of one mesh and a triangle of the other."""
    edges = ipctk.edges(faces)
    mesh = ipctk.CollisionMesh(points, edges, faces)
    if not ipctk.has_intersections(mesh, points):
        return 0, []
    candidates = ipctk.Candidates()
    candidates.build(mesh, points, 0.0)
    volume = lambda a, b, c, d: np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
    pairs = np.array([(c.edge_id, c.face_id) for c in candidates.ef_candidates]) if getattr(candidates, "ef_candidates", None) else None
    if pairs is None or len(pairs) == 0:
        tree = ipctk.HashGrid() if hasattr(ipctk, "HashGrid") else None
        tree.build(points, edges, faces, 0.0)
        pairs = np.array([(c.edge_id, c.face_id) for c in tree.detect_edge_face_candidates()])
    e, f = edges[pairs[:, 0]], faces[pairs[:, 1]]
    shared = (e[:, :, None] == f[:, None, :]).any((1, 2))
    e, f = e[~shared], f[~shared]
    p, q = points[e[:, 0]], points[e[:, 1]]
    a, b, c = (points[f[:, k]] for k in range(3))
    above, below = volume(a, b, c, p) > 0, volume(a, b, c, q) > 0
    s = [volume(p, q, a, b) > 0, volume(p, q, b, c) > 0, volume(p, q, c, a) > 0]
    hit = (above != below) & (s[0] == s[1]) & (s[1] == s[2])
    where = points[e[hit][:, 0]]
    return max(int(hit.sum()), 1), where


def main():
    bad = 0
    for path in sys.argv[1:]:
        layers = layers_of(path)
        for i, (name, points, faces) in enumerate(layers):
            count, where = crossings(points, faces)
            bad += count
            print(f"{path}: {name} with itself: {count} crossing", *[np.round(w, 2) for w in where[:2]])
            for other, q, g in layers[i + 1 :]:
                both = np.vstack([points, q]), np.vstack([faces, g + len(points)]).astype(np.int32)
                own, _ = crossings(q, g)
                total, where = crossings(*both)
                count2 = max(total - count - own, 0)
                bad += count2
                print(f"{path}: {name} with {other}: {count2} crossing")
    print("certified" if bad == 0 else f"not certified: {bad} crossings")
    sys.exit(1 if bad else 0)


main()
