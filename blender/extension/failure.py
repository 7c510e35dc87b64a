# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""What cannot be done, as a sentence for Blender's report."""


class Unsupported(Exception):
    """A sentence that says what is in the way and what to do."""
