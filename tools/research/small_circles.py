#!/usr/bin/python3
"""The weights of shaders/shared/small_circles.h, one line for each radius of a circle of confusion.

A frame has the mean of each pixel, and so has its blur. What the weights of the pixels around do to a wave
of k radians a pixel should be what the circle does to it, 2 J1(k r) / (k r). They are the least squares over
waves in all directions, almost all up to 0.8 pi, with the sum 1 and the circle's variance r^2/4.
"""
import numpy as np

STEP, RADII, REACH = 0.25, 17, 5
WAVES = 40  # along each axis
LIMIT, BEYOND = 0.8 * np.pi, 0.05  # weight of the waves beyond the limit


def bessel(x):
    """J1, by its integral."""
    turn = (np.arange(2000) + 0.5) / 2000 * np.pi
    return np.cos(turn[:, None] - x.ravel() * np.sin(turn)[:, None]).mean(0).reshape(x.shape)


def alike(x, y):
    """The pixels that have the weight of (x, y)."""
    return {(a * i, b * j) for i, j in ((x, y), (y, x)) for a in (1, -1) for b in (1, -1)}


def weights(radius):
    """Of the pixels (x, y), 0 <= y <= x <= REACH, row by row of x."""
    reach = min(int(np.ceil(radius)) + 2, REACH) if radius > 0 else 0
    places = [(x, y) for x in range(reach + 1) for y in range(x + 1)]
    along = (np.arange(WAVES) + 0.5) / WAVES * np.pi
    kx, ky = (k.ravel() for k in np.meshgrid(along, along))
    k = np.hypot(kx, ky)
    blurs = np.stack([sum(np.cos(kx * i) * np.cos(ky * j) for i, j in alike(*place)) for place in places], 1)
    wanted = 2 * bessel(k * radius) / (k * radius) if radius > 0 else np.ones_like(k)
    counts = np.where(k < LIMIT, 1, BEYOND) * np.exp(-(k / np.pi)**2)
    fixed = np.array([[len(alike(*place)) for place in places],
                      [sum(i * i for i, _ in alike(*place)) for place in places]], float)
    left = np.block([[blurs.T @ (blurs * counts[:, None]), fixed.T], [fixed, np.zeros((2, 2))]])
    right = np.concatenate([blurs.T @ (wanted * counts), [1, radius**2 / 4]])
    found = dict(zip(places, np.linalg.lstsq(left, right, rcond=None)[0]))
    return [found.get((x, y), 0.0) for x in range(REACH + 1) for y in range(x + 1)]


def main():
    for i in range(RADII):
        print(", ".join(f"{weight:.6f}" for weight in weights(STEP * i)))


if __name__ == "__main__":
    main()
