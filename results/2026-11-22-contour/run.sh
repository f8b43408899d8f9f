#!/usr/bin/env bash
# Strokes over a circle, a corner and a curve, traced in four ways. Argument: the program. Leaves its work in ./work.
set -euo pipefail
cd "$(dirname "$0")"
V=$1
mkdir -p work
"$V" simulate whisker.toml --repeats 3 --out work/taps --force --quiet
"$V" calibrate work/taps/measurements.csv --whisker whisker.toml --out work/calibration --force --quiet
for object in circle corner curve late-circle late-corner late-curve; do
    "$V" simulate strokes.toml --object $object.toml --seed 7 --out work/$object --force
    trace() {
        "$V" contour work/$object/strokes.csv --calibration work/calibration/calibration.toml --truth $object.toml \
            --out work/$object-$1 --force "${@:2}" | sed "s/^/$object $1: /"
    }
    trace strokes
    trace taps --taps
    trace paper-taps --taps --estimator paper
    trace paper-strokes --estimator paper
    "$V" report work/$object-strokes --figures png --force --quiet
    "$V" report work/$object-paper-taps --figures png --force --quiet
done
python3 table.py
