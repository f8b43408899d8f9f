

def series(c, y):
    """Sum of c[k] T_k(y) (Clenshaw), and its slope."""
    b1 = b2 = d1 = d2 = 0.0
    for x in reversed(c[1:]):
        b1, b2, d1, d2 = 2.0 * y * b1 - b2 + x, b1, 2.0 * b1 + 2.0 * y * d1 - d2, d1
    return c[0] + y * b1 - b2, b1 + y * d1 - d2


def root(c, target, lo, hi):
    """Where the series is `target`, between lo and hi."""
    rising = series(c, hi)[0] > target
    y = 0.5 * (lo + hi)
    for _ in range(80):
        value, slope = series(c, y)
        if (value > target) == rising:
            hi = y
        else:
            lo = y
        step = (value - target) / slope if slope else inf
        if abs(step) <= 4e-16 or hi - lo <= 4e-16:
            break
        y = y - step if lo < y - step < hi else 0.5 * (lo + hi)
    return y


def peak(c, lo, hi):
    """Where the slope vanishes, between lo, where the series rises, and hi, where it falls."""
    for _ in range(60):
        y = 0.5 * (lo + hi)
        if series(c, y)[1] > 0.0:
            lo = y
        else:
            hi = y
    return 0.5 * (lo + hi)


def by_pieces(side, drive, signal):
    """The farthest distance with this signal, and the next one."""
    strip = next((s for s in reversed(side["strips"]) if drive >= s[0]), side["strips"][0])
    start, end, pieces = strip
    z = min(max((2.0 * drive - (end + start)) / (end - start), -1.0), 1.0) if end > start else 0.0
    found = []
    below = weak = False
    over = 0.0

    def keep(y):
        found.append((middle * exp(half * y), y, half, c, variance))

    for i, (middle, half, scale, looks, value, variance) in enumerate(pieces):
        target = log(signal / (drive * scale))
        c = [series(row, z)[0] for row in value]
        y0 = 1.0
        e0, d0 = series(c, y0)
        if i == 0:
            below = e0 <= target
            weak, over = not below, e0 - target
            if weak and side["cut"]:
                return side["if_weak"], 0.0, 0.0, 0.0, 0.0
        for k in range(1, looks + 1):
            if len(found) >= 2:
                break
            y1 = 1.0 - 2.0 * k / looks
            e1, d1 = series(c, y1)
            if below != (e1 <= target):
                # Where rounding puts the end of one piece on another side than the next one's, the root is there.
                keep(root(c, target, y1, y0) if below == (e0 <= target) else y0)
                below = e1 <= target
            elif below and e0 < target and d0 < 0.0 < d1:
                top = peak(c, y1, y0)
                if series(c, top)[0] >= target:
                    keep(root(c, target, top, y0))
                    keep(root(c, target, y1, top))
            y0, e0, d0 = y1, e1, d1
        if len(found) >= 2:
            break
    if not found:
        return side["if_weak"] if weak else side["if_strong"], 0.0, 0.0, 0.0, 0.0
    a, y, half, c, variance = found[0]
    slope = series(c, y)[1] / (half * a)
    if len(found) > 1:
        near = found[1][0]
    else:
        near = a if slope > 0.0 and not (weak and over >= side["alone"]) else 0.0
    of_signal = 1.0 / (slope * slope) if slope else inf
    return OK, a, near, of_signal, series([series(row, z)[0] for row in variance], y)[0]
