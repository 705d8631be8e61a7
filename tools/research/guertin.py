"""The report's motion blur in NumPy, from docs/motion_blur.md, with switches that the product does not have.
tools/research/reproduction.py measures them."""
import numpy as np

DEFAULTS = {
    "samples": 25, "r": 40, "shutter": 0.5, "h": 0.95, "tau": 1.0, "kappa": 40.0, "gamma": 1.5, "softness": 1.0,
    "min_speed": 0.5, "seed": 0,
    "noise": "halton",       # hashed: a random number of its own for each pixel and seed; none
    "tile_noise": True,      # the random choice of a tile near a border
    "diagonal": True,        # False: all eight neighbors count in NeighborMax
    "interpolated": False,   # v_max bilinear between tiles
    "central": True,         # False: the middle tap is left out
    "mix_reversed": False,   # equation 1 as printed
    "w_a": True, "w_b": True, "w_both": True,  # False: that dot product is 1
    "u": "even",             # share of taps along v_c: a number, "variance", "printed" (equation 2)
    "u_nearest": False,      # u of the own tile, not bilinear
    "single": False,
    "encoding": None,        # report, mcguire: 8 bits a component
}
RHO = 0.5


def _inverse_digits(index, base):
    value, place = np.zeros(index.shape), 1.0 / base
    while index.any():
        value += place * (index % base)
        index, place = index // base, place / base
    return value


def _random(height, width, options):
    """Tile value in [0, 1), tap value in [-1, 1)."""
    y, x = np.mgrid[:height, :width]
    if options["noise"] == "hashed":
        tile, tap = np.random.default_rng(options["seed"]).random((2, height, width))
        return tile, 2 * tap - 1
    shift = np.random.default_rng(options["seed"]).integers(0, 128, 2) if options["seed"] else (0, 0)
    x, y = (x + shift[0]) % 128, (y + shift[1]) % 128
    index = np.zeros(x.shape, int)
    for bit in range(7):
        index |= (x >> bit & 1) << 2 * bit | (y >> bit & 1) << 2 * bit + 1
    return _inverse_digits(index, 2), 2 * _inverse_digits(index, 3) - 1


def _lengths(v):
    return np.sqrt((v * v).sum(-1))


def _unit(v):
    return v / np.maximum(_lengths(v), 1e-15)[..., None]


def half_velocity(motion, shutter, r):
    """Clamped half-velocities, and lengths before the clamp."""
    v = 0.5 * shutter * motion.astype(float)
    length = _lengths(v)
    return v * np.minimum(1, r / np.maximum(length, 1e-15))[..., None], length


def encoded(v, r, encoding):
    """As read back from 8 bits a component."""
    if encoding == "report":    # 128 is 0
        return np.rint(v * (127 / r)) * (r / 127)
    if encoding == "mcguire":   # v/(2 r) + 1/2 in 0..255: no code is 0
        return (np.rint((v / (2 * r) + 0.5) * 255) / 255 - 0.5) * (2 * r)
    return v


def tile_max(v, length, r):
    rows, columns = -(-v.shape[0] // r), -(-v.shape[1] // r)
    best, size = np.zeros((rows, columns, 2)), np.zeros((rows, columns))
    for y in range(rows):
        for x in range(columns):
            part = np.s_[y * r:y * r + r, x * r:x * r + r]
            at = length[part].argmax()
            best[y, x], size[y, x] = v[part].reshape(-1, 2)[at], length[part].flat[at]
    return best, size


def _neighbors(y, x, shape):
    for oy in (-1, 0, 1):
        for ox in (-1, 0, 1):
            if 0 <= y + oy < shape[0] and 0 <= x + ox < shape[1]:
                yield oy, ox


def neighbor_max(best, size, all_eight):
    result = best.copy()
    for y, x in np.ndindex(size.shape):
        longest = size[y, x]
        for oy, ox in _neighbors(y, x, size.shape):
            v, length = best[y + oy, x + ox], size[y + oy, x + ox]
            reaches = all_eight or not (ox and oy) or (ox * v[0] != 0 and np.sign(ox * v[0]) == np.sign(oy * v[1]))
            if reaches and length > longest:
                longest, result[y, x] = length, v
    return result


def _variance(best, size, printed):
    u = np.zeros(size.shape)
    for y, x in np.ndindex(size.shape):
        n, products = _unit(best[y, x]), []
        if _lengths(best[y, x]) < 0.5:
            continue
        for oy, ox in _neighbors(y, x, size.shape):
            other = best[y + oy, x + ox]
            if _lengths(other) >= 0.5:
                m = _unit(other)
                products.append(np.abs(n) @ np.abs(m) if printed else abs(n @ m))
        u[y, x] = np.clip(1 - np.mean(products), 0, 1)
    return u


def _bilinear(table, y, x, r):
    fy, fx = (y + 0.5) / r - 0.5, (x + 0.5) / r - 0.5
    y0, x0 = np.floor(fy).astype(int), np.floor(fx).astype(int)
    fy, fx = fy - y0, fx - x0
    if table.ndim == 3:
        fy, fx = fy[:, None], fx[:, None]
    def at(i, j):
        return table[np.clip(i, 0, table.shape[0] - 1), np.clip(j, 0, table.shape[1] - 1)]
    return ((at(y0, x0) * (1 - fx) + at(y0, x0 + 1) * fx) * (1 - fy)
            + (at(y0 + 1, x0) * (1 - fx) + at(y0 + 1, x0 + 1) * fx) * fy)


def _chosen_tiles(y, x, random, shape, r, tau):
    tile_y, tile_x = y // r, x // r
    local_y, local_x = (y % r + 0.5) / r, (x % r + 0.5) / r
    near_y, near_x = np.minimum(local_y, 1 - local_y), np.minimum(local_x, 1 - local_x)
    along_x = near_x <= near_y
    across = random < 0.5 - tau * np.minimum(near_x, near_y)
    to_y = tile_y + np.where(across & ~along_x, np.where(local_y < 0.5, -1, 1), 0)
    to_x = tile_x + np.where(across & along_x, np.where(local_x < 0.5, -1, 1), 0)
    inside = (to_y >= 0) & (to_y < shape[0]) & (to_x >= 0) & (to_x < shape[1])
    return np.where(inside, to_y, tile_y), np.where(inside, to_x, tile_x)


def blur(color, inverse_depth, motion, **changed):
    """Color, height x width x channels."""
    unknown = changed.keys() - DEFAULTS.keys()
    if unknown:
        raise ValueError(f"no such switch: {', '.join(sorted(unknown))}")
    options = {**DEFAULTS, **changed}
    height, width = motion.shape[:2]
    r, count = options["r"], options["samples"]
    v, length = half_velocity(motion, options["shutter"], r)
    v = encoded(v, r, options["encoding"])
    best, size = tile_max(v, length, r)
    longest = neighbor_max(best, size, options["single"] or not options["diagonal"])

    y, x = (part.ravel() for part in np.mgrid[:height, :width])
    tile_random, tap_random = (part.ravel() for part in _random(height, width, options))
    if options["noise"] == "none":
        tap_random = 0 * tap_random
    if options["interpolated"]:
        v_max = _bilinear(longest, y, x, r)
    elif options["noise"] == "none" or not options["tile_noise"]:
        v_max = longest[y // r, x // r]
    else:
        v_max = longest[_chosen_tiles(y, x, tile_random, size.shape, r, options["tau"])]
    u = options["u"]
    if u in ("variance", "printed"):
        table = _variance(best, size, u == "printed")
        u = table[y // r, x // r] if options["u_nearest"] else _bilinear(table, y, x, r)

    moving = _lengths(v_max) > options["min_speed"]
    y, x, v_max, tap_random = y[moving], x[moving], v_max[moving], tap_random[moving]
    u = u if isinstance(u, str) else np.broadcast_to(u, moving.shape)[moving]
    v_c = v[y, x]
    reach, speed = _lengths(v_max), _lengths(v_c)
    w_max, w_v = v_max / reach[:, None], _unit(v_c)
    w_still = np.stack([-w_max[:, 1], w_max[:, 0]], 1)
    side = v_max[:, 0] * v_c[:, 1] - v_max[:, 1] * v_c[:, 0]
    w_still = np.where(side[:, None] < 0, -w_still, w_still)
    share = np.clip((speed - 0.5) / options["gamma"], 0, 1)
    if options["mix_reversed"]:
        share = 1 - share
    both = (side == 0) & (share > 0) & (share < 1)
    first = options["kappa"] * np.maximum(speed, RHO)
    total = count / first * np.where(both, 2, 1)
    added = np.zeros((len(y), color.shape[2]))

    def gather(part, sign):
        w_c = _unit(sign * w_still[part] * (1 - share[part])[:, None] + w_v[part] * share[part][:, None])
        aligned = np.abs((w_c * w_max[part]).sum(1))
        p_y, p_x, own = y[part], x[part], color[y[part], x[part]]
        rho_c, q_p = np.maximum(speed[part], RHO), inverse_depth[p_y, p_x]
        for i in range(count):
            if not options["central"] and 2 * i == count - 1:
                continue
            along = (-1 + 2 * (i + 1 + tap_random[part] * options["h"]) / (count + 1)) * reach[part]
            if options["single"]:
                follows = np.zeros(len(p_y), bool)
            elif isinstance(u, str):
                follows = np.full(len(p_y), i % 2 == 1)
            else:
                follows = np.floor((i + 1) * u[part]) > np.floor(i * u[part])
            d = np.where(follows[:, None], w_c, w_max[part])
            s = np.floor(along[:, None] * d + 0.5).astype(int)
            s_y, s_x, distance = p_y + s[:, 1], p_x + s[:, 0], np.abs(along)
            counts = (s_y >= 0) & (s_y < height) & (s_x >= 0) & (s_x < width)
            s_y, s_x = np.clip(s_y, 0, height - 1), np.clip(s_x, 0, width - 1)
            v_s = v[s_y, s_x]
            speed_s = _lengths(v_s)
            rho_s = np.maximum(speed_s, RHO)
            w_a = np.where(follows, 1.0, aligned)
            w_b = np.abs((v_s * d).sum(1)) / np.maximum(speed_s, 1e-15)
            w_both = np.maximum(w_a, w_b)
            one = np.ones(len(p_y))
            if options["single"]:
                w_a = w_b = w_both = one
            w_a, w_b = w_a if options["w_a"] else one, w_b if options["w_b"] else one
            w_both = w_both if options["w_both"] else one
            q_s = inverse_depth[s_y, s_x]
            far, near = np.minimum(q_p, q_s), np.maximum(q_p, q_s)
            hidden = np.clip(1 - options["softness"] * (near - far) / np.maximum(far, 1e-30), 0, 1)
            hidden = np.where(near > far, hidden, 1) if options["softness"] else one
            front = np.clip(1 - distance / rho_s, 0, 1) * w_b * np.where(q_s < q_p, hidden, 1)
            back = np.clip(1 - distance / rho_c, 0, 1) * w_a * np.where(q_p < q_s, hidden, 1)
            edge = np.clip((distance / np.minimum(rho_s, rho_c) - 0.95) / 0.1, 0, 1)
            weight = front + back + 2 * (1 - edge * edge * (3 - 2 * edge)) * w_both
            weight = np.where(counts, weight, 0)
            added[part] += weight[:, None] * (color[s_y, s_x] - own)
            total[part] += weight

    gather(np.arange(len(y)), 1.0)
    if both.any() and not options["single"]:
        gather(np.flatnonzero(both), -1.0)
    elif options["single"]:
        total -= np.where(both, count / first, 0)
    result = color.astype(float).copy()
    result[y, x] += added / total[:, None]
    return result
