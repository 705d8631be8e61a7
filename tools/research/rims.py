"""Rims of bokeh: the pixels near the outline of the discs that highlights out of focus make, and the error
there (docs/metrics.md)."""
import math

import numpy as np

import frame as frames

LUMA = 4  # least luma of a highlight in `sharp`
RADIUS_PX = 3  # least radius of its circle of confusion
NEAR_PX = 2  # largest distance of a rim's pixels from the outline
CONTRAST = 1.3  # least ratio in ground truth: mean luma just inside the outline to that just outside
WEIGHTS = np.array([0.2126, 0.7152, 0.0722], np.float32)


def components(mask):
    """Lists of (y, x) of the regions of a mask, by their eight neighbors."""
    left, found = set(map(tuple, np.argwhere(mask))), []
    while left:
        open_, region = [left.pop()], []
        while open_:
            y, x = open_.pop()
            region.append((y, x))
            around = {(y + dy, x + dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)} & left
            left -= around
            open_.extend(around)
        found.append(np.array(region))
    return found


def path(vectors, shutter):
    """(y, x) offsets while the shutter is open, half a pixel apart at most. vectors: X, Y to the frame before,
    Z, W from the frame after, y up."""
    ends = [(-vectors[1] * shutter / 2, vectors[0] * shutter / 2),
            (vectors[3] * shutter / 2, -vectors[2] * shutter / 2)]
    offsets = [(0.0, 0.0)]
    for y, x in ends:
        steps = math.ceil(2 * math.hypot(y, x))
        offsets += [(y * i / steps, x * i / steps) for i in range(1, steps + 1)]
    return offsets


def grown(mask, radius):
    """Pixels up to this distance from the mask; it must not touch the border."""
    out = np.zeros_like(mask)
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            if dy * dy + dx * dx <= radius * radius:
                out |= np.roll(mask, (dy, dx), (0, 1))
    return out


def covered(region, offsets, aperture, shape):
    """Mask of what the discs of these pixels cover on their path."""
    places = {(round(y + dy), round(x + dx)) for y, x in region for dy, dx in offsets}
    reach = aperture.shape[0] // 2
    out = np.zeros(shape, bool)
    for y, x in places:
        top, left = y - reach, x - reach
        rows = slice(max(top, 0), min(top + aperture.shape[0], shape[0]))
        cols = slice(max(left, 0), min(left + aperture.shape[1], shape[1]))
        if rows.start < rows.stop and cols.start < cols.stop:
            out[rows, cols] |= aperture[rows.start - top:rows.stop - top, cols.start - left:cols.stop - left]
    return out


def rim_mask(sharp, camera, truth, shutter):
    """sharp: (color, depth, vectors of 4); truth: color. With `shutter` discs move along the vectors."""
    color, depth, vectors = sharp
    height, width = depth.shape
    radius = camera.signed_radius(depth, width)
    luma = color @ WEIGHTS
    seen = truth @ WEIGHTS
    margin = NEAR_PX + 1
    shape = height + 2 * margin, width + 2 * margin
    seen = np.pad(seen, margin, "edge")
    mask = np.zeros(shape, bool)
    for region in components((luma >= LUMA) & (np.abs(radius) >= RADIUS_PX)):
        rows, cols = region[:, 0], region[:, 1]
        own = float(np.median(radius[rows, cols]))
        offsets = path(np.median(vectors[rows, cols], axis=0), camera.shutter_frames if shutter else 0)
        reach = math.ceil(abs(own))
        y, x = np.mgrid[-reach:reach + 1, -reach:reach + 1]
        inside = covered(region + margin, offsets, camera.in_aperture(x, -y, own), shape)
        inside[:margin] = inside[-margin:] = inside[:, :margin] = inside[:, -margin:] = False
        outer = grown(inside, NEAR_PX)
        inner = ~grown(~inside, NEAR_PX)
        lit, dark = inside & ~inner, outer & ~inside
        if lit.any() and dark.any() and seen[lit].mean() >= CONTRAST * seen[dark].mean():
            mask |= lit | dark
    return mask[margin:-margin, margin:-margin]


def of_files(sharp, camera, frame, truth, shutter):
    """The mask of a scene's files."""
    pixels, spec = frames.read(sharp)
    planes = [pixels[..., frames.columns(list(spec.channelnames), name)]
              for name in ("Combined.RGB", "Depth.Z", "Vector.XYZW")]
    return rim_mask((planes[0], planes[1][..., 0], planes[2]), frames.Camera.of(camera, frame),
                    frames.read(truth)[0][..., :3], shutter)


def mean_squared_error(reference, image, mask):
    """Mean squared difference of displayed values over the mask."""
    first, second = (frames.displayed(frames.read(path)[0])[mask] for path in (reference, image))
    return float(np.mean((first - second)**2))
