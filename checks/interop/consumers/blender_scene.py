"""Inside Blender: runs a rig's script twice, renders the sphere by Cycles, prints what the lights are.

python blender_scene.py RIG OUT.npy FRONT|BACK SIZE SAMPLES [paste]
"""

import code
import json
import pathlib
import runpy
import sys

import bpy
import numpy as np


def white():
    material = bpy.data.materials.new("white")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    material.node_tree.links.new(diffuse.outputs[0], output.inputs[0])
    return material


def paste(path):
    """As Blender's console: a line at a time."""
    console = code.InteractiveConsole()
    errors = []
    console.write = errors.append
    for line in path.read_text().splitlines():
        console.push(line)
    if errors:
        raise SystemExit("".join(errors))


def main():
    rig, out, view, size, samples, *how = sys.argv[1:]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, radius=1)
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    ball.data.materials.append(white())

    # The second run replaces what the first one made.
    for _ in range(2):
        if how == ["paste"]:
            paste(pathlib.Path(rig))
        else:
            runpy.run_path(rig, run_name="__main__")
    counts = {
        "suns": len(bpy.data.lights),
        "collections": len(bpy.data.collections),
        "worlds": len(bpy.data.worlds),
        "pictures": len(bpy.data.images),
    }

    side = 1 if view == "front" else -1
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale = "ORTHO", 2
    eye = bpy.data.objects.new("camera", camera)
    eye.location = (0, -5 * side, 0)
    eye.rotation_euler = (np.pi / 2, 0, 0 if side == 1 else np.pi)
    scene.collection.objects.link(eye)
    scene.camera = eye
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.seed = "CPU", int(samples), 1
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.max_bounces, scene.cycles.pixel_filter_type = 0, "BOX"
    scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0
    scene.render.film_transparent = True
    scene.render.filter_size = 1
    scene.render.resolution_x = scene.render.resolution_y = int(size)
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(pathlib.Path(out).with_suffix(".exr"))
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(image.pixels[:]).reshape(int(size), int(size), 4)[::-1, :, :3]
    np.save(out, pixels)

    suns = [o for o in bpy.data.objects if o.type == "LIGHT"]
    lights = {
        o.name: {
            "toward": list(o.matrix_world.to_3x3().col[2]),
            "facing": [o.data.energy * c for c in o.data.color],
            "angle": o.data.angle,
        }
        for o in suns
    }
    pathlib.Path(out).with_suffix(".json").write_text(json.dumps({"version": bpy.app.version_string, "lights": lights, "counts": counts}))


main()
