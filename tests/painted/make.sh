#!/bin/sh
# Makes the fixtures anew, with Blender 3.4.1 and MeshLab 2020.09 themselves: Debian 12's packages `blender`, `meshlab` (whose
# `meshlabserver` runs without a window, but wants OpenGL), `xvfb` and `libgl1-mesa-dri`.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
template=$(mktemp -d)/template.ply
cd "$here/../.."
PAINTED_TEMPLATE=$template cargo test --release --no-default-features --test painted_masks write_the_template -- --ignored
blender -b --factory-startup -P "$here/paint_in_blender.py" -- "$template" "$here/blender.ply"
xvfb-run -a meshlabserver -i "$template" -o "$here/meshlab.ply" -m vc vq -s "$here/paint_in_meshlab.mlx"
