# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine beside Cycles, which renders direct light alone."""

import numpy as np
import pytest
import session

SIZE = (96, 64)


def plane(bpy, z, color):
    """A matte floor."""
    bpy.ops.mesh.primitive_plane_add(size=12, location=(0, 0, z))
    bpy.context.object.data.materials.append(session.material("floor", color))


def eye(bpy, location, target, lens=50.0):
    """A perspective camera that looks at a point."""
    from mathutils import Vector

    data = bpy.data.cameras.new("camera")
    data.lens = lens
    made = session.add_object("camera", data, location)
    made.rotation_euler = (Vector(location) - Vector(target)).to_track_quat("Z", "Y").to_euler()
    bpy.context.scene.camera = made
    return data


def principled(bpy, name, **values):
    """A Principled material, with inputs by their names with underscores."""
    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        made.use_nodes = True
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    for key, value in values.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    return made, shader


def suzanne(bpy):
    """Suzanne, subdivided, metal, in shift."""
    session.world(session.studio(128), (0, 0, 1.0))
    bpy.ops.mesh.primitive_monkey_add(size=2, rotation=(-0.4, 0, 0.5))
    bpy.ops.object.shade_smooth()
    monkey = bpy.context.object
    monkey.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    made, _ = principled(bpy, "gold", Base_Color=(0.9, 0.6, 0.3, 1), Metallic=1.0, Roughness=0.4)
    monkey.data.materials.append(made)
    plane(bpy, -1, (0.6, 0.6, 0.6))
    camera = eye(bpy, (1, -7, 1.5), (0, 0, 0))
    camera.shift_x, camera.shift_y, camera.sensor_fit = 0.1, -0.06, "VERTICAL"


def textured(bpy):
    """A grid with a color picture, a mapping, and roughness in a channel of another."""
    session.world(session.studio(128))
    bpy.ops.mesh.primitive_grid_add(size=4, x_subdivisions=8, y_subdivisions=8, rotation=(0.3, 0.2, 0.4))
    made, shader = principled(bpy, "picture", Metallic=1.0)
    tree = made.node_tree
    picture, data = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeTexImage")
    mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    split = tree.nodes.new("ShaderNodeSeparateColor")
    v, u = np.mgrid[0:32, 0:32] / 31
    picture.image = session.image("colors", np.stack([0.2 + 0.7 * u, 0.2 + 0.6 * v, 0.5 + 0.4 * np.sin(9 * u * v)], -1))
    data.image = session.image("data", np.stack([u, 0.3 + 0.5 * v, u], -1))
    data.image.colorspace_settings.name = "Non-Color"
    mapping.inputs["Location"].default_value = (0.2, -0.1, 0)
    mapping.inputs["Rotation"].default_value = (0, 0, 0.5)
    mapping.inputs["Scale"].default_value = (1.6, 0.7, 1)
    link = tree.links.new
    link(coordinates.outputs["UV"], mapping.inputs["Vector"])
    link(mapping.outputs[0], picture.inputs["Vector"])
    link(mapping.outputs[0], data.inputs["Vector"])
    link(picture.outputs["Color"], shader.inputs["Base Color"])
    link(data.outputs["Color"], split.inputs[0])
    link(split.outputs["Green"], shader.inputs["Roughness"])
    bpy.context.object.data.materials.append(made)
    plane(bpy, -1.5, (0.3, 0.5, 0.7))
    eye(bpy, (0, -5, 5), (0, 0, 0))


def instances(bpy):
    """A collection instanced by empties, and an array of cones, mirrored."""
    session.world(session.studio(128))
    bpy.ops.mesh.primitive_torus_add(major_radius=0.6, minor_radius=0.25)
    torus = bpy.context.object
    torus.data.materials.append(session.material("red", (0.8, 0.2, 0.1)))
    group = bpy.data.collections.new("group")
    bpy.context.scene.collection.objects.unlink(torus)
    group.objects.link(torus)
    for i in range(5):
        empty = session.add_object(f"copy {i}", None, (1.7 * i - 3.4, 0.6 * i, 0.1 * i), (0.5 * i, 0.3, i))
        empty.instance_type, empty.instance_collection = "COLLECTION", group
        empty.scale = (1, 1 + 0.2 * i, -1 if i == 2 else 1)
    bpy.ops.mesh.primitive_cone_add(radius1=0.4, depth=1, location=(-3.4, -2, -0.4))
    bpy.context.object.data.materials.append(session.material("blue", (0.1, 0.3, 0.8)))
    array = bpy.context.object.modifiers.new("Array", "ARRAY")
    array.count, array.relative_offset_displace = 5, (2.1, 0, 0)
    plane(bpy, -1, (0.7, 0.7, 0.7))
    eye(bpy, (2, -9, 4), (0, 0, 0))


def blurred(bpy):
    """Balls in a row before a camera with a wide aperture."""
    session.world(session.studio(128), (0, 0, -0.5))
    for i in range(4):
        bpy.ops.mesh.primitive_uv_sphere_add(
            segments=64, ring_count=32, radius=0.5, location=(0.9 * i - 1.4, 1.6 * i - 2, -0.5)
        )
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(session.material(f"ball {i}", (0.8, 0.2 + 0.2 * i, 0.3)))
    plane(bpy, -1, (0.5, 0.5, 0.5))
    camera = eye(bpy, (0, -6, 1), (0, 0, -0.5), lens=35)
    camera.dof.use_dof, camera.dof.focus_distance, camera.dof.aperture_fstop = True, 5.0, 0.08


def turned(bpy):
    """A world that is turned about all axes, at half strength, seen beside a ball."""
    session.world(session.studio(128), (0.4, -0.7, 2.1), 0.5)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    bpy.context.object.data.materials.append(session.material("white"))
    plane(bpy, -1, (0.7, 0.6, 0.5))
    bpy.context.scene["opaque"] = True
    eye(bpy, (0, -6, 0.5), (0, 0, 0.2), lens=30)


def both(bpy, folder, samples):
    """Pictures by Cycles and by domelight."""
    scene = bpy.context.scene
    scene.domelight.samples, scene.domelight.filter = samples, "box"
    return [
        session.render(folder, engine, SIZE, samples, transparent="opaque" not in scene)
        for engine in ("CYCLES", "DOMELIGHT")
    ]


@pytest.mark.parametrize("make", [suzanne, textured, instances, blurred, turned])
def test_pictures_agree_with_cycles(blender, tmp_path, make):
    make(blender)
    expected, found = both(blender, tmp_path, 256)
    session.keep(make.__name__, expected, found)
    for channel in range(4):
        assert abs(found[..., channel].mean() / expected[..., channel].mean() - 1) < 0.01
    # Blocks of pixels, where the noise of Cycles is small.
    blocks = [p.reshape(SIZE[1] // 8, 8, SIZE[0] // 8, 8, 4).mean((1, 3)) for p in (expected, found)]
    assert np.sqrt(((blocks[0] - blocks[1]) ** 2).mean()) < 0.03 * blocks[0].mean()


def test_a_region_of_the_picture_is_that_part_of_it(blender, tmp_path):
    suzanne(blender)
    scene = blender.context.scene
    scene.domelight.samples, scene.domelight.filter = 64, "box"
    whole = session.render(tmp_path, "DOMELIGHT", SIZE)
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_max_x = 24.0 / 96, 80.0 / 96
    scene.render.border_min_y, scene.render.border_max_y = 16.0 / 64, 56.0 / 64
    scene.render.use_crop_to_border = True
    part = session.render(tmp_path, "DOMELIGHT", SIZE, cropped=(56, 40))
    expected = whole[8:48, 24:80]
    assert abs(part.mean((0, 1)) / expected.mean((0, 1)) - 1).max() < 0.01


def test_passes_hold_what_blender_means_by_them(blender):
    session.world(session.studio(64), (0.5, 0.2, 1.0))
    plane(blender, -1, (0.2, 0.4, 0.6))
    scene = blender.context.scene
    data = blender.data.cameras.new("camera")
    data.type, data.ortho_scale = "ORTHO", 20
    scene.camera = session.add_object("camera", data, (0, 0, 4))
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = True
    scene.domelight.use_pass_albedo = scene.domelight.use_pass_unoccluded = scene.domelight.use_pass_variance = True
    scene.domelight.samples = 4
    passes = session.passes("DOMELIGHT", (40, 40))
    inside, outside = (20, 20), (2, 2)
    assert np.allclose(passes["Depth"][inside], 5, atol=1e-4) and passes["Depth"][outside] > 1e9
    assert np.allclose(passes["Normal"][inside], (0, 0, 1), atol=1e-4)
    assert np.allclose(passes["Albedo"][inside], (0.2, 0.4, 0.6), atol=1e-3)
    assert np.allclose(passes["Unoccluded"][inside], passes["Combined"][inside][:3], rtol=1e-4)
    assert passes["Variance"][inside].min() >= 0 and passes["Combined"][outside][3] == 0


def test_the_rig_of_the_world_is_not_counted_twice(blender, tmp_path):
    turned(blender)
    blender.context.scene.domelight.samples = 64
    expected = session.render(tmp_path, "DOMELIGHT", SIZE)
    assert blender.ops.domelight.add_rig() == {"FINISHED"}
    assert np.array_equal(session.render(tmp_path, "DOMELIGHT", SIZE), expected)


def test_what_is_not_covered_is_named_once(blender, tmp_path, capfd):
    suzanne(blender)
    made, shader = principled(blender, "odd", Subsurface_Weight=0.5, Sheen_Weight=0.3)
    noise = made.node_tree.nodes.new("ShaderNodeTexNoise")
    made.node_tree.links.new(noise.outputs[0], shader.inputs["Roughness"])
    for x in (0, 1, 2, 3):
        blender.ops.mesh.primitive_cube_add(location=(x, 0, 0))
        blender.context.object.data.materials.append(made)
    lamp = blender.data.lights.new("lamp", "POINT")
    session.add_object("lamp", lamp)
    blender.context.scene.domelight.samples = 1
    session.render(tmp_path, "DOMELIGHT", SIZE)
    said = capfd.readouterr().out
    for words in ("lights (lamp)", "Subsurface Weight (odd)", "“Noise Texture” (odd)", "sheen (odd)"):
        assert said.count(words) == 1


def panorama(bpy):
    bpy.context.scene.camera.data.type = "PANO"


def sky(bpy):
    tree = bpy.context.scene.world.node_tree
    nodes = {node.type: node for node in tree.nodes}
    tree.links.new(tree.nodes.new("ShaderNodeTexSky").outputs[0], nodes["BACKGROUND"].inputs["Color"])


@pytest.mark.parametrize(("change", "words"), [(panorama, "panoramic"), (sky, "Sky Texture")])
def test_what_cannot_be_rendered_is_said(blender, tmp_path, change, words):
    turned(blender)
    change(blender)
    with pytest.raises(RuntimeError, match=words):
        session.render(tmp_path, "DOMELIGHT", SIZE)


def test_a_world_of_one_color_and_a_scene_without_surfaces(blender, tmp_path):
    turned(blender)
    for thing in [o for o in blender.data.objects if o.type == "MESH"]:
        blender.data.objects.remove(thing)
    world = blender.context.scene.world
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    world.node_tree.links.remove(background.inputs["Color"].links[0])
    background.inputs["Color"].default_value = (0.2, 0.3, 0.4, 1)
    picture = session.render(tmp_path, "DOMELIGHT", SIZE, transparent=False)
    assert np.allclose(picture, (0.1, 0.15, 0.2, 1), rtol=1e-5)


def test_a_render_can_be_ended(blender, tmp_path, monkeypatch):
    turned(blender)
    blender.context.scene.domelight.samples = 1 << 16
    monkeypatch.setattr(session.extension("engine"), "is_canceled", lambda engine: True)
    session.render(tmp_path, "DOMELIGHT", SIZE)
