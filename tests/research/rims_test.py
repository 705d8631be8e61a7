"""The mask of bokeh rims, and the error there, on discs whose places and errors are known.

usage: rims_test.py POSTCHAIN"""
import dataclasses
import math
import pathlib
import sys
import tempfile
import unittest

import numpy as np

import frame as frames
import rims

sys.argv.pop(1)  # unused
WIDTH, HEIGHT = 128, 96
CENTER = 40, 60  # y, x of the lamp's pixel


def camera(radius, blades=0):
    """Radius in pixels at 4 m, focused at 2 m."""
    return frames.Camera(focal_length_mm=50, sensor_width_mm=36, focus_distance=2, aperture_blades=blades,
                         f_stop=0.5 * 0.05**2 * (1 / 2 - 1 / 4) * WIDTH / 0.036 / radius)


def lamp(vectors=(0, 0, 0, 0)):
    """(color, depth, vectors) of a dark wall at 4 m with one pixel of light."""
    color = np.full((HEIGHT, WIDTH, 3), 0.1, np.float32)
    color[CENTER] = 100
    return (color, np.full((HEIGHT, WIDTH), 4, np.float32),
            np.broadcast_to(np.array(vectors, np.float32), (HEIGHT, WIDTH, 4)))


def distance(y=0.0, x=0.0):
    """Distance of each pixel from the lamp."""
    rows, cols = np.mgrid[0:HEIGHT, 0:WIDTH]
    return np.hypot(rows - CENTER[0] - y, cols - CENTER[1] - x)


def disc(inside, light=1.0):
    return np.where(inside[..., None], light, 0.1).astype(np.float32) * np.ones(3, np.float32)


class Rims(unittest.TestCase):
    def test_the_rim_of_a_disc_is_two_pixels_wide_on_either_side(self):
        for radius in (6, 15):
            found = rims.rim_mask(lamp(), camera(radius), disc(distance() <= radius), False)
            away = np.abs(distance() - radius)
            self.assertTrue(found[away < 1].all())
            self.assertFalse(found[away > 3].any())
            self.assertAlmostEqual(found.sum() / (4 * 2 * math.pi * radius), 1, delta=0.1)

    def test_small_dim_or_hidden_discs_have_no_rim(self):
        truth = disc(distance() <= 10)
        self.assertTrue(rims.rim_mask(lamp(), camera(10), truth, False).any())
        self.assertFalse(rims.rim_mask(lamp(), camera(2.5), truth, False).any())
        self.assertFalse(rims.rim_mask(lamp(), camera(10), disc(distance() <= 10, 0.11), False).any())
        dim = lamp()
        dim[0][CENTER] = 3
        self.assertFalse(rims.rim_mask(dim, camera(10), truth, False).any())

    def test_with_the_shutter_the_disc_moves_along_its_vectors(self):
        # To the right by 40 px a frame; the shutter is open for half of it.
        moved = lamp((-40, 0, -40, 0))
        swept = np.min([distance(x=x) for x in np.linspace(-10, 10, 41)], axis=0) <= 8
        found = rims.rim_mask(moved, camera(8), disc(swept), True)
        for y, x, on_rim in ((0, 18, True), (0, -18, True), (8, 0, True), (-8, 5, True), (0, 8, False),
                             (0, 0, False)):
            self.assertEqual(bool(found[CENTER[0] + y, CENTER[1] + x]), on_rim, (y, x))
        # Up in the image is +y of a vector: from below to here, then to the right.
        bent = lamp((0, -40, -40, 0))
        found = rims.rim_mask(bent, camera(4), np.zeros((HEIGHT, WIDTH, 3), np.float32) + disc(
            np.minimum.reduce([distance(x=x) for x in range(11)] + [distance(y=y) for y in range(11)]) <= 4),
            True)
        self.assertTrue(found[CENTER[0] + 14, CENTER[1]] and found[CENTER[0], CENTER[1] + 14])
        self.assertFalse(found[CENTER[0] - 14, CENTER[1]] or found[CENTER[0], CENTER[1] - 14])

    def test_blades_make_a_polygon_turned_in_front_of_the_focus(self):
        three = camera(10, blades=3)  # corners at 60, 180 and 300 degrees behind the focus
        for radius, corner in ((10, 60), (-10, 240)):
            for degrees, inside in ((corner, True), (corner + 120, True), (corner + 180, False)):
                x, y = 9 * math.cos(math.radians(degrees)), 9 * math.sin(math.radians(degrees))
                self.assertEqual(bool(three.in_aperture(x, y, radius)), inside, (radius, degrees))
        self.assertTrue(dataclasses.replace(three, aperture_rotation_deg=60).in_aperture(-4.5, -7.8, 10))

    def test_error_counts_on_the_rim_only(self):
        radius = 15
        truth = disc(distance() <= radius)
        mask = rims.rim_mask(lamp(), camera(radius), truth, False)
        larger = distance() <= radius + 1
        image = disc(larger)
        image[0, 0] = 7  # far from the rim
        step = (1 / 2)**(1 / 2.2) - (0.1 / 1.1)**(1 / 2.2)
        wrong = int((larger & (distance() > radius)).sum())
        with tempfile.TemporaryDirectory() as name:
            paths = [pathlib.Path(name) / file for file in ("truth.exr", "image.exr")]
            for path, pixels in zip(paths, (truth, image)):
                frames.write(path, pixels, "RGB")
            found = rims.mean_squared_error(*paths, mask)
        self.assertAlmostEqual(found, wrong * step**2 / mask.sum(), places=6)


unittest.main()
