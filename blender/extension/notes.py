# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render does not cover, each thing once."""


class Notes:
    """A list of things, each with the first few names of what has it."""

    def __init__(self):
        self.found = {}

    def add(self, what, name):
        """Note that `name` has something that is not covered."""
        names = self.found.setdefault(what, [])
        if name not in names:
            names.append(name)

    def text(self):
        """One sentence, empty without notes."""
        if not self.found:
            return ""
        return "Not covered: " + "; ".join(f"{what} ({listed(names)})" for what, names in self.found.items()) + "."


def listed(names):
    """The first three names, and how many there are besides."""
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(names[:3]) + more
