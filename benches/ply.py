"""The binary PLY files that Overcoat writes."""
import numpy as np

KINDS = {"float": "<f4", "double": "<f8", "uchar": "u1"}


def read_ply(path):
    """Vertices, their colours or None, and triangles of a file whose faces have no values of their own."""
    with open(path, "rb") as file:
        header = b""
        while not header.endswith(b"end_header\n"):
            header += file.readline()
        lines = header.decode().splitlines()
        vertex_count, face_count = (int(line.split()[2]) for line in lines if line.startswith("element"))
        fields = [line.split()[1:] for line in lines if line.startswith("property") and "list" not in line]
        vertices = np.fromfile(file, [(name, KINDS[kind]) for kind, name in fields], vertex_count)
        faces = np.fromfile(file, [("count", "u1"), ("corners", "<i4", 3)], face_count)["corners"]
    columns = lambda names: np.stack([vertices[name] for name in names], 1)
    colors = columns(["red", "green", "blue"]) if "red" in vertices.dtype.names else None
    return columns("xyz").astype(float), colors, faces
