"""The half-resolution baseline against closed forms. usage: scatter_gather_test.py POSTCHAIN"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import frame as frames
import scatter_gather

POSTCHAIN = sys.argv.pop(1)
WIDTH, HEIGHT = 160, 120
# Karis weights lose energy on purpose. The area of a ring's taps ends half a ring beyond it: a sixth.
CONSTANTS = scatter_gather.Constants(karis=0, outer_ring=6 / 7, prefilter=0.5)


def camera(radius):
    """Signed radius of the CoC in pixels at 4 m; the focus is at 2 m."""
    return frames.Camera(focal_length_mm=50, sensor_width_mm=36, focus_distance=2,
                         f_stop=0.5 * 0.05**2 * (1 / 2 - 1 / 4) * WIDTH / 0.036 / radius)


def blurred(color, depth, radius, constants=CONSTANTS):
    depth = np.broadcast_to(np.asarray(depth, np.float32), (HEIGHT, WIDTH))
    return scatter_gather.depth_of_field(color.astype(np.float32), depth, camera(radius), constants)


def halves(left, right):
    """A plane of two values."""
    return np.where(np.arange(WIDTH) < WIDTH // 2, left, right) + np.zeros((HEIGHT, 1))


Y, X = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
DISTANCE = np.hypot(Y - HEIGHT / 2, X - WIDTH / 2)  # from the middle


class ScatterGather(unittest.TestCase):
    def test_flat_color_stays(self):
        rng = np.random.default_rng(1)
        depth = rng.uniform(1, 8, (HEIGHT, WIDTH))
        color = np.broadcast_to(np.array([0.25, 1, 4], np.float32), (HEIGHT, WIDTH, 3))
        np.testing.assert_allclose(blurred(color, depth, 10, scatter_gather.Constants()), color, rtol=1e-5)

    def test_a_bulb_becomes_a_uniform_disc_with_its_energy(self):
        for radius in (18, 24):
            color = np.zeros((HEIGHT, WIDTH, 3))
            bulb = radius / 4  # radius; the taps are radius / 3 apart
            color[DISTANCE <= bulb] = [8, 4, 2]
            out = blurred(color, 4, radius)
            energy = color.sum((0, 1))
            np.testing.assert_allclose(out.sum((0, 1)), energy, rtol=0.04)
            inside, outside = DISTANCE < radius - bulb - 3, DISTANCE > radius + bulb + 3
            level = energy / (np.pi * radius**2)
            np.testing.assert_allclose(out[inside].mean(0), level, rtol=0.06)
            self.assertLess((out[inside].std(0) / level).max(), 0.2)
            self.assertLess(out[outside].max(), 0.02 * level.min())

    def test_what_is_in_focus_keeps_its_pixels(self):
        rng = np.random.default_rng(2)
        color = rng.uniform(0, 1, (HEIGHT, WIDTH, 3))
        np.testing.assert_array_equal(blurred(color, 2, 10), color.astype(np.float32))

    def test_the_background_does_not_bleed_over_a_sharp_surface(self):
        out = blurred(halves(0.1, 10)[..., None] * np.ones(3), halves(2, 4), 10)
        np.testing.assert_allclose(out[:, :WIDTH // 2 - 3], 0.1, rtol=0.05)

    def test_half_of_the_light_crosses_the_edge_of_a_blurred_foreground(self):
        depth = halves(4 / 3, 2)  # its circle is that at 4 m
        out = blurred(halves(0, 1)[..., None] * np.ones(3), depth, 16,
                      scatter_gather.Constants(alpha_gain=1))[HEIGHT // 2, :, 0]
        # In front of the edge nothing is seen behind; beyond it, the part of a disc beyond a chord.
        self.assertAlmostEqual(float(out[WIDTH // 2 + 1]), 0.5, delta=0.15)
        d = 8.5 / 16
        behind = (np.arccos(d) - d * np.sqrt(1 - d * d)) / np.pi
        self.assertAlmostEqual(float(out[WIDTH // 2 + 8]), 1 - behind, delta=0.08)
        self.assertAlmostEqual(float(out[WIDTH // 2 + 24]), 1, delta=0.01)

    def test_light_reaches_as_far_as_its_own_circle(self):
        color = np.where((DISTANCE <= 3)[..., None], 50.0, 0.0) * np.ones(3)
        depth = np.where(DISTANCE <= 3, 2.4, 4.0)  # its circle is a third of that around it: 8 px
        out = blurred(color, depth, 24)
        level = color.sum((0, 1)) / (np.pi * 8**2)
        self.assertGreater(out[DISTANCE < 3].min(), 0.3 * level[0])
        self.assertLess(out[DISTANCE > 8 + 3 + 4].max(), 0.01 * level[0])

    def test_karis_weights_dim_single_bright_pixels(self):
        color = np.full((HEIGHT, WIDTH, 3), 0.1)
        color[HEIGHT // 2, WIDTH // 2] = 100
        excess = [float((blurred(color, 4, 10, scatter_gather.Constants(karis=karis)) - 0.1).sum())
                  for karis in (0, 1)]
        self.assertLess(excess[1], 0.1 * excess[0])

    def test_files_keep_their_other_channels(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            subprocess.run([POSTCHAIN, "scene", "still", "-o", folder, "--size", "64x36", "--frames", "1",
                            "--truth-samples", "0"], check=True, capture_output=True)
            frames.write(folder / "out.exr", *scatter_gather.filtered(
                folder / "sharp.0001.exr", folder / "camera.json", 1, scatter_gather.Constants()))
            (before, names), (after, out_names) = ((pixels, list(spec.channelnames)) for pixels, spec in (
                frames.read(folder / "sharp.0001.exr"), frames.read(folder / "out.exr")))
        self.assertEqual(sorted(out_names), sorted(names))
        for channels, changed in (("Depth.Z", False), ("Vector.XYZW", False), ("Combined.RGB", True)):
            change = np.abs(after[..., frames.columns(out_names, channels)]
                            - before[..., frames.columns(names, channels)]).max()
            self.assertEqual(change > 0.01, changed, channels)
            self.assertTrue(changed or change == 0, channels)


unittest.main()
