"""One tap of docs/model.md in complex numbers, written from its equations and from nothing of the program.

An input x that is moved to x + ih, h = 1e-30, moves what the tap shows by ih times its derivative, to every digit that there is (the complex step). The
rod is integrated from the contact to the clamp by Dormand and Prince's method of order 8 on fixed steps, the two or three unknowns follow by Newton's method.
"""

import cmath
import math
import os

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as dop

# Milliseconds a tap compiled, otherwise seconds.
try:
    if os.environ.get("VIBRISSA_UNCOMPILED"):
        raise ImportError
    from numba import njit, prange
except ImportError:
    prange = range

    def njit(**_):
        return lambda f: f

RK_A, RK_B, RK_C = np.ascontiguousarray(dop.A[:12, :12]), np.ascontiguousarray(dop.B), np.ascontiguousarray(dop.C[:12])
GAUSS_X, GAUSS_W = np.polynomial.legendre.leggauss(24)
H = 1e-30

# Numbers of a tap; lengths in mm, angles in rad.
NUMBERS = ("D", "d", "L_a", "x_ss", "l", "a", "tilt", "lean", "drive", "hub", "pole_radius", "mu", "nu", "E", "C10", "C01", "C20", "C30", "clamp",
           "foil.stiffness", "foil.length", "foil.width", "exponent", "inside", "core.modulus", "curvature", "curvature_slope", "root.k_theta", "root.k_y", "root.k_x",
           "s_0", "i_0", "s_1", "i_1")
(D, TIP, LENGTH, X_SS, GRID, A, TILT, LEAN, DRIVE, HUB, RHO, MU, NU, E, C10, C01, C20, C30, CLAMP, FOIL_S, FOIL_L, FOIL_W, EXPONENT, INSIDE, CORE, BASE, SLOPE,
 K_THETA, K_Y, K_X, S_0, I_0, S_1, I_1) = range(34)

# Switches of a model.
SWITCHES = ("displaced", "surface", "shear", "extension", "law", "far", "built", "power", "inner", "moment", "tilted", "clamp", "indentation", "distorting", "foil", "root",
            "linear", "second", "coulomb", "free")
(DISPLACED, SURFACE, SHEAR, EXTENSION, LAW, FAR, BUILT, POWER, INNER, MOMENT, TILTED, HELD, INDENTATION, DISTORTING, FOIL, ROOT, LINEAR, SECOND, COULOMB, FREE) = range(20)

OUTPUTS = 9
HOOKE, NEO, MOONEY, YEOH = range(4)


@njit(cache=True)
def law_of(p, w):
    """E₀, and C10, C01, C20, C30 of (16)."""
    zero = 0j
    if w[LAW] == HOOKE:
        return p[E], (zero, zero, zero, zero)
    if w[LAW] == NEO:
        return p[E], (p[E] / 6, zero, zero, zero)
    if w[LAW] == MOONEY:
        return 6 * (p[C10] + p[C01]), (p[C10], p[C01], zero, zero)
    return 6 * p[C10], (p[C10], zero, p[C20], p[C30])


@njit(cache=True)
def section(c, n, m, e0, k, most):
    """e₀ and κR under N/R² and M/R³, from a guess, in `most` steps at most (15)."""
    points = 24
    step = math.pi / (points + 1)
    for _ in range(most):
        rn, rm, nn, nk, mk = 0j, 0j, 0j, 0j, 0j
        for i in range(1, points + 1):
            y, weight = math.cos(step * i), 2 * step * math.sin(step * i) ** 2
            e = e0 + k * y
            inverse = 1 / (1 + e)
            g = e * (3 + 3 * e + e * e) * inverse * inverse
            j = e * e * (3 + e) * inverse
            v = c[0] + c[1] * inverse + j * (2 * c[2] + 3 * c[3] * j)
            s = weight * 2 * g * v
            t = weight * 2 * ((1 + 2 * inverse * inverse * inverse) * v + g * (2 * g * (2 * c[2] + 6 * c[3] * j) - c[1] * inverse * inverse))
            rn += s
            rm += s * y
            nn += t
            nk += t * y
            mk += t * y * y
        det = nn * mk - nk * nk
        de, dk = ((n - rn) * mk - (m - rm) * nk) / det, ((m - rm) * nn - (n - rn) * nk) / det
        e0, k = e0 + de, k + dk
        if abs(de) + abs(dk) <= 1e-13 * (abs(e0) + abs(k)):
            break
    return e0, k


@njit(cache=True)
def radius(p, w, s):
    if w[POWER]:
        return 0.5 * (p[TIP] + (p[D] - p[TIP]) * cmath.exp(p[EXPONENT] * cmath.log(1 - s / p[LENGTH])))
    return 0.5 * (p[D] - (p[D] - p[TIP]) / p[LENGTH] * s)


@njit(cache=True)
def steepness(p, w, s):
    """R′."""
    if w[POWER]:
        return -0.5 * (p[D] - p[TIP]) * p[EXPONENT] / p[LENGTH] * cmath.exp((p[EXPONENT] - 1) * cmath.log(1 - s / p[LENGTH]))
    return -0.5 * (p[D] - p[TIP]) / p[LENGTH]


@njit(cache=True)
def stiffness(p, w, s, within):
    """R, EA, EI and kGA of a section of Hooke's law (7.2), (7.3)."""
    r, e, nu = radius(p, w, s), law_of(p, w)[0], p[NU]
    if w[INNER] and p[S_0].real <= within <= p[S_1].real:
        i = p[I_0] + (p[I_1] - p[I_0]) * (s - p[S_0]) / (p[S_1] - p[S_0]) + p[INSIDE]
        g, q, t = p[CORE] / e, 0.75 + 0.5 * nu, i / (2 * r)
        t = t * t
        ea = math.pi * r * r * (e * (1 - t) + p[CORE] * t)
        ei = 0.25 * math.pi * r ** 4 * (e * (1 - t * t) + p[CORE] * t * t)
        ratio = -(1 - g) * q * (1 - t) / (1 + g - (1 - g) * t)
        b = ratio * t
        a = b - q
        j = a * (1 - t * t) / 4 + b * (1 - t) / 2 + (1 - t ** 3) / 24 + g * ((a + ratio) * t * t / 4 + t ** 3 / 24)
        return r, ea, ei, -e * ei * ei / (math.pi * e * e * r ** 6 * j)
    ea = e * math.pi * r * r
    return r, ea, 0.25 * ea * r * r, 6 * (1 + nu) / (7 + 6 * nu) * ea / (2 * (1 + nu))


@njit(cache=True)
def held(p, w):
    """c₀, k over that of §3, b and c of the clamp (§8 a); b is NaN for a clamp without it."""
    n = 0.5 - p[NU]
    nothing = complex(np.nan, 0)
    one = 1.011 / 0.9
    four = w[SHEAR] and w[FREE]
    if w[HELD] == 0:
        return 0j, 1.0, nothing, nothing
    if w[HELD] == 4:
        return p[CLAMP], one, nothing, nothing
    if w[HELD] == 3:
        return -0.358 + n * (-0.39 + 0.14 * n), one, nothing, nothing
    bonded = w[HELD] == 1
    moved = n * (-0.285 + 0.378 * n) if bonded else n * (-0.370 + 0.47 * n)
    if four:
        if bonded:
            return 0.0532 + moved, 1.1157 / 0.9, -0.7278 + 0j, -0.6836 + 0j
        return -0.028 + moved, 1.1157 / 0.9, -0.18 + 0j, -0.25 + 0j
    if w[SHEAR]:
        return (0.054 if bonded else -0.021) + moved, one, nothing, nothing
    return (0.0532 if bonded else -0.028) + moved, 1.0, nothing, nothing


@njit(cache=True)
def elliptic(m):
    a, b, total, power = 1 + 0j, cmath.sqrt(1 - m), 0.5 * m, 0.5
    for _ in range(9):
        c = 0.5 * (a - b)
        a, b = 0.5 * (a + b), cmath.sqrt(a * b)
        power *= 2
        total += power * c * c
    k = 0.5 * math.pi / a
    return k, k * (1 - total)


@njit(cache=True)
def crossed(r, q):
    """δ/(P/E*)^⅔ of Hertz's crossed cylinders (Johnson, Contact Mechanics, §4.2)."""
    ratio = r / q if r.real > q.real else q / r
    unit = (9 / (16 * cmath.sqrt(r * q))) ** (1 / 3)
    if ratio.real < 1 + 1e-6:
        return unit
    low, high = 1e-9, 1 - 1e-9
    for _ in range(60):
        s = math.sqrt(low * high)
        k, e = elliptic(1 - s * s + 0j)
        if ((e / (s * s) - k) / (k - e)).real > ratio.real:
            low = s
        else:
            high = s
    s = math.sqrt(low * high) + 0j
    for _ in range(6):
        value = [0j, 0j]
        for side in range(2):
            at = s if side == 0 else s + 1e-20j
            k, e = elliptic(1 - at * at)
            value[side] = cmath.log((e / (at * at) - k) / (k - e) / ratio)
        k, e = elliptic(1 - s * s)
        slope = (value[1] - value[0]).imag / 1e-20
        s = s - value[0] / slope
    k, e = elliptic(1 - s * s)
    f1 = (4 / (math.pi * (1 - s * s)) * s ** 1.5 * cmath.sqrt((e / (s * s) - k) * (k - e))) ** (1 / 3)
    return unit * 2 / math.pi * cmath.sqrt(s) / f1 * k


@njit(cache=True)
def gives_way(p, w, force):
    """δ of the contact along its normal, mm (§8 a, c)."""
    e = law_of(p, w)[0]
    c0, factor, b, c = held(p, w)
    t = 0.5 * (p[D] - p[TIP]) / p[LENGTH]
    linear, hertz, r = 0j, 0j, radius(p, w, p[A])
    if not math.isnan(b.real):
        compliance = (7 + 6 * p[NU]) / (6 * (1 + p[NU]) * factor) * 2 * (1 + p[NU]) / e
        near, far = radius(p, w, b * p[D]), radius(p, w, c0 * p[D])
        linear += (c0 - b) * p[D] / (math.pi * near * far) * compliance / (1 + t * t) + c / (e * r)
    if w[INDENTATION]:
        hertz = crossed(r, p[RHO]) * (e / (1 - p[NU] ** 2)) ** (-2 / 3)
        linear -= 0.185 / (e * r)
    return hertz * (force * force) ** (1 / 3) + linear * force


@njit(cache=True)
def foiled(p, w, x1, x2):
    """Span, T and χ of a foil (§8 d)."""
    e = law_of(p, w)[0]
    t = 0.5 * (p[D] - p[TIP]) / p[LENGTH]
    middle, length = 0.5 * (x1 + x2), p[FOIL_L]
    half, r = 0.5 * length / cmath.sqrt(1 + t * t), radius(p, w, middle)
    y, q, u = cmath.log(p[FOIL_S] / (e * length)) / math.log(10.0), cmath.log(length / (0.63 * p[D])), t * length / r
    power = (-1.0578 + 0.0075 * y + 0.1299 * y * y + 0.0304 * y ** 3 - 0.0008 * y ** 4 + 0.2012 * q - 0.42 * q * q + 0.0449 * q * y + 0.0458 * q * y * y
             - 0.3125 * u + 0.2399 * u * y - 0.4013 * u * q)
    width = cmath.log(p[FOIL_W] / (0.28 * p[D]))
    transfer = 1 / (1 + p[FOIL_S] / (e * length * cmath.exp(power)) * cmath.exp(0.6 * width))
    z, own = length / r, 0.5 - 0.29 * q + 0.06 * width
    if own.real < 0:
        own = 0j
    if own.real > 1:
        own = 1 + 0j
    chi = (0.229 * z - 0.008 - 0.0216 * z * z) * (1 - transfer) * (1 - 0.065 * transfer + 0.393 * transfer * transfer) * (1 + 1.446 * t) * cmath.exp(own * width)
    return middle - half, middle + half, transfer, chi


@njit(cache=True)
def grid(p, w):
    """x1 and x2."""
    x1 = p[X_SS]
    if not w[POWER]:
        t = 0.5 * (p[D] - p[TIP]) / p[LENGTH]
        return x1, x1 + p[GRID] / cmath.sqrt(1 + t * t)
    x2 = x1 + p[GRID]
    for _ in range(12):
        along = 0j
        for i in range(len(GAUSS_X)):
            s = 0.5 * (x1 + x2) + 0.5 * (x2 - x1) * GAUSS_X[i]
            along += 0.5 * (x2 - x1) * GAUSS_W[i] * cmath.sqrt(1 + steepness(p, w, s) ** 2)
        x2 += (p[GRID] - along) / cmath.sqrt(1 + steepness(p, w, x2) ** 2)
    return x1, x2


@njit(cache=True)
def at_rest(p, s):
    """ψ₀ and r₀ (7.4)."""
    x, y = 0j, 0j
    for i in range(len(GAUSS_X)):
        v = 0.5 * s * (1 + GAUSS_X[i])
        psi = -(p[BASE] + 0.5 * p[SLOPE] * v) * v
        x += 0.5 * s * GAUSS_W[i] * cmath.cos(psi)
        y += 0.5 * s * GAUSS_W[i] * cmath.sin(psi)
    return -(p[BASE] + 0.5 * p[SLOPE] * s) * s, x, y


@njit(cache=True)
def leaning(p, w, s):
    """sin α and cos α of a contact at `s`."""
    if not w[SURFACE]:
        return 0j, 1 + 0j
    tan = -steepness(p, w, s) / (1 + (p[BASE] + p[SLOPE] * s) * radius(p, w, s))
    cos = 1 / cmath.sqrt(1 + tan * tan)
    return tan * cos, cos


@njit(cache=True)
def edges(p, w, start, end, x1, x2):
    """Places from `end` down to `start` between which all is smooth."""
    places = np.empty(10, np.complex128)
    places[0] = end
    n = 1
    candidates = [x1, x2, p[S_0], p[S_1], start, start]
    if w[FOIL]:
        candidates[4], candidates[5] = foiled(p, w, x1, x2)[:2]
    for k in range(6):
        x = candidates[k]
        used = k < 2 or w[INNER] if k < 4 else w[FOIL]
        if used and x.real >= start.real and x.real < end.real:
            places[n] = x
            n += 1
    places[n] = start
    n += 1
    for i in range(1, n):
        for j in range(i, 0, -1):
            if places[j].real > places[j - 1].real:
                places[j], places[j - 1] = places[j - 1], places[j]
    return places[:n]


@njit(cache=True)
def shares(p, w, near, far, end, fine):
    """Shares of a piece at which its steps end: shorter where the whisker is thin."""
    one, two = radius(p, w, near).real, radius(p, w, far).real
    turn = abs(math.log(two / one))
    n = 8 * abs(far.real - near.real) / end + 6 * turn
    if w[POWER]:
        n = 30 * abs(far.real - near.real) / end + 6 * turn
    if w[DISTORTING]:
        n = max(n, min(abs(far.real - near.real) / (0.1 * p[D].real), 24))
    # Rounded up before refining, so that a refinement by 1.5 always adds steps.
    n = math.ceil(fine * max(math.ceil(n), 2))
    found = np.empty(n + 1)
    for j in range(n + 1):
        found[j] = j / n
        if turn > 0.1 and not w[POWER]:
            found[j] = (one * (two / one) ** (j / n) - one) / (two - one)
    found[0], found[n] = 0.0, 1.0
    return found


@njit(cache=True)
def shoot(p, w, z, sticks, fine, kept, most):
    """Residuals of the equilibrium for the unknowns `z` (P, c or T, φ), and the outputs of the tap. `kept`: strains of the sections, from the last try."""
    lacks, shows = np.zeros(3, np.complex128), np.zeros(OUTPUTS, np.complex128)
    force = z[0]
    c = p[A] if sticks else z[1]
    friction = 0j
    if sticks:
        friction = z[1]
    elif w[COULOMB]:
        friction = p[MU] * force * w[COULOMB]
    sin, cos = leaning(p, w, c)
    fx, fy = -force * sin + friction * cos, -force * cos - friction * sin
    height = radius(p, w, c) if w[SURFACE] else 0j
    e0_, law = law_of(p, w)
    c0, factor = held(p, w)[:2]
    start = c0 * p[D]
    x1, x2 = grid(p, w)
    span, transfer, chi = (0j, 0j), 1 + 0j, 0j
    if w[FOIL]:
        low, high, transfer, chi = foiled(p, w, x1, x2)
        span = (low, high)
    t = 0.5 * (p[D] - p[TIP]) / p[LENGTH]
    psi, x, y, axial, bending = 0j, 0j, 0j, 0j, 0j
    places = edges(p, w, start, c, x1, x2)
    slope = np.empty((12, 5), np.complex128)
    at, last0, last1 = 0, 0j, 0j
    for piece in range(len(places) - 1):
        near, far = places[piece], places[piece + 1]
        if near.real == far.real and near.imag == far.imag:
            continue
        inside = 0.5 * (near.real + far.real)
        read = x1.real < inside < x2.real
        stiff = 1 - chi if w[FOIL] and span[0].real < inside < span[1].real else 1 + 0j
        ends = shares(p, w, near, far, c.real, fine)
        for k in range(len(ends) - 1):
            s0, h = near + (far - near) * ends[k], (far - near) * (ends[k + 1] - ends[k])
            for i in range(12):
                ps, xs, ys = psi, x, y
                for j in range(i):
                    ps += h * RK_A[i, j] * slope[j, 0]
                    xs += h * RK_A[i, j] * slope[j, 1]
                    ys += h * RK_A[i, j] * slope[j, 2]
                s = s0 + RK_C[i] * h
                cp, sp = cmath.cos(ps), cmath.sin(ps)
                pull, across = fx * cp + fy * sp, -fx * sp + fy * cp
                moment = -xs * fy - (height - ys) * fx
                r = radius(p, w, s)
                gamma = 0j
                if w[LAW] == HOOKE:
                    if w[BUILT]:
                        r, ea, ei, kga = stiffness(p, w, s, inside)
                        e0, k_ = pull / ea, moment * r / ei
                        if w[SHEAR]:
                            gamma = across / kga
                    else:
                        e0, k_ = pull / (e0_ * math.pi * r * r), 4 * moment / (e0_ * math.pi * r * r * r)
                    if not w[EXTENSION]:
                        e0 = 0j
                else:
                    if not math.isnan(kept[at, 0].real):
                        last0, last1 = kept[at, 0], kept[at, 1]
                    n = pull / (r * r) if w[EXTENSION] else 0j
                    e0, k_ = section(law, n, moment / (r * r * r), last0, last1, most)
                    last0, last1 = e0, k_
                    kept[at, 0], kept[at, 1] = complex(e0.real, 0), complex(k_.real, 0)
                    at += 1
                if w[SHEAR] and not (w[BUILT] and w[LAW] == HOOKE):
                    gamma = across * (7 + 6 * p[NU]) / (3 * factor * e0_ * math.pi * r * r)
                stretch = 1 + e0 if w[EXTENSION] else 1 + 0j
                slope[i, 0] = k_ / r * stiff - (p[BASE] + p[SLOPE] * s)
                slope[i, 1], slope[i, 2] = stretch * cp - gamma * sp, stretch * sp + gamma * cp
                if w[DISTORTING]:
                    near_ = cmath.exp(-7.137 * s / p[D])
                    slope[i, 3] = e0 - (0.1375 * k_ * k_ if w[LAW] != HOOKE else 0j)
                    slope[i, 4] = -k_ * (1 - 0.576 * near_ - 0.0084 * t * t) - across * 4 / (math.pi * e0_ * r * r * r) * (-0.1616 * p[D] * near_ + 0.5508 * t * r)
                else:
                    slope[i, 3], slope[i, 4] = e0, -k_
            for i in range(12):
                psi += h * RK_B[i] * slope[i, 0]
                x += h * RK_B[i] * slope[i, 1]
                y += h * RK_B[i] * slope[i, 2]
                if read:
                    axial -= h * RK_B[i] * slope[i, 3]
                    bending -= h * RK_B[i] * slope[i, 4]
    # Closure: the contact must lie at the pole.
    rest = at_rest(p, p[A])
    moment = -x * fy - (height - y) * fx
    omega, u, v = -psi, 0j, 0j
    if w[ROOT]:
        omega = moment / p[K_THETA] - psi
    ox, oy = cmath.cos(omega), cmath.sin(omega)
    if w[ROOT]:
        u, v = (ox * fx - oy * fy) / p[K_X], (oy * fx + ox * fy) / p[K_Y]
    rho = p[RHO]
    if w[INDENTATION] or w[HELD]:
        rho = rho - gives_way(p, w, force)
    qx, qy = rho * sin - x, height + rho * cos - y
    qx, qy = u + ox * qx - oy * qy + start, v + oy * qx + ox * qy
    sin0, cos0 = leaning(p, w, p[A])
    cr, sr = cmath.cos(rest[0]), cmath.sin(rest[0])
    high = radius(p, w, p[A]) if w[SURFACE] else 0j
    hub = 0j if w[DISPLACED] else p[HUB]
    turn = 0j if w[DISPLACED] else p[DRIVE]
    ct, st = cmath.cos(turn), cmath.sin(turn)
    phi, slide = z[2], 0j
    if w[TILTED] and not sticks:
        # (27), (28) in the frame t₀, y₁, z.
        cb, sb, cg, sg = cmath.cos(p[TILT]), cmath.sin(p[TILT]), cmath.cos(p[LEAN]), cmath.sin(p[LEAN])
        ax, out = p[A] + hub + p[RHO] * sin0, high + p[RHO] * cos0
        ay, az = out * cb, out * sb
        ux, uy, uz = sg * cos0, -cg * sb - sg * sin0 * cb, cg * cb - sg * sin0 * sb
        ax, ay = ax * ct + ay * st, -ax * st + ay * ct
        ux, uy = ux * ct + uy * st, -ux * st + uy * ct
        if w[DISPLACED]:
            ay = ay - p[DRIVE]
        cf, sf = cmath.cos(phi), cmath.sin(phi)
        slide = -(-ay * sf + az * cf) / (-uy * sf + uz * cf)
        gx, gm = ax + slide * ux, (ay + slide * uy) * cf + (az + slide * uz) * sf
        lacks[0], lacks[1] = qx + hub - gx, qy - gm
        s_, c_ = cmath.sin(psi), cmath.cos(psi)
        lacks[2] = (s_ * cos + c_ * sin) * ux + (c_ * cos - s_ * sin) * (uy * cf + uz * sf)
    else:
        bx, by = rest[1] - high * sr + p[RHO] * (sin0 * cr - cos0 * sr), rest[2] + high * cr + p[RHO] * (cos0 * cr + sin0 * sr)
        if w[DISPLACED]:
            by = by - p[DRIVE]
        bx, by = (bx + hub) * ct + by * st - hub, -(bx + hub) * st + by * ct
        lacks[0], lacks[1], lacks[2] = qx - bx, qy - by, phi
    width, sign = x2 - x1, -1.0 if w[FAR] else 1.0
    axial, bending = transfer * axial / width, sign * transfer * bending / width
    if w[MOMENT]:
        shows[0] = moment
    else:
        shows[0] = axial + bending * (cmath.cos(phi) if w[SECOND] else 1 + 0j)
    shows[6] = axial + bending * cmath.sin(phi)
    shows[3], shows[4], shows[5] = force, friction, c
    shows[7], shows[8] = phi * 180 / math.pi, slide
    return lacks, shows


@njit(cache=True)
def theory(p, w):
    """θ f of (5), or of (7.7) where the whisker is built."""
    x1, x2 = grid(p, w)
    a, hub = p[A], 0j if w[DISPLACED] else p[HUB]
    sign = -1.0 if w[FAR] else 1.0
    if not w[BUILT]:
        tau = (p[D] - p[TIP]) / (p[D] * p[LENGTH])
        r1 = (a - x1) / (1 - tau * x1) if a.real > x1.real else 0j
        r2 = (a - x2) / (1 - tau * x2) if a.real > x2.real else 0j
        lever = 1 / a if w[DISPLACED] else (a + hub) / a
        return sign * p[DRIVE] * 0.75 * p[D] / (a * a) * lever * (r1 - r2) * (r1 + r2) / (x2 - x1)
    psi, hx, hy = at_rest(p, a)
    nx, ny = -cmath.sin(psi), cmath.cos(psi)
    lever = ny if w[DISPLACED] else (hx + hub) * ny - hy * nx
    work, mean = 0j, 0j
    places = edges(p, w, 0j, a, x1, x2)
    for piece in range(len(places) - 1):
        near, far = places[piece], places[piece + 1]
        inside = 0.5 * (near.real + far.real)
        ends = shares(p, w, near, far, a.real, 1.0)
        for k in range(len(ends) - 1):
            s0, h = near + (far - near) * ends[k], (far - near) * (ends[k] - ends[k + 1])
            for i in range(len(GAUSS_X)):
                s = s0 - 0.5 * h * (1 + GAUSS_X[i])
                _, x, y = at_rest(p, s)
                r, _, ei, _ = stiffness(p, w, s, inside)
                m = (hx - x) * ny - (hy - y) * nx
                work += 0.5 * h * GAUSS_W[i] * m * m / ei
                if x1.real < inside < x2.real:
                    mean += 0.5 * h * GAUSS_W[i] * m * r / ei
    m0 = hx * ny - hy * nx
    if w[ROOT]:
        work += m0 * m0 / p[K_THETA] + ny * ny / p[K_Y] + nx * nx / p[K_X]
    if w[MOMENT]:
        return -p[DRIVE] * lever / work * m0
    return sign * p[DRIVE] * lever / work * mean / (x2 - x1)


@njit(cache=True)
def closed(p, w):
    """A tap of linear theory (4), (7), (33): what it shows."""
    shows = np.zeros(OUTPUTS, np.complex128)
    a, tau = p[A], (p[D] - p[TIP]) / (p[D] * p[LENGTH])
    shear = 1 + (7 + 6 * p[NU]) / 16 * p[D] * p[D] / (a * a) if w[SHEAR] else 1 + 0j
    strain = theory(p, w) / shear
    reach = 1 + 0j if w[DISPLACED] else a + p[HUB]
    force = p[DRIVE] * reach * 3 * math.pi * p[E] * p[D] ** 4 * (1 - tau * a) / (64 * a ** 3) / shear
    # K contains shear only.
    shows[2], shows[5] = shear - 1, a
    shows[0], shows[3] = strain, force
    if w[TILTED]:
        cb, sb = cmath.cos(p[TILT]), cmath.sin(p[TILT])
        shows[0], shows[3], shows[6] = strain * cb * cb, force * cb, strain * cb * sb
        shows[7], shows[8] = p[TILT] * 180 / math.pi, -p[DRIVE] * reach * sb / cmath.cos(p[LEAN])
    return shows


@njit(cache=True)
def finish(p, w, shows):
    """The linear strain and K − 1."""
    shows[1] = theory(p, w)
    if shows[0].real == 0:
        shows[2] = complex(np.nan, 0)
    elif w[LINEAR]:
        pass
    elif w[SECOND]:
        shows[2] = shows[1] * shows[0] / (shows[0] ** 2 + shows[6] ** 2) - 1
    else:
        shows[2] = shows[1] / shows[0] - 1
    return shows


@njit(cache=True)
def invert(j, count, lacks):
    """The Newton step for a Jacobian."""
    m = np.empty((count, count))
    b = np.empty(count)
    for i in range(count):
        b[i] = -lacks[i]
        for k in range(count):
            m[i, k] = j[i, k]
    return np.linalg.solve(m, b)


@njit(cache=True)
def one(p, w, units, inputs, begin, sticks, fine, values, slopes):
    """Value and derivatives of one tap, and the sizes of its last step and closure error."""
    if w[LINEAR]:
        values[:] = finish(p, w, closed(p, w)).real
        for k in range(len(inputs)):
            moved = p.copy()
            moved[inputs[k]] += units[k] * H * 1j
            slopes[k] = finish(moved, w, closed(moved, w)).imag / H
        return 0.0
    count = 3 if w[TILTED] and not sticks else 2
    kept = np.full((4000 if w[LAW] != HOOKE else 1, 2), complex(np.nan, 0))
    z = begin.astype(np.complex128)
    if count == 2:
        z[2] = 0
    jacobian = np.zeros((3, 3))
    size = 1.0
    for turn in range(12):
        if turn < 2 or size < 1e-9 or turn == 6:
            for k in range(count):
                moved = z.copy()
                moved[k] += H * 1j
                jacobian[:, k] = shoot(p, w, moved, sticks, fine, kept, 40 if turn == 0 else 3)[0].imag / H
        lacks, shows = shoot(p, w, z, sticks, fine, kept, 6)
        step = invert(jacobian, count, lacks.real)
        before, size = size, 0.0
        for k in range(count):
            scale = abs(z[k]) if k == 0 or not sticks else abs(z[0]) + abs(z[1])
            if k == 2:
                scale = 1.0
            size = max(size, abs(step[k]) / max(scale, 1e-300))
        if turn > 3 and size < 1e-7 and size > 0.3 * before:
            break
        for k in range(count):
            z[k] += step[k]
    _, shows = shoot(p, w, z, sticks, fine, kept, 6)
    values[:] = finish(p, w, shows).real
    for k in range(len(inputs)):
        moved = p.copy()
        moved[inputs[k]] += units[k] * H * 1j
        lacks = shoot(moved, w, z, sticks, fine, kept, 1)[0].imag / H
        step = invert(jacobian, count, lacks)
        goes = z.copy()
        for i in range(count):
            goes[i] += step[i] * H * 1j
        lacks, shows = shoot(moved, w, goes, sticks, fine, kept, 1)
        slopes[k] = finish(moved, w, shows).imag / H
    return size


@njit(cache=True, parallel=True)
def many(p, w, units, inputs, begin, sticks, fine):
    """`one` for many taps: a row of `p`, `w`, `begin` each."""
    n = len(p)
    values, slopes, sizes = np.empty((n, OUTPUTS)), np.empty((n, len(inputs), OUTPUTS)), np.empty(n)
    for i in prange(n):
        sizes[i] = one(p[i], w[i], units, inputs, begin[i], sticks[i], fine, values[i], slopes[i])
    return values, slopes, sizes
