# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""domelight in Blender: a light rig from the world's HDRI, and a render engine."""

from . import engine, light_rig, light_rig_ui

MODULES = (light_rig, light_rig_ui, engine)


def register():
    for module in MODULES:
        module.register()


def unregister():
    for module in reversed(MODULES):
        module.unregister()
