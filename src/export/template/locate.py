"""
@COMMENT
"""

from math import exp, inf, isfinite, log@MORE, sqrt

# What is returned: OK, or the sum of what there is to say.
OK = 0
NO_STRAIN = 1  # the signal is zero; no distance
STRAIN_LIMIT = 2  # above the strain limit of the gauge; without a distance: the sensor is at its end stop
NO_ROOT = 4  # no distance gives this signal: it is above the peak
AMBIGUOUS = 8  # a second distance in the range of interest gives it too; the farther one is given
OUTSIDE_CALIBRATION = 16  # the drive or the side was not calibrated (no distance), or the distance lies beyond
BAD_INPUT = 32  # an argument is no finite number
INCONSISTENT = 64  # taps of one object contradict each other

WORDS = {
    NO_STRAIN: "no_strain",
    STRAIN_LIMIT: "strain_limit",
    NO_ROOT: "no_root",
    AMBIGUOUS: "ambiguous",
    OUTSIDE_CALIBRATION: "outside_calibration",
    BAD_INPUT: "bad_input",
    INCONSISTENT: "inconsistent",
}

# The zero of the calibration's own signal where it is known, else 0: for taps whose zero was not read.
ZERO = @ZERO
# Standard deviation of one reading.
NOISE = @NOISE

@TABLES


def words(status):
    """The words of a status, joined by +, as `vibrissa locate` writes them."""
    return "+".join(word for bit, word in WORDS.items() if status & bit) or "ok"


def strain(value):
    """Strain of a recorded value; a reading in a unit of its own stays as it is."""
    return @STRAIN


def above(signal, zero):
    """The signal without its zero."""
    return @ABOVE
@FINDERS

def doubts(side, a, near, sigma):
    """What there is to say of a distance."""
    status = AMBIGUOUS if side["interest"][0] <= near <= side["interest"][1] else OK
    nearest, farthest = side["distances"]
    slack = min(@BEYOND * sigma, 0.5 * (farthest - nearest)) + side["rounding"]
    return status | (OUTSIDE_CALIBRATION if a < nearest - slack or a > farthest + slack else OK)


def locate(drive, signal, zero=ZERO):
    """Distance of the contact and its standard deviation, mm (None where there is none), and a status, from a tap by
    `drive` (@DRIVE) and its signal (@UNIT); `zero` is the signal without contact."""
@PREPARE
    if not (isfinite(drive) and isfinite(signal)):
        return None, None, BAD_INPUT
    signal = above(signal, zero)
    if not isfinite(signal):
        return None, None, BAD_INPUT
    if signal == 0.0:
        return None, None, NO_STRAIN
    size = abs(signal)
    side = next((s for s in SIDES if (signal > 0.0) == (s["sign"] > 0)), None)
    if side is None:
        return None, None, OUTSIDE_CALIBRATION | (STRAIN_LIMIT if size > @LIMIT else OK)
    status = STRAIN_LIMIT if size > side["limit"] else OK
    drives = side["drives"]
    if drive < drives[0] * (1.0 - 1e-9) or drive > drives[-1] * (1.0 + 1e-9):
        return None, None, status | OUTSIDE_CALIBRATION
    if size >= side["end_stop"]:
        return None, None, status | STRAIN_LIMIT
    why, a, near, of_signal, variance = @FIND
    if why != OK:
        return None, None, status | why
    bias = side["bias"][0]
    if len(drives) > 1:
        j = 0
        while j + 2 < len(drives) and drive >= drives[j + 1]:
            j += 1
        weight = min(max((drive - drives[j]) / (drives[j + 1] - drives[j]), 0.0), 1.0)
        bias = side["bias"][j] + weight * (side["bias"][j + 1] - side["bias"][j])
    # Without a slope the variance is that of the distance.
    of_distance = ((NOISE / size) ** 2 + max(variance, 0.0)) * of_signal if of_signal else variance
    sigma = sqrt(of_distance + bias * bias)
    if not (isfinite(sigma) and isfinite(a)):
        return None, None, status | NO_ROOT
    return a, sigma, status | doubts(side, a, near, sigma)

@TOGETHER

if __name__ == "__main__":
    # Lines of drive, signal and, if there is one, zero; commas between.
    import sys

    for line in sys.stdin:
        if line.strip():
            distance, deviation, said = locate(*map(float, line.split(",")))
            shown = ["" if x is None else repr(x) for x in (distance, deviation)]
            print(",".join(shown + [words(said)]))
