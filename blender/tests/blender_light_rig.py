# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""The light rig inside Blender, beside Cycles."""

import math

import numpy as np
import pytest
import session

TURNED = (0.4, -0.7, 2.1)


@pytest.mark.parametrize("vector_type", ["POINT", "TEXTURE"])
def test_a_white_ball_looks_the_same_under_the_rig(blender, tmp_path, vector_type):
    session.world(session.studio(128), TURNED, 1.7, vector_type)
    session.white_ball()
    before = session.render(tmp_path)
    assert blender.ops.domelight.add_rig() == {"FINISHED"}
    after = session.render(tmp_path)
    inside = before[..., 3] == 1.0
    for channel in range(3):
        a, b = before[inside][:, channel], after[inside][:, channel]
        assert abs(b.mean() / a.mean() - 1) < 0.01
    # Blocks of pixels, whose noise is below a percent.
    blocks = [p[8:40, 8:40, :3].reshape(8, 4, 8, 4, 3).mean((1, 3)) for p in (before, after)]
    assert np.sqrt(((blocks[0] - blocks[1]) ** 2).mean()) < 0.01 * blocks[0].mean()


def test_the_sun_follows_the_worlds_rotation_and_strength(blender, tmp_path):
    world = session.world(session.studio(128))
    session.white_ball()
    {n.type: n for n in world.node_tree.nodes}["MAPPING"].name = 'turned "so"'
    assert blender.ops.domelight.add_rig() == {"FINISHED"}
    nodes = {node.type: node for node in world.node_tree.nodes}
    nodes["MAPPING"].inputs["Rotation"].default_value = TURNED
    nodes["BACKGROUND"].inputs["Strength"].default_value = 0.6
    turned = session.render(tmp_path)
    assert blender.ops.domelight.remove_rig() == {"FINISHED"}
    expected = session.render(tmp_path)
    inside = expected[..., 3] == 1.0
    assert abs(turned[inside].mean(0) / expected[inside].mean(0) - 1).max() < 0.01


def test_the_lights_are_those_of_the_map(blender):
    session.world(session.studio(128))
    assert blender.ops.domelight.add_rig() == {"FINISHED"}
    blender.context.view_layer.update()
    rig = session.extension("light_rig")
    sun, lamp = rig.lights_of(blender.context.scene.world)
    # (0.5, 0.6, 0.7) of a map whose middle is at +Y; Blender shows the middle at +X.
    toward = np.array(sun.matrix_world.to_3x3().col[2])
    expected = np.array([0.6, -0.5, 0.7]) / np.linalg.norm([0.6, -0.5, 0.7])
    assert math.degrees(math.acos(min(1.0, toward @ expected))) < 0.3
    assert abs(math.degrees(sun.data.angle) - 8.0) < 0.3
    assert abs(math.degrees(lamp.data.angle) - 18.0) < 0.3
    radiance = np.array([90.0, 80.0, 60.0]) + np.array([0.3, 0.4, 0.6]) * (1 + 0.5 * expected[2])
    facing = np.pi * math.sin(math.radians(4.0)) ** 2 * radiance
    assert np.allclose(np.array(sun.data.color) * sun.data.energy, facing, rtol=0.03)
    assert 0 < sun.data.domelight.share < 1 and 0 < lamp.data.domelight.share < sun.data.domelight.share


def test_adding_and_removing_twice_leaves_the_file_as_it_was(blender):
    session.world(session.studio(), TURNED)
    session.white_ball()
    before = session.contents()
    for _ in range(2):
        assert blender.ops.domelight.add_rig() == {"FINISHED"}
        assert session.contents() != before
        assert blender.ops.domelight.remove_rig() == {"FINISHED"}
        after = session.contents()
        different = {
            k: (before.get(k), after.get(k)) for k in before.keys() | after.keys() if before.get(k) != after.get(k)
        }
        assert not different


def test_a_rig_survives_saving_and_can_be_removed_then(blender, tmp_path):
    session.world(session.studio(), TURNED)
    assert blender.ops.domelight.add_rig() == {"FINISHED"}
    residual = blender.context.scene.world.domelight.residual
    expected = np.array(residual.pixels[:])
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "rig.blend"))
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "rig.blend"))
    world = blender.context.scene.world
    assert np.array_equal(np.array(world.domelight.residual.pixels[:]), expected)
    next(n for n in world.node_tree.nodes if n.type == "MAPPING").inputs["Rotation"].default_value = (0.1, 0.2, 0.3)
    blender.context.view_layer.update()
    assert np.allclose(blender.data.objects["Light Rig"].rotation_euler, (-0.1, -0.2, -0.3))
    assert blender.ops.domelight.remove_rig() == {"FINISHED"}
    pictures = [node.image.name for node in world.node_tree.nodes if node.type == "TEX_ENVIRONMENT"]
    assert pictures == ["studio.exr"] and not blender.data.lights and not blender.data.collections


def test_adding_can_be_undone(blender):
    session.world(session.studio())
    blender.ops.ed.undo_push(message="before")
    assert blender.ops.domelight.add_rig() == {"FINISHED"}
    blender.ops.ed.undo_push(message="rig")
    assert len(blender.data.lights)
    blender.ops.ed.undo()
    world = blender.context.scene.world
    assert not blender.data.lights and world.domelight.original is None
    assert [n.image.name for n in world.node_tree.nodes if n.type == "TEX_ENVIRONMENT"] == ["studio.exr"]


def test_what_the_user_put_beside_the_lights_stays(blender):
    session.world(session.studio())
    blender.ops.domelight.add_rig()
    mine = blender.data.objects.new("mine", None)
    blender.context.scene.world.domelight.collection.objects.link(mine)
    assert blender.ops.domelight.remove_rig() == {"FINISHED"}
    assert [o.name for o in blender.context.scene.collection.objects] == ["mine"]


def unlink_picture(world):
    nodes = {node.type: node for node in world.node_tree.nodes}
    nodes["BACKGROUND"].inputs["Color"].links and world.node_tree.links.remove(
        nodes["BACKGROUND"].inputs["Color"].links[0]
    )


def scale(world):
    {node.type: node for node in world.node_tree.nodes}["MAPPING"].inputs["Scale"].default_value = (1, 1, -1)


def gamma(world):
    tree = world.node_tree
    nodes = {node.type: node for node in tree.nodes}
    between = tree.nodes.new("ShaderNodeGamma")
    tree.links.new(nodes["TEX_ENVIRONMENT"].outputs[0], between.inputs[0])
    tree.links.new(between.outputs[0], nodes["BACKGROUND"].inputs["Color"])


def even(world):
    {n.type: n for n in world.node_tree.nodes}["TEX_ENVIRONMENT"].image = session.image("even", np.ones((8, 16, 3)))


def nan(world):
    texels = session.studio(8)
    texels[3, 4] = np.nan
    {n.type: n for n in world.node_tree.nodes}["TEX_ENVIRONMENT"].image = session.image("broken", texels)


def lost(world):
    {n.type: n for n in world.node_tree.nodes}["TEX_ENVIRONMENT"].image.source = "MOVIE"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (unlink_picture, "has no HDRI"),
        (scale, "moves or scales"),
        (gamma, "“Gamma” is not supported"),
        (even, "sun"),
        (nan, "broken"),
        (lost, "still picture"),
    ],
)
def test_what_is_not_supported_is_said_and_nothing_changes(blender, change, words):
    world = session.world(session.studio(), TURNED)
    change(world)
    before = session.contents()
    with pytest.raises(RuntimeError, match=words):
        blender.ops.domelight.add_rig()
    assert session.contents() == before


def test_without_a_world_the_buttons_are_off(blender):
    assert not blender.ops.domelight.add_rig.poll() and not blender.ops.domelight.remove_rig.poll()


def traces(bpy):
    """What an extension may leave in Blender."""
    kinds = {name for name in dir(bpy.types) if "domelight" in name.lower()}
    properties = {
        f"{name}.{p.identifier}"
        for name in dir(bpy.types)
        for p in getattr(getattr(bpy.types, name), "bl_rna", bpy.types.Struct.bl_rna).properties
        if "domelight" in p.identifier
    }
    handlers = {
        f"{name}: {handler}" for name in dir(bpy.app.handlers) for handler in listed(getattr(bpy.app.handlers, name))
    }
    return kinds | properties | {h for h in handlers if "domelight" in h} | set(dir(bpy.ops.domelight))


def listed(value):
    return value if isinstance(value, list) else []


def test_disabling_leaves_no_trace(blender):
    assert traces(blender)
    for _ in range(2):
        session.disable()
        assert not traces(blender)
        session.enable()
