"""Renders a run's body.glb at several moments of its motion, as Marey's chronophotographs show people.

The background is left transparent.

blender --background --factory-startup --python scripts/render-in-blender.py -- body.glb OUT.png
"""
import math
import sys

import bpy
import numpy
from mathutils import Vector

# Debian 12 has a Blender whose glTF import uses a name that its numpy no longer has.
numpy.bool = bool
glb, out = sys.argv[sys.argv.index("--") + 1 :][:2]
MOMENTS = 5
SIZE = (1000, 440)
# From the first moment to the last, linear RGB.
FIRST, LAST = (0.78, 0.60, 0.40), (0.02, 0.15, 0.22)

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=glb)
scene = bpy.context.scene
body = max((o for o in scene.objects if o.type == "MESH"), key=lambda o: len(o.data.vertices))
first, last = next(iter(bpy.data.actions)).frame_range


def material(name, colour, roughness):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = roughness
    return made


places = []
for moment in range(MOMENTS):
    share = moment / (MOMENTS - 1)
    scene.frame_set(round(first + share * (last - first)))
    posed = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new_from_object(posed)
    mesh.transform(body.matrix_world)
    for polygon in mesh.polygons:
        polygon.use_smooth = True
    mesh.materials.clear()
    colour = [a + share * (b - a) for a, b in zip(FIRST, LAST)]
    mesh.materials.append(material(f"moment {moment}", colour, 0.5))
    scene.collection.objects.link(bpy.data.objects.new(f"moment {moment}", mesh))
    places.append(sum((v.co for v in mesh.vertices), Vector()) / len(mesh.vertices))
for thing in list(scene.objects):
    thing.hide_render = not thing.name.startswith("moment")

way = places[-1] - places[0]
way.z = 0
along, middle = way.normalized(), (places[0] + places[-1]) / 2
across = Vector((along.y, -along.x, 0))

# Of the floor only the shadows are seen.
bpy.ops.mesh.primitive_plane_add(size=60, location=(0, 0, 0))
bpy.context.object.is_shadow_catcher = True
scene.world = bpy.data.worlds.new("sky")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.9, 0.95, 1.0, 1)
scene.world.node_tree.nodes["Background"].inputs[1].default_value = 0.55

sun = bpy.data.lights.new("sun", "SUN")
sun.energy, sun.angle = 1.9, math.radians(6)
lamp = bpy.data.objects.new("sun", sun)
lamp.rotation_euler = (-(across * 0.8 - along * 0.5) - Vector((0, 0, 1.4))).to_track_quat("-Z", "Y").to_euler()
scene.collection.objects.link(lamp)

lens = bpy.data.cameras.new("camera")
lens.lens = 60
camera = bpy.data.objects.new("camera", lens)
width, height = way.length + 1.2, 2.05
target = Vector((middle.x, middle.y, 0.88))
sides = SIZE[0] / SIZE[1]
distance = max(width, height * sides) * lens.lens / lens.sensor_width
camera.location = target + across * distance + along * 0.25 * distance + Vector((0, 0, 0.5))
camera.rotation_euler = (target - camera.location).to_track_quat("-Z", "Y").to_euler()
scene.collection.objects.link(camera)
scene.camera = camera

scene.render.engine = "CYCLES"
scene.cycles.device, scene.cycles.samples, scene.cycles.seed = "CPU", 48, 0
scene.cycles.use_denoising = False
scene.view_settings.view_transform = "Standard"
scene.render.resolution_x, scene.render.resolution_y = SIZE
scene.render.film_transparent = True
scene.render.filepath = out
scene.render.image_settings.file_format = "PNG"
bpy.ops.render.render(write_still=True)
