# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the extension's modules without Blender, and of the installed extension inside Blender."""

import importlib.util
import sys
import types
from pathlib import Path

import pytest

EXTENSION = Path(__file__).resolve().parent.parent / "extension"

# Modules without Blender, under the name `extension`; the package's own file imports Blender.
package = types.ModuleType("extension")
package.__path__ = [str(EXTENSION)]
sys.modules["extension"] = package

collect_ignore_glob = [] if importlib.util.find_spec("bpy") else ["blender_*.py"]


@pytest.fixture
def blender():
    """An empty file with the extension enabled."""
    import bpy
    import session

    session.start()
    return bpy
