
QUANTILES = @QUANTILES


def weights(nodes, x):
    """Weights of the nodes for ln u = x (barycentric, Chebyshev's nodes of the first kind)."""
    if x in nodes:
        return [1.0 if x == n else 0.0 for n in nodes]
    terms = [(-1.0) ** k * sin(pi * (k + 0.5) / len(nodes)) / (x - n) for k, n in enumerate(nodes)]
    return [t / sum(terms) for t in terms]


def quantile(p, start, step, share):
    """The point below which a share of the mass lies; within a cell the density goes straight."""
    wanted, below = share * sum(0.5 * (a + b) for a, b in zip(p, p[1:])), 0.0
    for k, (a, b) in enumerate(zip(p, p[1:])):
        cell, rise, left = 0.5 * (a + b), b - a, wanted - below
        if below + cell >= wanted:
            if abs(rise) < 1e-12 * (a + b):
                return start + step * (k + left / a)
            return start + step * (k + (sqrt(max(a * a + 2.0 * rise * left, 0.0)) - a) / rise)
        below += cell
    return inf - inf


def by_posterior(side, drive, signal):
    """The distance by the posterior of ln a: flat within the calibrated distances, fading beyond."""
    first, step, near_end, far_end, fades, offset, zero, nodes, values, variances = side["learned"]
    y, u = signal - zero, drive + offset
    w, last = weights(nodes, log(u)), len(values[0]) - 1
    ys = [u * sum(a * b for a, b in zip(w, column)) for column in zip(*values)]
    vs = [u * u * sum(a * b for a, b in zip(w, column)) for column in zip(*variances)]
    peak = max(range(last + 1), key=lambda k: (ys[k], k))

    def cubic(p, x):
        """The cubic through four points, and its slope in ln a."""
        s = min(max((x - first) / step, 0.0), float(last))
        k = min(max(int(s), 1), last - 2) - 1
        t = s - k
        b, c, d = t - 1.0, t - 2.0, t - 3.0
        value = -b * c * d * p[k] + 3.0 * t * c * d * p[k + 1] - 3.0 * t * b * d * p[k + 2] + t * b * c * p[k + 3]
        rise = (
            -(3.0 * t * t - 12.0 * t + 11.0) * p[k]
            + 3.0 * (3.0 * t * t - 10.0 * t + 6.0) * p[k + 1]
            - 3.0 * (3.0 * t * t - 8.0 * t + 3.0) * p[k + 2]
            + (3.0 * t * t - 6.0 * t + 2.0) * p[k + 3]
        )
        return value / 6.0, rise / (6.0 * step)

    def crossing(k):
        """ln a between the points k and k + 1 where the signal is y (bisection, then secants)."""
        lo, hi, f_lo, f_hi, kept = first + step * k, first + step * (k + 1), ys[k] - y, ys[k + 1] - y, 0
        for _ in range(60):
            x = (lo * f_hi - hi * f_lo) / (f_hi - f_lo)
            f = cubic(ys, x)[0] - y
            if abs(hi - lo) < 1e-15 or abs(f) <= 1e-15 * abs(y):
                return x
            if (f > 0.0) == (f_hi > 0.0):
                hi, f_hi, f_lo, kept = x, f, f_lo * (0.5 if kept == 1 else 1.0), 1
            else:
                lo, f_lo, f_hi, kept = x, f, f_hi * (0.5 if kept == -1 else 1.0), -1
        return 0.5 * (lo + hi)

    crosses = [(ys[k] >= y) != (ys[k + 1] >= y) for k in range(last)]
    far = next((k for k in range(last - 1, peak - 1, -1) if crosses[k]), None)
    near = next((exp(crossing(k)) for k in range(peak - 1, -1, -1) if crosses[k]), 0.0)
    start, end, narrow = first + step * min(peak, last - 1), first + step * last, False
    if far is not None:
        x = crossing(far)
        deviation = sqrt(max(cubic(vs, x)[0], 0.0)) / abs(cubic(ys, x)[1])
        narrow = deviation < @WIDE
        if narrow:
            start, end = max(x - 6.0 * deviation, first + step * peak), min(x + 6.0 * deviation, end)
        if narrow and start >= near_end and end <= far_end:
            return OK, exp(x), near, 0.0, (exp(x) * deviation) ** 2
    grain = (end - start) / (@FINE - 1)
    places = [start + grain * k for k in range(@FINE)]
    spread = [sqrt(max(cubic(vs, p)[0], 0.0)) for p in places]
    off = [(cubic(ys, p)[0] - y) / sd for p, sd in zip(places, spread)]
    if far is None and min(map(abs, off)) > @FAR:
        return side["if_weak"] if ys[last] > y else side["if_strong"], 0.0, 0.0, 0.0, 0.0
    flat = [exp(-0.5 * t * t) / sd * exp(p) for t, sd, p in zip(off, spread, places)]
    beyond = [max(near_end - p, p - far_end, 0.0) / fades for p in places]
    faded = [f * exp(-0.5 * b * b) for f, b in zip(flat, beyond)]
    lo, middle, hi = (quantile(faded, start, grain, share) for share in QUANTILES)
    if narrow and hi > lo:
        p, q, r = (quantile(flat, start, grain, share) for share in QUANTILES)
        x += middle - q
        return OK, exp(x), near, 0.0, (exp(x) * deviation * (hi - lo) / (r - p)) ** 2
    if middle != middle:
        return side["if_weak"], 0.0, 0.0, 0.0, 0.0
    return OK, exp(middle), near, 0.0, (0.5 * (exp(hi) - exp(lo))) ** 2
