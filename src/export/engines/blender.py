"""Imports the .glb beside this file, and gives every garment that moves a pin group and a cloth modifier.

usage: blender --python FILE [-- --fbx OUT.fbx]
"""
import json
import os
import sys
import tempfile

import bpy
from mathutils import kdtree

STEM = "@STEM@"
HERE = os.path.dirname(os.path.abspath(__file__))
# Distance in metres at which a vertex of the import is a vertex of the file.
SAME_PLACE = 1e-4


def imported():
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=os.path.join(HERE, STEM + ".glb"))
    return [thing for thing in bpy.data.objects if thing not in before]


def mesh_named(objects, name):
    for thing in objects:
        if thing.type == "MESH" and (thing.name == name or thing.name.startswith(name + ".")):
            return thing
    return None


def pin(thing, layer):
    """A vertex group with 1 where cloth follows the skeleton, and less the further it may move."""
    tree = kdtree.KDTree(len(layer["position"]))
    for index, (x, y, z) in enumerate(layer["position"]):
        tree.insert((x, -z, y), index)
    tree.balance()
    reach = layer["maxDistance"]
    most = max(reach) or 1.0
    group = thing.vertex_groups.new(name="pin")
    missed = 0
    for vertex in thing.data.vertices:
        place, index, distance = tree.find(thing.matrix_world @ vertex.co)
        if distance > SAME_PLACE:
            missed += 1
        group.add([vertex.index], 1.0 - reach[index] / most, "REPLACE")
    return missed


def cloth(thing, fabric):
    modifier = thing.modifiers.new("cloth", "CLOTH")
    settings = modifier.settings
    settings.vertex_group_mass = "pin"
    settings.pin_stiffness = 1.0
    if fabric:
        area = sum(face.area for face in thing.data.polygons)
        settings.mass = max(fabric["density"] * area / max(len(thing.data.vertices), 1), 1e-6)
        # Blender's stiffness has no unit; its presets go from 5 (silk) to 80 (leather).
        stiffness = min(max(fabric["stretch"][0] / 50.0, 5.0), 80.0)
        settings.tension_stiffness = settings.compression_stiffness = settings.shear_stiffness = stiffness
        settings.bending_stiffness = min(max(fabric["bending"] / 40e-6, 0.05), 10.0)
        modifier.collision_settings.distance_min = max(fabric["thickness"], 0.001)
        modifier.collision_settings.friction = 10.0 * fabric["friction"]
    return modifier


def exported(objects, target):
    """Writes an FBX of what was imported, with its pictures: those of a .glb have no files of their own."""
    with tempfile.TemporaryDirectory() as folder:
        for image in bpy.data.images:
            if image.packed_file and image.size[0] > 0:
                image.filepath_raw = os.path.join(folder, image.name + ".png")
                image.file_format = "PNG"
                image.save()
        bpy.ops.object.select_all(action="DESELECT")
        for thing in objects:
            thing.select_set(True)
        bpy.ops.export_scene.fbx(
            filepath=target, use_selection=True, add_leaf_bones=False, bake_anim=True, path_mode="COPY", embed_textures=True
        )


def main():
    with open(os.path.join(HERE, STEM + ".cloth.json"), encoding="utf-8") as file:
        layers = json.load(file)["layers"]
    objects = imported()
    # Before the modifiers, which would be computed for every frame and are not in an FBX.
    words = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    if "--fbx" in words:
        target = words[words.index("--fbx") + 1]
        exported(objects, target)
        print(f"wrote {target}")
    names = {layer["name"] for layer in layers}
    for layer in layers:
        thing = mesh_named(objects, layer["name"])
        if thing is None:
            print(f"{layer['name']}: not in the import")
            continue
        missed = pin(thing, layer)
        cloth(thing, layer["fabric"])
        print(f"{layer['name']}: {len(thing.data.vertices)} vertices, {missed} of them not in the file")
    for thing in objects:
        if thing.type == "MESH" and thing.name not in names:
            thing.modifiers.new("collision", "COLLISION")


main()
