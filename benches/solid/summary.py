"""Reads the bench's tables and writes what they say: summary.txt, errors.csv, finite_errors.csv, indentation_beta.csv, foil_width.csv, figures."""

import pathlib
import sys

import matplotlib
import numpy as np
from scipy.optimize import brentq, least_squares

matplotlib.use("svg")
import matplotlib.pyplot as plt

import foil
import rod
import tables
from contact import BETA, hertz
from fourier import Whisker

K_ONE = 1.011


def span(values):
    values = 100 * (np.asarray(list(values), float) - 1)
    return f"{values.min():+.2f} ... {values.max():+.2f} %"


def linear(out, say):
    rows = tables.read(out / "linear.csv")
    table = []
    for r in rows:
        # Strain per radian, 3-D over model: the quantity that K compares. theta is the section's: the indentation is left out.
        e, er = r["strain_per_N_3d_over_rod"], r["strain_per_N_3d_over_reduced"]
        table.append(
            {k: r[k] for k in ("clamp", "socket_mm", "nu", "d_mm", "L_a_mm", "a_mm", "x_ss_mm")}
            | dict(
                euler=e / r["theta_3d_over_euler"], timoshenko=e / r["theta_3d_over_timoshenko"], reduced=er / r["theta_3d_over_reduced"],
                theta_reduced=r["theta_3d_over_reduced"], strain_per_N_rod=e, strain_per_N_reduced=er,
            )
        )  # fmt: skip
    tables.write(out / "errors.csv", table)
    say("Strain per radian, 3-D over model, small angles (errors.csv), a >= 18 mm, x_ss >= 3 mm, a - x_ss >= 12 mm:")
    for nu in sorted({r["nu"] for r in table}):
        for label, test in (("d/D 0.4 ... 1.2", lambda r: r["d_mm"] >= 4), ("d/D 0.1 ... 0.2", lambda r: r["d_mm"] < 4)):
            part = [r for r in table if r["clamp"] == "bonded" and r["nu"] == nu and test(r) and r["a_mm"] >= 18 and r["a_mm"] - r["x_ss_mm"] >= 12]
            if part:
                say(f"  bonded, nu {nu:g}, {label}: " + "; ".join(f"{k} {span(r[k] for r in part)}" for k in ("euler", "timoshenko", "reduced", "theta_reduced", "strain_per_N_reduced")))  # fmt: skip
    say("Clamp constants (clamp_constants.csv): c0 of the one-number form (b = c0, c = 0), its worst error in theta for a >= 2.1 D:")
    for r in tables.read(out / "clamp_constants.csv"):
        say(f"  {r['clamp']} {r['socket_mm']:g} mm, nu {r['nu']:g}: c0 {r['one_c0']:+.4f} (worst {100 * r['one_worst']:.2f} %); four numbers c0 {r['four_c0']:.4f} k {r['four_k']:.4f} b {r['four_b']:.4f} c {r['four_c']:.4f} (worst {100 * r['four_worst']:.2f} %)")  # fmt: skip
    fig, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True)
    for axis, d in zip(axes, (4.0, 10.0)):
        for name in ("euler", "timoshenko", "reduced"):
            part = sorted((r["a_mm"], r[name]) for r in table if r["clamp"] == "bonded" and r["nu"] == 0.499 and (r["d_mm"], r["L_a_mm"], r["x_ss_mm"]) == (d, 50, 5))
            axis.plot([a for a, _ in part], [100 * (v - 1) for _, v in part], "o-", label=name)
        axis.set(title=f"D 10, d {d:g} mm, bonded, x_ss 5 mm", xlabel="contact distance a (mm)")
        axis.axhline(0, color="0.7", lw=0.8)
    axes[0].set_ylabel("strain per radian: 3-D over model − 1 (%)")
    axes[0].legend()
    fig.tight_layout()
    fig.savefig(out / "linear.svg")


def mesh(out, say):
    rows = tables.read(out / "mesh.csv")
    finest = min(r["h_mm"] for r in rows)
    best = {(r["d_mm"], r["a_mm"], r["x_ss_mm"]): r for r in rows if r["h_mm"] == finest}
    say(f"Mesh (mesh.csv): difference from the finest, h {finest:g} mm:")
    for h in sorted({r["h_mm"] for r in rows} - {finest}):
        part = [(r, best[r["d_mm"], r["a_mm"], r["x_ss_mm"]]) for r in rows if r["h_mm"] == h]
        say(f"  h {h:g} mm: theta {span(r['theta_rad_per_N'] / b['theta_rad_per_N'] for r, b in part)}, strain {span(r['strain_per_N'] / b['strain_per_N'] for r, b in part)}")


def indentation(out, say):
    rows = tables.read(out / "indentation.csv")
    for r in rows:
        w = Whisker(d=r["d_mm"], D=r["D_mm"])
        P, R, a = r["force_N"], r["R_mm"], r["a_mm"]
        lever = a * np.cos(w.alpha) - R * np.sin(w.alpha)
        total = r["section_motion_mm"] + r["indentation_mm"]
        k = K_ONE * rod.cowper(w.nu) / rod.cowper(0.5)
        for name, theta in (("four", rod.theta(w, a, **rod.BONDED_FOUR)), ("one", rod.theta(w, a, c0=0.054, k=k))):
            r[f"beta_with_{name}"] = (r["hertz_mm"] - (total - theta * lever * P)) * w.E * R / P
            r[f"total_over_reduced_{name}"] = total / (theta * lever * P + r["hertz_mm"] - (BETA if name == "four" else 0) * P / (w.E * R))
    tables.write(out / "indentation_beta.csv", rows)
    for name in sorted({r["mesh"] for r in rows}):
        part = [r for r in rows if r["mesh"] == name]
        say(f"Indentation, {name} mesh, {len(part)} cases: beta with the section's own motion {np.mean([r['beta'] for r in part]):.3f} ({min(r['beta'] for r in part):.3f} ... {max(r['beta'] for r in part):.3f}); "
            f"with the four numbers {np.mean([r['beta_with_four'] for r in part]):.3f} ({min(r['beta_with_four'] for r in part):.3f} ... {max(r['beta_with_four'] for r in part):.3f}); "
            f"with one number {np.mean([r['beta_with_one'] for r in part]):.3f}; whole motion of the contact, 3-D over reduced (0.185): {span(r['total_over_reduced_four'] for r in part)}")  # fmt: skip
    fig, axis = plt.subplots(figsize=(5, 3.8))
    for name, mark in (("fine", "o"), ("coarse", "x")):
        part = [r for r in rows if r["mesh"] == name]
        axis.plot([r["hertz_mm"] for r in part], [r["indentation_mm"] for r in part], mark, label=f"3-D, {name}")
    top = max(r["hertz_mm"] for r in rows)
    axis.plot([0, top], [0, top], "0.6", label="Hertz")
    axis.set(xlabel="Hertz, crossed cylinders (mm)", ylabel="indentation (mm)")
    axis.legend()
    fig.tight_layout()
    fig.savefig(out / "indentation.svg")


def foils(out, say):
    rows = tables.read(out / "foil.csv")
    fine = [r for r in rows if r["mesh"] == "fine"] or rows
    for width in sorted({r["foil_width_mm"] for r in fine}):
        part = [r for r in fine if r["foil_width_mm"] == width]
        say(f"Foil of width {width:g} mm: T 3-D over the reduced model without its width: {span(r['T_3d_over_reduced'] for r in part)}; theta, 3-D over reduced: {span((1 + r['theta_change_3d']) / (1 + r['theta_change_reduced']) for r in part)}")  # fmt: skip
    # A width law: 1 / T - 1 = S / (E lambda); lambda = lambda_2.8 (width / 2.8)^(-g), g a quadratic in y.
    one = [r for r in fine if r["a_mm"] == 33.0]

    def model(q, r):
        w = Whisker(d=r["d_mm"])
        y = np.log10(r["foil_stiffness_N_per_mm"] / (w.E * r["foil_length_mm"]))
        z = np.log(r["foil_width_mm"] / 2.8)
        v = np.log(r["foil_length_mm"] / 6.3)
        base = 1 / foil.transfer(w, r["foil_stiffness_N_per_mm"], r["foil_length_mm"]) - 1
        return 1 / (1 + base * np.exp(z * (q[0] + q[1] * y + q[2] * y * y + q[3] * v + q[5] * z) + q[4]))

    miss = lambda q: [model(q, r) / r["T_3d"] - 1 for r in one]
    best = least_squares(miss, [0.5, 0, 0, 0, 0, 0])
    say(f"Foil, width law 1/T - 1 = (1/T_2.8 - 1) exp(z (g0 + g1 y + g2 y^2 + g3 q + g5 z) + g4), z = ln(width / 2.8): g0 ... g5 = {', '.join(f'{v:.4f}' for v in best.x)}; T within {100 * np.max(np.abs(miss(best.x))):.1f} % (rms {100 * np.sqrt(np.mean(np.square(miss(best.x)))):.1f} %), {len(one)} foils")
    for a, b in (("coarse", "fine"),):
        key = lambda r: tuple(r[k] for k in ("d_mm", "a_mm", "foil_length_mm", "foil_width_mm", "foil_stiffness_N_per_mm"))
        ref = {key(r): r for r in rows if r["mesh"] == b}
        both = [(r, ref[key(r)]) for r in rows if r["mesh"] == a and key(r) in ref]
        if both:
            say(f"Foil, coarse mesh over fine: T {span(r['T_3d'] / q['T_3d'] for r, q in both)}; theta {span((1 + r['theta_change_3d']) / (1 + q['theta_change_3d']) for r, q in both)}")
    fig, axis = plt.subplots(figsize=(5.4, 3.8))
    for width, mark in ((1.5, "v"), (2.8, "o"), (5.0, "s")):
        for length, colour in ((3.0, "C0"), (6.3, "C1"), (10.0, "C2")):
            part = sorted((r["foil_stiffness_N_per_mm"], r["T_3d"]) for r in fine if (r["foil_width_mm"], r["foil_length_mm"], r["d_mm"], r["a_mm"]) == (width, length, 10.0, 33.0))
            if part:
                axis.loglog(*zip(*part), colour + mark, label=f"{length:g} × {width:g} mm")
                if width == 2.8:
                    axis.loglog([s for s, _ in part], [foil.transfer(Whisker(d=10.0), s, length) for s, _ in part], colour)
    axis.set(xlabel="foil stiffness (N/mm)", ylabel="T: reading over bare strain", title="points: 3-D; lines: docs/model.md §8 d), 2.8 mm")
    axis.legend(fontsize=7)
    fig.tight_layout()
    fig.savefig(out / "foil.svg")


def reduced_tap(w, a, rho, theta, rods, far):
    """Force and strain of the reduced model from the exact rod's own answers (rods: theta_deg -> force, strain), corrected as at small angles."""
    t = np.array(sorted(rods))
    P, e = np.array([rods[v][0] for v in t]), np.array([rods[v][1] for v in t])
    bend = (e - np.array([far[w.d, a, v] for v in t])) / 2  # half the difference of the sides
    R = float(w.R(a))
    lever = a * np.cos(w.alpha) - R * np.sin(w.alpha)
    ratio = rod.theta(w, a, **rod.BONDED_FOUR) / rod.theta(w, a, k=rod.cowper(0.5))
    x2 = 5 + 2 * np.cos(w.alpha)
    near = rod.strain(w, a, 5, x2, rod.NEAR_CLAMP) / rod.strain(w, a, 5, x2)
    cubic = np.polyfit(P, t / P, 2)  # theta of the rod over its force
    slope = np.polyfit(P, bend / P, 2)

    def angle(p):
        dent = hertz(p, R, rho, w.E / 0.75) - BETA * p / (w.E * R)
        return p * np.polyval(cubic, p) * ratio + np.degrees(dent / lever)

    p = brentq(lambda p: angle(p) - theta, 1e-6, 3 * P.max())
    bending = p * np.polyval(slope, p) * near
    return p, bending


def finite(out, say):
    rows = tables.read(out / "finite.csv")
    rods = {}
    for r in tables.read(out / "rod.csv"):
        rods.setdefault((r["d_mm"], r["a_mm"]), {})[r["theta_deg"]] = (r["normal_force_N"], r["strain"])
    far = {(r["d_mm"], r["a_mm"], r["theta_deg"]): -abs(r["strain"]) for r in tables.read(out / "rod_far.csv")}
    table = []
    for r in rows:
        w = Whisker(d=r["d_mm"], nu=0.5 - 1e-9)
        have = rods[r["d_mm"], r["a_mm"]]
        if r["theta_deg"] not in have:
            continue
        P, e = have[r["theta_deg"]]
        p, bending = reduced_tap(w, r["a_mm"], r["pole_radius_mm"], r["theta_deg"], have, far)
        mean = (r["strain_contact"] - r["strain_far"]) / 2
        table.append(
            {k: r[k] for k in ("mesh", "d_mm", "a_mm", "pole_radius_mm", "theta_deg")}
            | dict(
                force_3d_N=r["normal_force_N"], strain_3d=r["strain_contact"], force_over_rod=r["normal_force_N"] / P, strain_over_rod=r["strain_contact"] / e,
                strain_per_N_over_rod=r["strain_contact"] / r["normal_force_N"] / (e / P), force_over_reduced=r["normal_force_N"] / p,
                strain_over_reduced=mean / bending, strain_over_euler_linear=mean / strain_euler(w, r["a_mm"], r["theta_deg"]),
                bending_over_rod=mean / ((e - far[r["d_mm"], r["a_mm"], r["theta_deg"]]) / 2),
                sides_3d=(r["strain_contact"] + r["strain_far"]) / 2 / mean**2,
                sides_rod=(e + far[r["d_mm"], r["a_mm"], r["theta_deg"]]) / 2 / mean**2,
            )
        )  # fmt: skip
    tables.write(out / "finite_errors.csv", table)
    say("Finite angles, pole radius 3 mm (finite_errors.csv): 3-D over rod with surface, shear, extension, neo-Hookean; over the reduced model:")
    for r in table:
        say(f"  {r['mesh']} d {r['d_mm']:g} a {r['a_mm']:g} theta {r['theta_deg']:g}: strain/rod {r['strain_over_rod']:.4f} force/rod {r['force_over_rod']:.4f} strain per N/rod {r['strain_per_N_over_rod']:.4f} strain/reduced {r['strain_over_reduced']:.4f} force/reduced {r['force_over_reduced']:.4f} bending/rod {r['bending_over_rod']:.4f}; mean of the sides over square {r['sides_3d']:+.3f} (rod {r['sides_rod']:+.3f})")  # fmt: skip
    fig, axis = plt.subplots(figsize=(5, 3.8))
    for d, a in sorted({(r["d_mm"], r["a_mm"]) for r in table}):
        part = sorted((r["theta_deg"], r["strain_over_rod"], r["strain_over_reduced"]) for r in table if (r["d_mm"], r["a_mm"], r["mesh"]) == (d, a, "coarse"))
        if part:
            line = axis.plot([p[0] for p in part], [100 * (p[1] - 1) for p in part], "o-", label=f"rod, d {d:g}, a {a:g} mm")[0]
            axis.plot([p[0] for p in part], [100 * (p[2] - 1) for p in part], "s--", color=line.get_color(), label="the same, reduced")
    axis.set(xlabel="tap angle (deg)", ylabel="strain: 3-D over model − 1 (%)")
    axis.legend(fontsize=7)
    fig.tight_layout()
    fig.savefig(out / "finite.svg")


def strain_euler(w, a, theta_deg):
    x2 = 5 + 2 * np.cos(w.alpha)
    return np.radians(theta_deg) * rod.strain(w, a, 5, x2) / rod.theta(w, a)


def main(out):
    out = pathlib.Path(out)
    lines = []
    parts = {"linear.csv": linear, "mesh.csv": mesh, "indentation.csv": indentation, "foil.csv": foils, "finite.csv": finite}
    for name, part in parts.items():
        if (out / name).exists():
            part(out, lines.append)
    (out / "summary.txt").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main(sys.argv[1])
