#!/usr/bin/python3
"""Depth of field at half resolution as in engines, a baseline for docs/quality.md: scatter as gather after
J. Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare", SIGGRAPH 2014.

    tools/research/scatter_gather.py SHARP.exr --camera camera.json --frame N -o OUT.exr

OUT has the channels of SHARP, the color filtered.

    color, CoC at half resolution (Karis average)      tiles: largest CoC, closest depth, dilated 3x3
    prefilter, 9 taps, radius by own CoC
    gather, 49 taps in three rings over the tile's largest CoC: background and foreground of the tile
    composite at full resolution: sharp -> background by own CoC -> foreground by its alpha

The talk gives its constants in an engine's units. Those here are the best on the tuning scenes. The talk's
median of 3x3 before the composite is left out: without it the error is lower.
"""
import argparse
import dataclasses
import math

import numpy as np

import frame as frames

RINGS = 3
SINGLE_PIXEL_RADIUS = 0.7071  # pixels of half resolution


@dataclasses.dataclass
class Constants:
    tile: int = 8  # pixels of half resolution
    depth_scale: float = 0.03  # share of the closest depth; surfaces farther behind it are background
    karis: float = 0.5  # weight 1/(1 + karis luma) of the four pixels of one of half resolution
    prefilter: float = 0.3  # radius, in spacings of rings
    alpha_gain: float = 0.7  # factor on the foreground's alpha
    sharp_px: float = 0.5  # radius of full resolution up to which a pixel stays sharp
    blurred_px: float = 3  # from here on it is of half resolution
    outer_ring: float = 0.89  # its radius, of that of the CoC: each tap stands for its surroundings


def luma(color):
    return color @ np.array([0.2126, 0.7152, 0.0722], np.float32)


def smoothstep(low, high, x):
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def blocks(plane):
    """2x2 blocks: half height x half width x 4 [x channels]; odd sizes repeat the last row or column."""
    height, width = plane.shape[:2]
    pad = [(0, height % 2), (0, width % 2)] + [(0, 0)] * (plane.ndim - 2)
    plane = np.pad(plane, pad, "edge")
    return np.stack([plane[y::2, x::2] for y in (0, 1) for x in (0, 1)], axis=2)


def half(color, radius, depth, constants):
    """Color, |CoC| radius and depth at half resolution. The closest pixel gives radius and depth; colors
    of other depths weigh less."""
    colors, radii, depths = blocks(color), blocks(radius), blocks(depth)
    closest = np.argmin(depths, axis=2)[..., None]
    own = np.take_along_axis(radii, closest, 2)[..., 0] / 2
    at = np.take_along_axis(depths, closest, 2)[..., 0]
    weight = np.exp(-((depths - at[..., None]) / (0.1 * at[..., None]))**2) + 1e-4
    weight /= 1 + constants.karis * luma(colors)
    return (colors * weight[..., None]).sum(2) / weight.sum(2)[..., None], own, at


def shifted_rows(plane, y, x):
    """plane at fractional places: the nearest pixel, clamped to the border."""
    rows = np.clip(np.rint(y).astype(int), 0, plane.shape[0] - 1)
    return plane[rows, np.clip(np.rint(x).astype(int), 0, plane.shape[1] - 1)]


def tiles(plane, size, extreme):
    """The extreme (np.max, np.min) of each tile and its eight neighbors, for every pixel."""
    height, width = plane.shape
    plane = np.pad(plane, [(0, -height % size), (0, -width % size)], "edge")
    reduced = extreme(plane.reshape(plane.shape[0] // size, size, -1, size), axis=(1, 3))
    around = np.pad(reduced, 1, "edge")
    around = [around[y:y + reduced.shape[0], x:x + reduced.shape[1]] for y in range(3) for x in range(3)]
    wide = np.kron(extreme(np.stack(around), axis=0), np.ones((size, size), np.float32))
    return wide[:height, :width]


def sample_alpha(radius):
    """Share of one pixel in the area over which its light spreads."""
    return 1 / (math.pi * np.maximum(radius, SINGLE_PIXEL_RADIUS)**2)


def taps():
    """(ring, unit x, unit y); the center is ring 0."""
    yield 0, 0.0, 0.0
    for ring in range(1, RINGS + 1):
        for i in range(8 * ring):
            angle = 2 * math.pi * i / (8 * ring)
            yield ring, math.cos(angle) * ring / RINGS, math.sin(angle) * ring / RINGS


def prefiltered(color, radius, depth, constants):
    """Fills the gaps between taps: nine taps of the surface over a part of its own CoC."""
    y, x = np.mgrid[0:color.shape[0], 0:color.shape[1]].astype(np.float32)
    reach = constants.prefilter * constants.outer_ring * radius / RINGS
    total, weights = color.copy(), np.ones_like(radius)
    for i in range(8):
        at = y + reach * math.sin(i * math.pi / 4), x + reach * math.cos(i * math.pi / 4)
        weight = np.exp(-((shifted_rows(depth, *at) - depth) / (0.1 * depth))**2)
        total += weight[..., None] * shifted_rows(color, *at)
        weights += weight
    return total / weights[..., None]


def gather(color, radius, depth, constants):
    """(background, foreground, its alpha, its radius) at half resolution."""
    y, x = np.mgrid[0:color.shape[0], 0:color.shape[1]].astype(np.float32)
    reach = np.maximum(tiles(radius, constants.tile, np.max), SINGLE_PIXEL_RADIUS)
    closest = tiles(depth, constants.tile, np.min)
    sums = {kind: [np.zeros_like(color), np.zeros_like(radius), np.zeros_like(radius)]
            for kind in ("background", "foreground")}
    for ring, dx, dy in taps():
        at = y + dy * constants.outer_ring * reach, x + dx * constants.outer_ring * reach
        found, spread, far = (shifted_rows(plane, *at) for plane in (color, radius, depth))
        reaches = np.clip(spread - constants.outer_ring * reach * ring / RINGS + 1, 0, 1)
        behind = smoothstep(0, constants.depth_scale, far / closest - 1)
        for kind, share in (("background", behind), ("foreground", 1 - behind)):
            weight = share * reaches * sample_alpha(spread)
            sums[kind][0] += weight[..., None] * found
            sums[kind][1] += weight
            sums[kind][2] += weight * spread

    def mean(kind):
        total, weight, spread = sums[kind]
        safe = np.maximum(weight, 1e-12)
        return total / safe[..., None], spread / safe, weight

    background, far_spread, far_weight = mean("background")
    foreground, spread, weight = mean("foreground")
    taps_count = sum(1 for _ in taps())
    alpha = np.clip(constants.alpha_gain * weight / (taps_count * sample_alpha(reach)), 0, 1)
    # Both have a color everywhere, because neighbors in other tiles are interpolated with them.
    empty, hidden = weight < 1e-9, far_weight < 1e-9
    foreground[empty], spread[empty], alpha[empty] = background[empty], far_spread[empty], 0
    background[hidden], alpha[hidden] = foreground[hidden], 1
    return background, foreground, alpha, spread


def enlarged(plane, height, width):
    """Bilinear, from half resolution."""
    def lines(count, size):
        at = np.clip((np.arange(count) + 0.5) / 2 - 0.5, 0, size - 1)
        first = at.astype(int)
        return first, np.minimum(first + 1, size - 1), (at - first).astype(np.float32)

    first, second, t = lines(height, plane.shape[0])
    t = t.reshape(-1, *[1] * (plane.ndim - 1))
    plane = plane[first] * (1 - t) + plane[second] * t
    first, second, t = lines(width, plane.shape[1])
    t = t.reshape(1, -1, *[1] * (plane.ndim - 2))
    return plane[:, first] * (1 - t) + plane[:, second] * t


def depth_of_field(color, depth, camera, constants):
    height, width = depth.shape
    depth = np.clip(depth, 1e-3, 1e4).astype(np.float32)
    radius = np.abs(camera.signed_radius(depth, width)).astype(np.float32)
    small, small_radius, small_depth = half(color, radius, depth, constants)
    small = prefiltered(small, small_radius, small_depth, constants)
    background, foreground, alpha, spread = gather(small, small_radius, small_depth, constants)
    background, foreground, alpha, spread = (enlarged(plane, height, width) for plane in
                                             (background, foreground, alpha, spread))

    def blurred(of):
        return smoothstep(constants.sharp_px, constants.blurred_px, of)[..., None]

    def mixed(a, b, t):
        return a + (b - a) * t

    return mixed(mixed(color, background, blurred(radius)),
                 mixed(color, foreground, blurred(2 * spread)), alpha[..., None])


def filtered(path, camera_path, number, constants):
    """(pixels of all channels, their names, attributes of the renderer)."""
    pixels, spec = frames.read(path)
    names = list(spec.channelnames)
    color = frames.columns(names, "Combined.RGB")
    depth = pixels[..., frames.columns(names, "Depth.Z")[0]]
    camera = frames.Camera.of(camera_path, number)
    result = pixels.copy()
    result[..., color] = depth_of_field(pixels[..., color], depth, camera, constants)
    return result, names, frames.renderer_of(spec)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sharp")
    parser.add_argument("--camera", required=True)
    parser.add_argument("--frame", type=int, required=True, help="whose values of the camera are used")
    parser.add_argument("-o", "--out", required=True)
    options = parser.parse_args()
    frames.write(options.out, *filtered(options.sharp, options.camera, options.frame, Constants()))


if __name__ == "__main__":
    main()
