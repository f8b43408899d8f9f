

def direct(side, drive, signal):
    """The distance as a polynomial of ln signal and the drive."""
    p = side["polynomial"]
    u = log(signal / p["middle"]) / p["half"]
    v = ((log(drive) if p["log_drive"] else drive) - p["drive_middle"]) / p["drive_half"]
    powers = [(i, j) for i in range(p["degree"] + 1) for j in range(min(p["drive_degree"], p["degree"] - i) + 1)]
    terms = [u**i * v**j for i, j in powers]
    a = sum(c * t for c, t in zip(p["coefficients"], terms))
    slope = sum(c * i * u ** (i - 1) * v**j for c, (i, j) in zip(p["coefficients"], powers) if i) / p["half"]
    variance = sum(t * sum(c * s for c, s in zip(row, terms)) for t, row in zip(terms, p["covariance"]))
    a = exp(min(a, 700.0)) if p["log_a"] else a
    per = a if p["log_a"] else 1.0
    slope *= per
    if not (p["reach"][0] <= a <= p["reach"][1] and slope * p["sign"] > 0.0):
        return OUTSIDE_CALIBRATION, 0.0, 0.0, 0.0, 0.0
    return OK, a, 0.0, slope * slope, variance * per * per / (slope * slope)
