"""Hard and random taps, as `vibrissa verify` draws them (src/census/hard.rs)."""

import numpy as np

import vibrissa

NAMES = ("D", "d", "L_a", "x_ss", "l", "a", "drive", "tilt", "lean")
BASE = dict(D=10.0, d=4.0, L_a=50.0, x_ss=5.0, l=2.0, a=33.0, drive=4.0)


def drawn(model, n, seed):
    """Whiskers and taps over wide ranges: d/D 0.05 … 1.3, contacts from the gauge's near end to the tip, a third of them next to the gauge, 0.01 … 20°."""
    u = np.random.default_rng(seed).random((8, n))
    k = np.arange(n)

    def log(i, low, high):
        return low * (high / low) ** u[i]

    length = 10 * log(0, 2, 20)
    place = np.where(k % 16 == 0, 0.0, log(1, 0.005, 0.7) * length)
    grid = log(2, 0.001, 0.2) * length
    near = np.where(k % 3 == 0, log(3, 1e-3, 0.3) * 2 * grid, u[3] * (length - place))
    a = np.clip(place + near, 2.5, length)
    tip = 10 * (0.05 + 1.25 * u[6])
    grid = np.minimum(grid, length - place)
    if "foil" in model:
        # Foils are long: whiskers that carry one.
        length, place, grid, tip = 40 + 100 * u[0], 4 + 6 * u[1], 1 + 3 * u[2], 3 + 9 * u[6]
        a = place + 3 + (length - place - 4) * u[3]
    angle = log(4, 0.01, 20)
    scale = 10 / (log(5, 0.03, 3) * a) if "hub" in model else np.ones(n)
    lengths = [scale * x for x in (np.full(n, 10.0), tip, length, place, grid, a)]
    drive = lengths[5] * np.radians(angle) if model.get("displaced") else angle
    return dict(zip(NAMES, [*lengths, drive, np.zeros(n), np.zeros(n)]))


def hard(model):
    """Every taper, contacts on and next to the gauge, near the peak of the curve and past the tip, tiny and huge drives, gauges and whiskers."""
    taps = [dict(d=d) for d in (10.0, 10 * (1 - 1e-7), 10 * (1 + 1e-7), 12.0)]
    taps += [dict(d=0.2, a=48.5, drive=1.0), dict(d=2.0, a=45.0, drive=10.0)]
    taps += [dict(d=d, drive=drive) for d, drive in ((4.0, 0.001), (10.0, 0.001), (4.0, 60.0), (10.0, 60.0), (7.0, 30.0))]
    x2 = 5 + 2 / np.sqrt(1 + 0.06 ** 2)
    for drive in (0.5, 4.0):
        places = (2.5, 5 * (1 - 1e-6), 5.0, 5 * (1 + 1e-6), 0.5 * (5 + x2), x2 * (1 - 1e-6), x2 * (1 + 1e-6), 9.6, 10.7)
        taps += [dict(a=a, drive=drive) for a in places]
        taps += [dict(a=share * 50, drive=drive) for share in (0.999, 1.0)]
    taps += [dict(l=0.01), dict(x_ss=0.0), dict(x_ss=0.0, l=0.01, a=0.5, drive=0.5)]
    if not any(key in model for key in ("hub", "pole_radius", "root", "bore", "core", "curvature", "foil")):
        taps += [{key: k * BASE[key] for key in ("D", "d", "L_a", "x_ss", "l", "a")} for k in (1e-3, 1e3)]
    columns = {name: np.array([{**BASE, **tap}.get(name, 0.0) for tap in taps]) for name in NAMES}
    if model.get("displaced"):
        columns["drive"] = columns["a"] * np.radians(np.minimum(columns["drive"], 45))
    return columns


def edge(model, keywords, kind):
    """Taps just before and after the drive at which the contact begins to slide."""
    if not isinstance(model.get("contact"), dict):
        return None
    found = []
    for d, a in ((4.0, 33.0), (10.0, 20.0)):
        most = a * np.radians(30) if model.get("displaced") else 30.0
        fixed = (BASE["D"], d, BASE["L_a"], BASE["x_ss"], BASE["l"], a)

        def holds(drive):
            return vibrissa.strain(*fixed, **{kind: drive}, full=True, **keywords).sticks

        low, high = 1e-3 * most, most
        if holds(low) == holds(high):
            continue
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if holds(middle) == holds(0.5 * low) else (low, middle)
        found += [(*fixed, low * k, 0.0, 0.0) for k in (0.99, 1 - 1e-6, 1 + 1e-6, 1.01)]
    return dict(zip(NAMES, np.array(found).T)) if found else None


def tilted(taps, seed):
    """Tilts within ±60° and leans within ±30°; the first six tiny, alone, or both large."""
    n = len(taps["a"])
    tilt, lean = np.random.default_rng(seed).uniform(-1, 1, (2, n)) * [[60], [30]]
    first = np.array([[1e-6, 0], [0, 1e-6], [45, 0], [0, -20], [70, 10], [-60, 30]])[:n].T
    tilt[:first.shape[1]], lean[:first.shape[1]] = first
    return {**taps, "tilt": tilt, "lean": lean}


def joined(parts):
    parts = [part for part in parts if part is not None]
    return {name: np.concatenate([part[name] for part in parts]) for name in NAMES}


def of(model, keywords, kind, n, seed=39):
    """`n` taps that have a strain: all hard ones, then random ones."""
    all_ = joined([hard(model), edge(model, keywords, kind), drawn(model, 4 * n + 200, seed)])
    if model.get("tilted"):
        all_ = tilted(all_, seed + 1)
    given = {kind if name == "drive" else name: column for name, column in all_.items() if name not in ("tilt", "lean") or model.get("tilted")}
    told = vibrissa.strain(**given, full=True, **keywords)
    sound = np.flatnonzero(np.isfinite(told.strain) & np.isfinite(told.normal_force_N))[:n]
    return {name: column[sound] for name, column in all_.items()}
