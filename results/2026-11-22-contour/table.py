#!/usr/bin/env python3
"""Table of work/: rms distances of points from the object, and from the places that were touched."""
import json, sys
from pathlib import Path

work = Path(sys.argv[1] if len(sys.argv) > 1 else "work")
print("| object | points by | points | off the object, rms | off the place touched, rms | curve | curve off the object, rms |")
print("|---|---|---|---|---|---|---|")
ways = {"strokes": "strokes, `exact`", "paper-strokes": "strokes, `paper`", "taps": "taps, `exact`", "paper-taps": "taps, `paper`"}
for name in ["circle", "corner", "curve", "late-circle", "late-corner", "late-curve"]:
    for way, told in ways.items():
        result = json.loads((work / f"{name}-{way}" / "run.json").read_text())["result"]
        t, curve = result["truth"], result["curve"]
        kind = curve["kind"] or "–"
        if kind == "circle":
            kind += f", radius {curve['radius_mm']:.3f} ± {curve['sigma_radius_mm']:.3f}"
        along = f"{t['curve_rms_mm']:.4f}" if t["curve_rms_mm"] is not None else "–"
        print(f"| {name} | {told} | {t['points']} | {t['points_rms_mm']:.4f} | {t['places_rms_mm']:.4f} | {kind} | {along} |")
