
# Drives of the taps of one object that `locate_taps` answers together.
TAPS = @DRIVES


def through(values, t):
    """The polynomial through some values at 0, 1, ..., at t, and its slope."""
    n, value, slope = range(len(values)), 0.0, 0.0
    for i in n:
        weight, rise = 1.0, 0.0
        for j in n:
            if j != i:
                weight *= (t - j) / (i - j)
                part = 1.0 / (i - j)
                for m in n:
                    part *= (t - m) / (i - m) if m not in (i, j) else 1.0
                rise += part
        value, slope = value + weight * values[i], slope + rise * values[i]
    return value, slope


def by_taps(side, ys):
    """The distance that taps tell together, its standard deviation, the next one that fits (0: none) and by how many standard
    deviations the farthest tap is off the others; None where nothing is likely."""
    first, step, near_end, far_end = side["learned"][:4]
    signals, heights, roots = side["together"]
    n, last, points = len(ys), len(heights) - 1, range(len(heights))

    def at(k):
        off = [y - m for y, m in zip(ys, signals[k])]
        rows = ([roots[k][i * (i + 1) // 2 + j] for j in range(i + 1)] for i in range(n))
        return heights[k] - 0.5 * sum(sum(r * o for r, o in zip(row, off)) ** 2 for row in rows)

    def near(x):
        s = min(max((x - first) / step, 0.0), float(last))
        k = min(max(int(s) + 1 - @NEAR // 2, 0), last + 1 - @NEAR)
        return k, s - k

    h, modes = [at(k) for k in points], []
    # Where it is highest, by parabolas through three points.
    for k in points:
        if (k > 0 and h[k] <= h[k - 1]) or (k < last and h[k] < h[k + 1]):
            continue
        m = min(max(k, 1), last - 1)
        slope, bend = 0.5 * (h[m + 1] - h[m - 1]), 2.0 * h[m] - h[m - 1] - h[m + 1]
        t = min(max(slope / bend, -1.0), 1.0) if bend > 0.0 else k - m
        found = (first + step * (m + t), step / sqrt(bend) if bend > 0.0 else inf, h[m] + slope * t - 0.5 * bend * t * t)
        modes += [found] if isfinite(found[2]) else []
    if not modes:
        return None
    top, shares = max(m[2] for m in modes), []
    for i, (x, sd, height) in enumerate(modes):
        if sd < 2.0 * step:
            shares.append((x, sd, exp(height - top) * sd * @ROOT_TAU))
            continue
        lower = 0.5 * (x + modes[i - 1][0]) if i > 0 else first
        upper = 0.5 * (x + modes[i + 1][0]) if i + 1 < len(modes) else first + step * (last + 1)
        own = [(first + step * k - x, exp(h[k] - top)) for k in points if lower <= first + step * k <= upper]
        mass = sum(p for _, p in own)
        mean = sum(d * p for d, p in own) / mass if mass else 0.0
        variance = sum(d * d * p for d, p in own) / mass - mean * mean if mass else 0.0
        shares.append((x, sqrt(variance) if variance > 0.0 else step, mass * step))
    total = sum(s for _, _, s in shares)
    likely = [i for i, m in reversed(list(enumerate(shares))) if m[2] >= @SECOND * total]
    if not likely:
        return None
    best = likely[0]
    others = [shares[i] for i in likely[1:]]
    other = exp(max(others, key=lambda m: m[2])[0]) if others else 0.0
    x, sd = shares[best][:2]
    if (x < first + 0.5 * step and x < near_end - step) or (x > first + step * (last - 0.5) and x > far_end + step):
        return None  # what is most likely lies beyond the table
    middles = [(i, 0.5 * (m[0] + x)) for i, m in enumerate(shares) if m[2] > @NONE * total and i != best]
    lower = max([first, x - @WINDOW * sd] + [m for i, m in middles if i < best])
    upper = min([first + step * last, x + @WINDOW * sd] + [m for i, m in middles if i > best])
    grain = (upper - lower) / (@FINE - 1)
    places = [near(lower + grain * k) for k in range(@FINE)]
    fine = [through(h[k : k + @NEAR], t)[0] for k, t in places]
    top = max(fine)
    lo, middle, hi = (quantile([exp(f - top) for f in fine], lower, grain, share) for share in QUANTILES)
    if not (isfinite(middle) and hi > lo):
        return None
    # Each tap beside the others, the distance free.
    k, t = near(middle)
    told = [through([signals[k + i][j] for i in range(@NEAR)], t) for j in range(n)]
    off, slopes = [y - m[0] for y, m in zip(ys, told)], [m[1] / step for m in told]
    root = roots[min(k + int(t + 0.5), last)]
    w = [[sum(root[m * (m + 1) // 2 + i] * root[m * (m + 1) // 2 + j] for m in range(max(i, j), n)) for j in range(n)] for i in range(n)]
    wg = [sum(a * g for a, g in zip(row, slopes)) for row in w]
    gwg = sum(a * g for a, g in zip(wg, slopes)) + 1.0 / @FREE**2
    along = sum(a * o for a, o in zip(wg, off))
    zs = [
        abs(sum(a * o for a, o in zip(w[i], off)) - wg[i] * along / gwg) / sqrt(max(w[i][i] - wg[i] ** 2 / gwg, 1e-300))
        for i in range(n)
    ]
    return exp(middle), 0.5 * (exp(hi) - exp(lo)), other, max(zs)


def locate_taps(signals, zero=ZERO):
    """What the taps of one object by the drives TAPS, in this order, tell together: as `locate`. Each must have a distance of its own."""
    told, kept = [], None
    if len(signals) != len(TAPS):
        return None, None, BAD_INPUT
    for drive, signal in zip(TAPS, signals):
        distance, _, said = locate(drive, signal, zero)
        if distance is None:
            return None, None, said
        signal = above(signal, zero)
        side = next(s for s in SIDES if (signal > 0.0) == (s["sign"] > 0))
        if "together" not in side:
            return None, None, OUTSIDE_CALIBRATION
        if kept is not None and kept is not side:
            return None, None, INCONSISTENT
        kept = side
        told.append(abs(signal) - side["learned"][6])
    found = by_taps(kept, told)
    if found is None:
        return None, None, NO_ROOT
    a, sigma, near, apart = found
    return a, sigma, doubts(kept, a, near, sigma) | (INCONSISTENT if apart > @APART else OK)

