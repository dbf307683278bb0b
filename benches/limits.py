"""Time and peak memory of commands on inputs far beyond the usual ones, as a table.

usage: limits.py OVERCOAT DEMO_SCANS FOLDER [CASE ...]      (pip install numpy; 3 GB in FOLDER, a quarter of an hour)
Cases: triangles (a scan of 20 million), frames (a recording of 1000), layers (a session of 8), cloth (300 frames of a walk).
"""
import os
import subprocess
import sys
import time

import numpy as np

from ply import read_ply

TRIANGLES = 20_000_000
FRAMES = 1000
LAYERS = "leggings,tanktop,shirt,trousers,vest,pullover,jacket,scarf"
CLOTH = 300


def run(what, *command, cwd=None):
    """Runs a command and prints its row."""
    began = time.time()
    process = subprocess.Popen(command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    said = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    code = os.waitstatus_to_exitcode(status)
    cpu = usage.ru_utime + usage.ru_stime
    print(f"| {what} | {time.time() - began:.0f} s | {cpu:.0f} s | {usage.ru_maxrss / 1024:.0f} MB | {code} |", flush=True)
    if code != 0:
        print(said.strip().splitlines()[-1] if said.strip() else "", flush=True)
    return code == 0


def divided(points, colors, faces):
    """Each triangle in four; edges are divided once."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), 1).astype(np.int64)
    keys, inverse = np.unique(edges[:, 0] << 32 | edges[:, 1], return_inverse=True)
    ends = np.stack([keys >> 32, keys & 0xFFFFFFFF], 1)
    middle = points[ends].mean(1)
    tint = colors[ends].astype(np.uint16).mean(1).astype(np.uint8)
    a, b, c = faces.T
    ab, bc, ca = (len(points) + inverse.reshape(3, -1)).astype(np.int32)
    four = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.concatenate([points, middle]), np.concatenate([colors, tint]), np.concatenate([np.stack(f, 1) for f in four])


def triangles(overcoat, _scans, folder):
    person = os.path.join(folder, "bare")
    command = [overcoat, "studio", "make", "--seed", "4400", "--garments", "tshirt", "--no-frames", "--faces", "80000", "--out", person]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    mesh = read_ply(os.path.join(person, "0-body.ply"))
    while len(mesh[2]) < TRIANGLES:
        mesh = divided(*mesh)
    points, colors, faces = mesh
    path = os.path.join(folder, "large.ply")
    vertices = np.zeros(len(points), [("p", "<f4", 3), ("c", "u1", 3)])
    vertices["p"], vertices["c"] = points, colors
    rows = np.zeros(len(faces), [("n", "u1"), ("v", "<i4", 3)])
    rows["n"], rows["v"] = 3, faces
    with open(path, "wb") as file:
        properties = "".join(f"property {kind}\n" for kind in
                             ("float x", "float y", "float z", "uchar red", "uchar green", "uchar blue"))
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{properties}"
                   f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n".encode())
        vertices.tofile(file)
        rows.tofile(file)
    session = os.path.join(folder, "large")
    subprocess.run([overcoat, "new", session], check=True, stdout=subprocess.DEVNULL)
    size = os.path.getsize(path) / 1e6
    run(f"`scan` of {len(faces) / 1e6:.0f} million triangles, {size:.0f} MB", overcoat, "-C", session, "scan", "body", path)
    os.remove(path)


def frames(overcoat, scans, folder):
    """The demo's recording over and over; links take no space."""
    source, target = os.path.join(scans, "0-body"), os.path.join(folder, "recording")
    with open(os.path.join(source, "associations.txt"), encoding="utf-8") as file:
        rows = [line.split() for line in file if line.strip() and not line.startswith("#")]
    for part in ("rgb", "depth"):
        os.makedirs(os.path.join(target, part))
    os.symlink(os.path.abspath(os.path.join(source, "camera.json")), os.path.join(target, "camera.json"))
    with open(os.path.join(target, "associations.txt"), "w", encoding="utf-8") as file:
        for k in range(FRAMES):
            row = rows[k % len(rows)]
            names = []
            for name in (row[1], row[3]):
                new = os.path.join(os.path.dirname(name), f"{k:05}{os.path.splitext(name)[1]}")
                os.symlink(os.path.abspath(os.path.join(source, name)), os.path.join(target, new))
                names.append(new)
            file.write(f"{k / 30:.6f} {names[0]} {k / 30:.6f} {names[1]}\n")
    session = os.path.join(folder, "frames")
    subprocess.run([overcoat, "new", session], check=True, stdout=subprocess.DEVNULL)
    run(f"`scan` of {FRAMES} frames", overcoat, "-C", session, "scan", "body", target)


def layers(overcoat, _scans, folder):
    person, session = os.path.join(folder, "person"), os.path.join(folder, "layers")
    command = [overcoat, "studio", "make", "--seed", "4400", "--garments", LAYERS, "--no-frames", "--out", person]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    subprocess.run([overcoat, "new", session], check=True, stdout=subprocess.DEVNULL)
    for file in sorted(name for name in os.listdir(person) if name.endswith(".ply")):
        name = file.split("-", 1)[1][:-4]
        kind = [] if name == "body" else ["--template", name]
        scan = [overcoat, "-C", session, "scan", name, os.path.join(person, file), *kind]
        subprocess.run(scan, check=True, stdout=subprocess.DEVNULL)
    count = len(LAYERS.split(","))
    if run(f"`build` of a body and {count} garments", overcoat, "-C", session, "build"):
        run("`export character.glb` of it", overcoat, "-C", session, "export", os.path.join(folder, "layers.glb"))


def cloth(overcoat, scans, folder):
    demo = os.path.join(folder, "demo")
    subprocess.run([overcoat, "demo", "--keep", demo], check=True, stdout=subprocess.DEVNULL, cwd=os.path.join(scans, "../.."))
    command = [overcoat, "-C", os.path.join(demo, "session"), "animate", "walk", "--frames", f"0..{CLOTH}"]
    run(f"`animate walk`, {CLOTH} frames, 4 layers", *command)


def main():
    overcoat, scans, folder = (os.path.abspath(path) for path in sys.argv[1:4])
    os.makedirs(folder, exist_ok=True)
    cases = sys.argv[4:] or ["triangles", "frames", "layers", "cloth"]
    print("| command | time | processor time | peak memory | exit code |\n|---|---|---|---|---|", flush=True)
    for case in cases:
        {"triangles": triangles, "frames": frames, "layers": layers, "cloth": cloth}[case](overcoat, scans, folder)


main()
