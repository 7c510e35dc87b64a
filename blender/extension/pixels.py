# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of Blender's images as linear arrays with the top row first."""

import numpy as np

from .failure import Unsupported

# Color spaces of pictures with 8 bits whose numbers are light.
LINEAR_SPACES = ("Non-Color", "Linear Rec.709", "Raw")


def srgb_to_linear(values):
    """Invert the sRGB curve."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4).astype(np.float32)


def linear_to_srgb(values):
    """Apply the sRGB curve to values in [0, 1]."""
    return np.where(values <= 0.0031308, values * 12.92, 1.055 * values ** (1 / 2.4) - 0.055).astype(np.float32)


def raw(image):
    """The pixels as Blender stores them, (height, width, channels).

    Raises Unsupported if there are none.
    """
    if image.source not in {"FILE", "GENERATED"}:
        raise Unsupported(f"The image {image.name} is a {image.source.lower()}; use a still picture.")
    # Blender reads the file when it is asked for its size.
    width, height = image.size
    if width * height == 0 or not image.has_data and not len(image.pixels):
        raise Unsupported(f"The image {image.name} cannot be read; its file is {image.filepath or 'missing'}.")
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, image.channels)[::-1]


def is_srgb(image):
    """Whether the stored numbers are sRGB. Pictures in floating point are linear in memory whatever their file is."""
    if image.is_float:
        return False
    space = image.colorspace_settings.name
    if space == "sRGB":
        return True
    if space in LINEAR_SPACES:
        return False
    raise Unsupported(f"The image {image.name} has the color space {space}; use sRGB, Linear Rec.709 or Non-Color.")


def linear_rgb(image):
    """Linear red, green and blue, (height, width, 3)."""
    pixels = raw(image)
    rgb = pixels[..., :3] if pixels.shape[2] >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    return np.ascontiguousarray(srgb_to_linear(rgb) if is_srgb(image) else rgb)
