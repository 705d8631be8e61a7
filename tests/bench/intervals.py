"""Confidence intervals of paired differences, with Python's own library alone."""
import math


def t_cumulative(t, freedom):
    """Student's distribution function; the finite sums of Abramowitz and Stegun, 26.7.3 and 26.7.4."""
    angle = math.atan(t / math.sqrt(freedom))
    cosine, term, total = math.cos(angle), 1.0, 0.0
    if freedom % 2:
        term = cosine
        for k in range(1, freedom - 1, 2):
            total += term
            term *= cosine * cosine * (k + 1) / (k + 2)
        inside = (angle + math.sin(angle) * total) * 2 / math.pi
    else:
        for k in range(0, freedom - 1, 2):
            total += term
            term *= cosine * cosine * (k + 1) / (k + 2)
        inside = math.sin(angle) * total
    return 0.5 + 0.5 * inside


def t_quantile(share, freedom):
    """The t that Student's distribution stays below with the probability share (0.5 to 1)."""
    low, high = 0.0, 1.0
    while t_cumulative(high, freedom) < share:
        high *= 2
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if t_cumulative(middle, freedom) < share else (low, middle)
    return (low + high) / 2


def mean(values):
    return sum(values) / len(values)


def t_interval(values):
    """95 %: mean -+ t(0.975, n - 1) s / sqrt(n), as (low, high); None below two values."""
    n = len(values)
    if n < 2:
        return None
    middle = mean(values)
    deviation = math.sqrt(sum((value - middle) ** 2 for value in values) / (n - 1))
    half = t_quantile(0.975, n - 1) * deviation / math.sqrt(n)
    return middle - half, middle + half


def batches(values, size):
    """Means of consecutive runs of size values; the last values that fill no run join the last."""
    count = max(1, len(values) // size)
    bounds = [k * size for k in range(count)] + [len(values)]
    return [mean(values[low:high]) for low, high in zip(bounds, bounds[1:])]


def autocorrelation(values):
    """Of each value with the next; None where they do not differ."""
    middle = mean(values)
    spread = sum((value - middle) ** 2 for value in values)
    if spread == 0:
        return None
    return sum((a - middle) * (b - middle) for a, b in zip(values, values[1:])) / spread


def sign_test(values):
    """(positive, all but zeros, two-sided probability of a split as uneven by chance)."""
    signs = [value > 0 for value in values if value != 0]
    n, positive = len(signs), sum(signs)
    rarer = min(positive, n - positive)
    tail = sum(math.comb(n, k) for k in range(rarer + 1)) / 2 ** n
    return positive, n, min(1.0, 2 * tail)


def ranks(values):
    """From 1; equal values share the mean of their places."""
    order = sorted(values)
    return [order.index(value) + (order.count(value) + 1) / 2 for value in values]


def rank_correlation(first, second):
    """Spearman's."""
    a, b = ranks(first), ranks(second)
    middle = (len(a) + 1) / 2
    products = sum((x - middle) * (y - middle) for x, y in zip(a, b))
    return products / math.sqrt(sum((x - middle) ** 2 for x in a)
                                * sum((y - middle) ** 2 for y in b))
