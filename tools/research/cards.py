"""Ten scenes of flat, textured cards that move, turn and grow, with ground truth, in NumPy: families of scenes for
tools/research/reproduction.py."""
import math

import numpy as np

TIMES = 128  # of the shutter, each at another place in the pixel
PLACES = [((i + 0.5) / 4 - 0.5, (j + 0.5) / 4 - 0.5) for i in range(4) for j in range(4)]


class Card:
    """`inside` and `color` are functions of the card's own coordinates, of which (0, 0) is at `at` in pixels from the
    middle of the frame. In a frame it moves by `move` px, turns by `turn` radians and grows by exp(`grow`)."""

    def __init__(self, depth, inside, color, at=(0, 0), move=(0, 0), turn=0.0, grow=0.0):
        self.inverse_depth, self.inside, self.color = 1 / depth, inside, color
        self.at, self.move, self.turn, self.grow = at, move, turn, grow

    def _place(self, time):
        a, size = self.turn * time, math.exp(self.grow * time)
        matrix = size * np.array([[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]])
        return matrix, [self.at[i] + self.move[i] * time for i in range(2)]

    def own(self, x, y, time):
        matrix, (x0, y0) = self._place(time)
        back = np.linalg.inv(matrix)
        return back[0, 0] * (x - x0) + back[0, 1] * (y - y0), back[1, 0] * (x - x0) + back[1, 1] * (y - y0)

    def motion(self, u, v):
        (m, first), (n, last) = self._place(-0.5), self._place(0.5)
        d = n - m
        return np.stack([d[0, 0] * u + d[0, 1] * v + last[0] - first[0],
                         d[1, 0] * u + d[1, 1] * v + last[1] - first[1]], -1)


# ------------------------------------------------------------------------------------ shapes and textures
def everywhere(u, v):
    return np.ones(u.shape, bool)


def box(width, height):
    return lambda u, v: (np.abs(u) < width / 2) & (np.abs(v) < height / 2)


def bars(period, width):
    return lambda u, v: np.mod(u, period) < width


def scattered(period, width, height, seed):
    """An ellipse at a random place of each square of the period."""
    places = np.random.default_rng(seed).uniform(-0.5, 0.5, (16, 16, 2)) * (period - max(width, height))
    def inside(u, v):
        i, j = np.floor(u / period).astype(int), np.floor(v / period).astype(int)
        place = places[i % 16, j % 16]
        return np.hypot((u - (i + 0.5) * period - place[..., 0]) / (width / 2),
                        (v - (j + 0.5) * period - place[..., 1]) / (height / 2)) < 1
    return inside


def waves(seed, length):
    """Scene-linear color: waves of about this length under hard stripes, some of them bright."""
    random = np.random.default_rng(seed)
    k, phase = random.normal(0, 4 / length, (4, 2)), random.uniform(0, 2 * math.pi, 4)
    tint = random.uniform(0.2, 0.9, 3)
    def color(u, v):
        a, b, c, d = (np.sin(k[i, 0] * u + k[i, 1] * v + phase[i]) for i in range(4))
        value = 0.55 + 0.2 * a + 0.2 * b
        value = np.where(c > 0.6, 0.2 * value, np.where(d > 0.95, 4 * value, value))
        return value[..., None] * tint + 0.05 * (1 + a)[..., None]
    return color


# -------------------------------------------------------------------------------------------- the scenes
SCENES = {  # front to back
    "fan": [Card(2, lambda u, v: (np.mod(np.arctan2(v, u), 2.0944) < 0.6) & (np.hypot(u, v) < 48), waves(1, 9),
                 turn=0.8),
            Card(5, everywhere, waves(2, 16))],
    "pillars": [Card(1, bars(150, 24), waves(3, 20), (-20, 0), (52, 0)),
                Card(2, bars(67, 14), waves(4, 12), (10, 0), (30, 0)),
                Card(6, everywhere, waves(5, 18), move=(13, 0))],
    "follow": [Card(2, lambda u, v: box(30, 50)(u, v) | (np.hypot(u, v + 34) < 13), waves(6, 14), (0, 14)),
               Card(2, box(110, 3), waves(7, 30), (0, 42)),
               Card(8, everywhere, waves(8, 20), move=(44, 6))],
    "shake": [Card(2, box(80, 50), waves(9, 12), (-20, 10), (25, -20)),
              Card(4, everywhere, waves(10, 18), move=(21, -17))],
    "swing": [Card(2, lambda u, v: box(5, 150)(u, v) | (np.hypot(u, v - 70) < 14), waves(11, 10), (0, -50),
                   turn=0.6),
              Card(5, everywhere, waves(12, 8))],
    "rain": [Card(1, scattered(34, 5, 7, 13), waves(14, 30), move=(-9, 58)),
             Card(2, scattered(22, 3, 4, 15), waves(16, 30), move=(-6, 44)),
             Card(8, everywhere, waves(17, 22), move=(3, 0))],
    "leaves": [Card(2, scattered(44, 34, 16, 18), waves(19, 12), move=(9, 4), turn=0.08),
               Card(3, scattered(37, 15, 27, 20), waves(21, 12), move=(-7, 6), turn=-0.06),
               Card(7, everywhere, waves(22, 15))],
    "approach": [Card(1, lambda u, v: ~box(80, 46)(u, v) & box(124, 80)(u, v), waves(23, 12), grow=0.35),
                 Card(3, box(34, 24), waves(24, 8), (10, -5), grow=0.15),
                 Card(6, everywhere, waves(25, 16), grow=0.08)],
    "doors": [Card(2, lambda u, v: u < -14, waves(26, 14), move=(26, 0)),
              Card(2.5, lambda u, v: u > 20, waves(27, 14), move=(-22, 0)),
              Card(9, everywhere, waves(28, 9))],
    "fence": [Card(1, bars(25, 4), waves(29, 25)),
              Card(6, everywhere, waves(30, 20), move=(38, 3))],
}


def _seen(cards, x, y, time):
    """Color, inverse depth and motion of the first card that is there."""
    color, depth, motion = np.zeros((*x.shape, 3)), np.zeros(x.shape), np.zeros((*x.shape, 2))
    free = np.ones(x.shape, bool)
    for card in cards:
        u, v = card.own(x, y, time)
        here = free & card.inside(u, v)
        u, v = u[here], v[here]
        color[here], depth[here], motion[here] = card.color(u, v), card.inverse_depth, card.motion(u, v)
        free &= ~here
    return color, depth, motion


def render(name, width, height):
    """(color, inverse depth, motion) of a mean over the pixel and of its center, and the color of ground truth: the
    shutter is open for the whole frame."""
    cards = SCENES[name]
    y, x = np.mgrid[:height, :width]
    x, y = x + 0.5 - width / 2, y + 0.5 - height / 2
    center = _seen(cards, x, y, 0.0)
    parts = [_seen(cards, x + dx, y + dy, 0.0) for dx, dy in PLACES]
    sharp = np.mean([one[0] for one in parts], 0), center[1], np.mean([one[2] for one in parts], 0)
    truth = np.zeros((height, width, 3))
    for i in range(TIMES):  # a lattice of rank 1 over time and pixel
        dx, dy = (i * 0.7548776662) % 1 - 0.5, (i * 0.5698402910) % 1 - 0.5
        truth += _seen(cards, x + dx, y + dy, (i + 0.5) / TIMES - 0.5)[0] / TIMES
    return *(tuple(plane.astype(np.float32) for plane in one) for one in (sharp, center)), truth.astype(np.float32)
