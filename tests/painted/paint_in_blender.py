"""Paints a mask in Blender 3.4: blender -b --factory-startup -P paint_in_blender.py -- TEMPLATE.ply OUT.ply

What a person does by hand: import the PLY, paint its vertex colours, export it with colours."""
import sys

import bpy
from mathutils import Vector

template, out = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_mesh.ply(filepath=template)
scan = bpy.context.object
colors = scan.data.vertex_colors.active
# In the file's millimetres, Z up.
for center, color in [((100, 0, 100), (0.9, 0.05, 0.02, 1)), ((-100, 0, 300), (0.6, 0.6, 0.6, 1))]:
    for loop in scan.data.loops:
        if (scan.data.vertices[loop.vertex_index].co - Vector(center)).length < 80:
            colors.data[loop.index].color = color
bpy.ops.export_mesh.ply(filepath=out, use_ascii=False, use_colors=True)
