#!/usr/bin/python3
"""A sheet of what the steps of the inverse warp make of one frame (docs/inverse_warp.md#steps).

    tools/steps_picture.py STAGES INPUT.exr RESULT.exr OUT.jpg

STAGES: of `postchain run balanced --dump-stages STAGES --no-elide`, of one frame. Tiles, row by row: input; motion
(hue: direction) of the surfaces, dark if far; edges (white), pixels that are split (yellow) or show the surface in
front (red) or a lamp (blue); number of start surfaces of each block; background; cells behind which a surface
continues (green); mean of blurred samples; FXAA's gate; result.
"""
import colorsys
import pathlib
import sys

import numpy as np
import OpenImageIO as oiio

TILE = (320, 180)


def read(path):
    """Height x width x channels, as doubles."""
    image = oiio.ImageBuf(str(path))
    return np.asarray(image.get_pixels(oiio.FLOAT), dtype=np.float64)


def words(stage):
    """A plane of unsigned integers, which is stored as floats: without their last bits."""
    return stage.astype(np.uint64).astype(np.uint32)


def floats(bits):
    return bits.view(np.float32).astype(np.float64)


def display(rgb):
    rgb = np.maximum(rgb[..., :3], 0)
    return (rgb / (1 + rgb))**(1 / 2.2)


def gray(values):
    return np.repeat(np.clip(values, 0, 1)[..., None], 3, axis=2)


def enlarged(cells, edge, size):
    """Each cell as a square of pixels, cut to (width, height)."""
    return np.repeat(np.repeat(cells, edge, axis=0), edge, axis=1)[:size[1], :size[0]]


def motion(surfaces):
    bits = words(surfaces)
    path = floats(np.ascontiguousarray(bits[..., :2] & 0xfffffff8))
    depth = floats(np.ascontiguousarray(bits[..., 3] & 0xfffffffc))
    length = np.hypot(path[..., 0], path[..., 1])
    hue = (np.arctan2(path[..., 1], path[..., 0]) / (2 * np.pi)) % 1
    value = 0.25 + 0.75 * depth / depth.max()
    to_rgb = np.vectorize(colorsys.hsv_to_rgb)
    return np.stack(to_rgb(hue, np.clip(length / np.percentile(length, 99), 0, 1), value), axis=2)


def edges(marks, shown, mixed, picture):
    size = (picture.shape[1], picture.shape[0])
    numbers = np.arange(16).reshape(4, 4)

    def pixels(squares):
        big = enlarged(squares, 4, size)
        bit = np.tile(numbers, (squares.shape[0], squares.shape[1]))[:size[1], :size[0]]
        return (big >> bit & 1).astype(bool)

    tile = 0.3 * picture
    tile[pixels(words(marks)[..., 0] & 0xffff)] = (1, 1, 1)
    word = words(mixed)[..., 0]
    listed = pixels(words(marks)[..., 0] & 0xffff)  # elsewhere `mixed` is undefined
    tile[listed & (word & 64 != 0)] = (1, 0.8, 0)
    tile[listed & (word & 32 != 0)] = (1, 0.1, 0.1)
    tile[pixels(words(shown)[:, ::2, 0])] = (0.2, 0.5, 1)
    return tile


def main(stages, source, result, out):
    stages = pathlib.Path(stages)

    def stage(name):
        found = sorted(stages.glob(f"0.joint_blur.{name}.????.exr"))
        if len(found) != 1:
            sys.exit(f"{stages}: {len(found)} files 0.joint_blur.{name}.####.exr; dump the stages of one frame")
        return read(found[0])

    picture = display(read(source))
    size = (picture.shape[1], picture.shape[0])
    blocks = ((size[0] + 15) // 16, (size[1] + 15) // 16)
    starts = words(stage("starts"))
    texels = starts.shape[1] // blocks[0]
    count = starts[:, texels - 1::texels, 1] / (texels - 1)
    background = display(stage("background_color"))[:, :8 * blocks[0]]
    continued = stage("background")[:, :8 * blocks[0], 1] >= 2
    behind = background.copy()
    behind[continued] = (0.2, 0.9, 0.3)
    soft = stage("soft")
    tiles = [picture, motion(stage("surfaces")),
             edges(stage("marks"), stage("shown"), stage("mixed"), picture),
             enlarged(gray(count), 16, size), enlarged(background, 2, size), enlarged(behind, 2, size),
             display(soft) * np.sqrt(np.clip(soft[..., 3:], 0, 1)), gray(stage("hint")[..., 1]),
             display(read(result))]
    sheet = np.full((3 * TILE[1] + 8, 3 * TILE[0] + 8, 3), 0.5, dtype=np.float32)
    for i, tile in enumerate(tiles):
        image = oiio.ImageBuf(oiio.ImageSpec(size[0], size[1], 3, oiio.FLOAT))
        image.set_pixels(oiio.ROI(), np.ascontiguousarray(tile, dtype=np.float32))
        small = oiio.ImageBufAlgo.resize(image, roi=oiio.ROI(0, TILE[0], 0, TILE[1], 0, 1, 0, 3))
        x, y = (i % 3) * (TILE[0] + 4), (i // 3) * (TILE[1] + 4)
        sheet[y:y + TILE[1], x:x + TILE[0]] = small.get_pixels(oiio.FLOAT)
    spec = oiio.ImageSpec(sheet.shape[1], sheet.shape[0], 3, oiio.UINT8)
    spec.attribute("Compression", "jpeg:85")
    file = oiio.ImageOutput.create(out)
    file.open(out, spec)
    file.write_image(np.round(255 * np.clip(sheet, 0, 1)).astype(np.uint8))
    file.close()


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
