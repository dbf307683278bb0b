# Lists what Godot has imported of figure.glb; `just check-godot`.
extends SceneTree

func list(node):
	if node is Skeleton:
		print("skeleton: ", node.get_bone_count(), " bones")
	if node is MeshInstance:
		var count = 0
		for s in range(node.mesh.get_surface_count()):
			count += node.mesh.surface_get_array_len(s)
		var material = node.mesh.surface_get_material(0)
		print("mesh ", node.name, ": ", count, " vertices, skin ", node.skin != null, ", texture ", material != null and material.albedo_texture != null)
	if node is AnimationPlayer:
		for name in node.get_animation_list():
			print("animation ", name, ": ", node.get_animation(name).length, " s")
	for child in node.get_children():
		list(child)

func _init():
	var scene = load("res://figure.glb")
	if scene == null:
		print("not imported")
	else:
		list(scene.instance())
	quit()
