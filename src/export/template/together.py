"""
@COMMENT
"""

from math import exp, inf, isfinite, log, nan, sqrt

# What is returned: OK, or the sum of what there is to say.
OK = 0
NO_STRAIN = 1  # all signals are zero; no distance
STRAIN_LIMIT = 2  # above the strain limit of the gauge
NO_ROOT = 4  # no distance explains these signals together
AMBIGUOUS = 8  # a second distance in the range of interest explains them as well
OUTSIDE_CALIBRATION = 16  # the drive or a side was not calibrated (no distance), or the distance lies beyond
BAD_INPUT = 32  # too few arguments are finite numbers

WORDS = {
    NO_STRAIN: "no_strain",
    STRAIN_LIMIT: "strain_limit",
    NO_ROOT: "no_root",
    AMBIGUOUS: "ambiguous",
    OUTSIDE_CALIBRATION: "outside_calibration",
    BAD_INPUT: "bad_input",
}

# Signals of a reading, in order.
NAMES = [@NAMES]
# Covariance of their noise.
COVARIANCE = [@COVARIANCE]
# Of each channel: drive that counts as 0, zero of its signal, unit, factor of a quarter bridge or 0, and its sides: sign of the signal, ends of
# ln a and of the drive, calibrated distances, distances within which a second one is ambiguous, strain limit, Chebyshev series of signal/drive
# (rows over ln a), its variance on a grid of ln a and drive.
CHANNELS = [
@TABLES
]


def words(status):
    """The words of a status, joined by +, as `vibrissa locate` writes them."""
    return "+".join(word for bit, word in WORDS.items() if status & bit) or "ok"


def basis(n, x):
    """T_0(x) ... T_{n-1}(x) and their slopes."""
    t, d = [1.0, x], [0.0, 1.0]
    for k in range(2, n):
        t.append(2.0 * x * t[k - 1] - t[k - 2])
        d.append(2.0 * t[k - 1] + 2.0 * x * d[k - 1] - d[k - 2])
    return t[:n], d[:n]


def place(ends, x):
    return (2.0 * x - ends[0] - ends[1]) / (ends[1] - ends[0]) if ends[1] > ends[0] else 0.0


def expected(side, a, u):
    """Signal that is expected of a tap at a by the drive u from its origin, and its slopes."""
    ends, drives, rows = side["ln_a"], side["drives"], side["series"]
    t, dt = basis(len(rows), place(ends, log(a)))
    p, dp = basis(len(rows[0]), place(drives, u))
    over = [sum(c * q for c, q in zip(row, p)) for row in rows]
    v = sum(r * q for r, q in zip(over, t))
    v_a = sum(r * q for r, q in zip(over, dt))
    v_u = sum(q * sum(c * s for c, s in zip(row, dp)) for row, q in zip(rows, t))
    by_u = u * v_u * 2.0 / (drives[1] - drives[0]) if drives[1] > drives[0] else 0.0
    return u * v, u * v_a * 2.0 / ((ends[1] - ends[0]) * a), v + by_u


def left(side, a, u):
    """Variance of what is expected there."""
    grid = side["variance"]
    x = min(max((place(side["ln_a"], log(a)) + 1.0) / 2.0, 0.0), 1.0) * (len(grid) - 1)
    y = min(max((place(side["drives"], u) + 1.0) / 2.0, 0.0), 1.0) * (len(grid[0]) - 1)
    i, j = min(int(x), len(grid) - 2), min(int(y), len(grid[0]) - 2)
    x, y = x - i, y - j
    return (1.0 - x) * ((1.0 - y) * grid[i][j] + y * grid[i][j + 1]) + x * ((1.0 - y) * grid[i + 1][j] + y * grid[i + 1][j + 1])


def factor(noise):
    """Cholesky's factor of the covariance of noise; None where it is none."""
    rows = []
    for i, row in enumerate(noise):
        rows.append([])
        for j in range(i + 1):
            s = row[j] * (1.0 + @RIDGE if i == j else 1.0) - sum(rows[i][k] * rows[j][k] for k in range(j))
            if i == j and not s > 0.0:
                return None
            rows[i].append(sqrt(s) if i == j else s / rows[j][j])
    return rows


def misfit(tap, x):
    """Sum of the squares of residuals at x (distance, drive), each over its standard deviation, with the gradient and the normal matrix."""
    n, u = len(x), x[1] if len(x) == 2 else tap["drive"]
    white, gradient, normal = [], [0.0] * n, [[0.0] * n for _ in range(n)]
    for (side, origin, signal), row in zip(tap["used"], tap["factor"]):
        value, *by = expected(side, x[0], u - origin)
        r = [value - signal, *by]
        for f, other in zip(row, white):
            r = [p - f * q for p, q in zip(r, other)]
        r = [p / row[len(white)] for p in r]
        white.append(r)
        for m in range(n):
            gradient[m] += r[1 + m] * r[0]
            for k in range(n):
                normal[m][k] += r[1 + m] * r[1 + k]
    return sum(r[0] * r[0] for r in white), gradient, normal


def spread(normal):
    """Variance of the distance by the normal matrix; 0 where there is none."""
    if len(normal) == 1:
        return 1.0 / normal[0][0] if normal[0][0] > 0.0 else 0.0
    det = normal[0][0] * normal[1][1] - normal[0][1] * normal[1][0]
    return normal[1][1] / det if det > 1e-13 * normal[0][0] * normal[1][1] else 0.0


def settle(tap, x):
    """Goes from x to a least misfit (Levenberg, Marquardt); None at the ends of what is looked at."""
    chi, gradient, normal = misfit(tap, x)
    damping = 1e-3
    for _ in range(100):
        p = normal[0][0] * (1.0 + damping)
        lo, hi = tap["bounds"][1]
        # A drive that is pushed beyond an end stays there.
        if len(x) == 1 or (x[1] <= lo and gradient[1] > 0.0) or (x[1] >= hi and gradient[1] < 0.0):
            step = [gradient[0] / p if p else 0.0, 0.0]
        else:
            q = normal[1][1] * (1.0 + damping)
            det = p * q - normal[0][1] * normal[1][0]
            step = [(q * gradient[0] - normal[0][1] * gradient[1]) / det, (p * gradient[1] - normal[1][0] * gradient[0]) / det] if det else [0.0, 0.0]
        moved = [min(max(a - s, lo), hi) for a, s, (lo, hi) in zip(x, step, tap["bounds"])]
        if all(abs(b - a) <= 1e-12 * abs(a) for a, b in zip(x, moved)):
            break
        then = misfit(tap, moved)
        if then[0] <= chi:
            x, (chi, gradient, normal), damping = moved, then, damping / 10.0
        else:
            damping *= 10.0
            if damping > 1e12:
                break
    variance = spread(normal)
    lo, hi = tap["bounds"][0]
    return (chi, x, variance) if lo < x[0] < hi and variance > 0.0 and isfinite(chi) else None


def refined(tap, starts):
    """The least misfits that are reached from `starts`, the best first."""
    found = sorted(filter(None, (settle(tap, x) for x in starts)), key=lambda found: found[0])
    # Of several that fit equally well the farthest of the calibrated ones, or of all, comes first.
    nearest, farthest = tap["used"][0][0]["distances"]
    equal = [f for f in found if f[0] <= found[0][0] + @EQUAL]
    equal.sort(key=lambda f: (nearest <= f[1][0] <= farthest, f[1][0]), reverse=True)
    return equal[:1] + [f for f in found if f is not equal[0]]


def starts(tap):
    """Places of a grid that fit better than those beside them."""
    (lo, hi), (first, last) = tap["bounds"]
    every = []
    for i in range(@STARTS_A):
        a = lo + (hi - lo) * (i + 0.5) / @STARTS_A
        known = isfinite(tap["drive"])
        drives = [] if known else [first + (last - first) * (j + 0.5) / @STARTS_U for j in range(@STARTS_U)]
        every.append(min((misfit(tap, x)[0], x) for x in ([[a]] if known else [[a, u] for u in drives])))
    beside = [inf, *(e[0] for e in every), inf]
    return [x for k, (c, x) in enumerate(every) if c < inf and beside[k] >= c and beside[k + 2] >= c]


def locate(drive, signals, zeros=None):
    """Distance of the contact and its standard deviation, mm (None where there is none), a status, and the drive, from a tap by
    `drive` (@DRIVE; None or nan where it is not known: then it is found, too) and the signals of all channels in the order of NAMES; a signal that
    is nan is left out. `zeros` are the signals without contact; None stands for those of the calibration."""
@PREPARE
    drive = nan if drive is None else drive
    if any(x in (inf, -inf) for x in (drive, *signals)):
        return None, None, BAD_INPUT, None
    unknowns, status, used, read = 1 if isfinite(drive) else 2, OK, [], []
    for k, channel in enumerate(CHANNELS):
        y = signals[k] - (channel["zero"] if zeros is None else zeros[k])
        bridge = channel["bridge"]
        y = (4.0 * y / 1000.0 / (bridge * (1.0 - y / 500.0)) if y < 500.0 else nan) if bridge else y * channel["per"]
        read.append(y)
        if isfinite(y) and y != 0.0:
            side = next((s for s in channel["sides"] if (s["sign"] > 0) == (y > 0.0)), None)
            used.append((k, side, channel["origin"], y))
            if side and abs(y) > side["limit"]:
                status |= STRAIN_LIMIT
    if len(used) < unknowns:
        return None, None, NO_STRAIN if all(y == 0.0 for y in read) else BAD_INPUT, None
    # No tap pulls one channel to its one side and another to its other.
    if None not in [u[1] for u in used] and len({u[1]["gauge"] for u in used} - {-1}) > 1:
        return None, None, status | NO_ROOT, None
    bounds = [[0.0, inf], [0.0, inf]]
    for _, side, origin, _ in used:
        if side is None:
            return None, None, status | OUTSIDE_CALIBRATION, None
        u, (first, last) = drive - origin, side["drives"]
        if unknowns == 1 and not first * (1.0 - 1e-9) <= u <= last * (1.0 + 1e-9):
            return None, None, status | OUTSIDE_CALIBRATION, None
        for bound, ends in zip(bounds, ([exp(x) for x in side["ln_a"]], [first + origin, last + origin])):
            bound[:] = [max(bound[0], ends[0]), min(bound[1], ends[1])]
    noise = [[COVARIANCE[i][j] for j, *_ in used] for i, *_ in used]
    tap = {"drive": drive, "bounds": bounds, "used": [u[1:] for u in used], "factor": factor(noise)}
    if not (bounds[0][0] < bounds[0][1] and bounds[1][0] <= bounds[1][1]) or tap["factor"] is None:
        return None, None, status | OUTSIDE_CALIBRATION, None
    found = refined(tap, starts(tap))
    if not found:
        return None, None, status | NO_ROOT, None
    # With what the calibrations leave, where the tap is.
    at = found[0][1]
    for i, (side, origin, _) in enumerate(tap["used"]):
        noise[i][i] += left(side, at[0], (at[1] if unknowns == 2 else drive) - origin)
    tap["factor"] = factor(noise)
    found = refined(tap, [x for _, x, _ in found])
    if not found:
        return None, None, status | NO_ROOT, None
    chi, at, variance = found[0]
    at_end = unknowns == 2 and not bounds[1][0] < at[1] < bounds[1][1]
    freedom = len(used) - unknowns + at_end
    if freedom > 0 and chi > @CONTRADICTORY + 4.0 * freedom:
        return None, None, status | (OUTSIDE_CALIBRATION if at_end else NO_ROOT), None
    sigma = sqrt(variance) * (sqrt(chi / freedom) if freedom > 0 and chi > freedom else 1.0)
    side = used[0][1]
    near = next((x[0] for c, x, _ in found[1:] if c - chi < 1.0 and abs(x[0] - at[0]) > 3.0 * sigma), None)
    if near is not None and side["interest"][0] <= near <= side["interest"][1]:
        status |= AMBIGUOUS
    nearest, farthest = side["distances"]
    slack = min(@BEYOND * sigma, 0.5 * (farthest - nearest)) + side["rounding"]
    if at[0] < nearest - slack or at[0] > farthest + slack:
        status |= OUTSIDE_CALIBRATION
    if sigma > farthest - nearest:
        status |= AMBIGUOUS
    return at[0], sigma, status, at[1] if unknowns == 2 else drive


if __name__ == "__main__":
    # Lines of drive (empty where it is not known) and signals; commas between.
    import sys

    for line in sys.stdin:
        if line.strip():
            drive, *signals = [float(field) if field.strip() else nan for field in line.split(",")]
            distance, deviation, said, _ = locate(drive, signals)
            shown = ["" if x is None else repr(x) for x in (distance, deviation)]
            print(",".join(shown + [words(said)]))
