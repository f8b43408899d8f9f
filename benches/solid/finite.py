"""Finite angles: a rubber whisker (neo-Hookean, Mooney and Rivlin, Yeoh) taps a rigid frictionless cylinder in three dimensions: finite.csv.

Half of the whisker (symmetry y-x plane), triquadratic bricks with trilinear pressure, penalty contact. Axes: x along the whisker, y towards
the object, z the motor's axis. The base stays; the cylinder turns about the wall's centre by -theta. Units: mm, N, MPa."""

import pathlib
import sys
import time

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHex1, ElementHex2, ElementVector, FacetBasis, MeshHex, MeshHex2

import patch
import tables
from fourier import Whisker, quadratic

BULK = 1000.0  # times the shear modulus
PENALTY = 60.0  # MPa per mm, times E


def to_disc(s, t):
    """Maps the square [-1, 1]^2 to the unit disc: round at the rim, square in the middle."""
    q = np.maximum(np.abs(s), np.abs(t))
    norm = np.hypot(s, t)
    rim = q / np.where(norm > 0, norm, 1)
    blend = q**2
    f = 0.8 * (1 - blend) + rim * blend
    return f * s, f * t


# C10, C01, C20, C30 over E of the laws, as of the program's verify: neo-Hookean, Mooney and Rivlin, Yeoh.
LAWS = {"neo-hookean": (1 / 6, 0, 0, 0), "mooney-rivlin": (0.35 / 3, 0.15 / 3, 0, 0), "yeoh": (0.5 / 3, 0, -0.08 / 3, 0.02 / 3)}


class Finite:
    def __init__(self, w, a, n=2, fine=1.0, law="neo-hookean"):
        self.w, self.a = w, a
        self.law = [c * w.E for c in LAWS[law]]
        end = min(w.L_a, a + 0.9 * w.D)
        x = patch.stations([0.0, 3.0, 8.0, a - 2.5, a, a + 2.5, end], [v * fine for v in (0.8, 1.0, 2.5, 1.2, 0.6, 1.2, 3.0)])
        mesh = MeshHex.init_tensor(x, np.linspace(-1, 1, 2 * n + 1), np.linspace(0, 1, n + 1))
        self.mesh = self.curved(mesh, w)
        e = ElementVector(ElementHex2())
        self.u, self.p = Basis(self.mesh, e, intorder=4), Basis(self.mesh, ElementHex1(), intorder=4)
        loc = self.u.doflocs
        self.comp = np.zeros(self.u.N, int)
        for k in range(3):
            for table in (self.u.nodal_dofs, self.u.edge_dofs, self.u.facet_dofs, self.u.interior_dofs):
                if table.size:
                    self.comp[table[k::3].ravel()] = k
        self.loc = loc
        fixed = (np.abs(loc[0]) < 1e-9) | ((np.abs(loc[2]) < 1e-9) & (self.comp == 2))
        self.keep = np.flatnonzero(~np.concatenate([fixed, np.zeros(self.p.N, bool)]))
        lo, hi = a - 4.0, a + 4.0
        skin = self.mesh.facets_satisfying(lambda q: (q[0] > lo) & (q[0] < hi) & (q[1] > 0.5 * np.hypot(q[1], q[2])) & (np.hypot(q[1], q[2]) > 0.8 * w.R(q[0])), boundaries_only=True)
        self.face = FacetBasis(self.mesh, e, facets=skin, intorder=8)
        self.prepare()

    def curved(self, mesh, w):
        """Quadratic bricks (MeshHex2) whose 27 points lie on the mapped disc."""
        m2 = MeshHex2.from_mesh(mesh)
        d = m2.doflocs.copy()
        y, z = to_disc(d[1], d[2])
        R = w.R(d[0])
        d[1], d[2] = y * R, z * R
        return MeshHex2(d, m2.t)

    def prepare(self):
        """Gradients of the shape functions at every quadrature point, and the numbering of the unknowns, element by element."""
        scalar = Basis(self.mesh, ElementHex2(), intorder=4)
        nodes = scalar.element_dofs.T  # (element, 27)
        G = np.stack([np.broadcast_to(scalar.basis[i][0].grad, (3,) + scalar.dx.shape) for i in range(27)])  # (27, 3, element, point)
        self.G, self.weight = G.transpose(2, 3, 0, 1), scalar.dx  # (element, point, 27, 3)
        e = self.u.element_dofs.T.reshape(len(nodes), -1)
        # Vector unknown of (shape function, component), whatever the library's order.
        self.edofs = np.zeros((len(nodes), 27, 3), int)
        c = self.comp[e]
        for k in range(3):
            self.edofs[:, :, k] = e[c == k].reshape(len(nodes), 27)
        self.N = np.stack([np.broadcast_to(self.p.basis[i][0].value, scalar.dx.shape) for i in range(8)]).transpose(1, 2, 0)
        self.pdofs = self.p.element_dofs.T + self.u.N

    def system(self, x, centre, rho):
        """Tangent, residual and contact forces. Energy: C10 (i1 - 3) + C01 (i2 - 3) + C20 (i1 - 3)^2 + C30 (i1 - 3)^3 + p (J - 1) - p^2 / (2 bulk) with
        i1 = J^-2/3 I1, i2 = J^-4/3 I2."""
        mu = self.w.E / 3
        bulk = BULK * mu
        u = x[self.edofs]  # (element, 27, 3)
        F = np.einsum("eak,eqaL->eqkL", u, self.G, optimize=True) + np.eye(3)
        p = np.einsum("eqb,eb->eq", self.N, x[self.pdofs])
        H = np.linalg.inv(F).swapaxes(-1, -2)  # F^-T
        J = np.linalg.det(F)
        W = self.weight
        X = lambda t: t[..., None, None]
        X4 = lambda t: t[..., None, None, None, None]
        out = lambda A, B: np.einsum("eqiJ,eqkL->eqiJkL", A, B)
        HH, cross = out(H, H), np.einsum("eqiL,eqkJ->eqiJkL", H, H)
        eye = np.einsum("ik,JL->iJkL", np.eye(3), np.eye(3))
        c10, c01, c20, c30 = self.law

        def isochoric(I, first, second, s):
            """J^-s I with its first and second derivatives by F."""
            scale = J**-s
            d = X(scale) * (first - X(s * I) * H)
            dd = X4(scale) * (second - s * (out(first, H) + out(H, first)) + X4(s * s * I) * HH + X4(s * I) * cross)
            return scale * I, d, dd

        C_right = np.einsum("eqkI,eqkJ->eqIJ", F, F)
        I1 = np.einsum("eqII->eq", C_right)
        i1, d1, dd1 = isochoric(I1, 2 * F, 2 * eye, 2 / 3)
        by, by2 = c10 + 2 * c20 * (i1 - 3) + 3 * c30 * (i1 - 3) ** 2, 2 * c20 + 6 * c30 * (i1 - 3)
        stress = X(by) * d1 + X(p * J) * H
        C = X4(by) * dd1 + X4(by2) * out(d1, d1) + X4(p * J) * (HH - cross)
        if c01:
            I2 = 0.5 * (I1**2 - np.einsum("eqIJ,eqIJ->eq", C_right, C_right))
            first = 2 * (X(I1) * F - F @ C_right)
            left = F @ F.swapaxes(-1, -2)
            delta = np.eye(3)
            second = 2 * (2 * out(F, F) + X4(I1) * eye - np.einsum("ik,eqLJ->eqiJkL", delta, C_right) - np.einsum("eqiL,eqkJ->eqiJkL", F, F) - np.einsum("eqik,JL->eqiJkL", left, delta))  # fmt: skip
            _, d2, dd2 = isochoric(I2, first, second, 4 / 3)
            stress = stress + c01 * d2
            C = C + c01 * dd2
        ne, nq = W.shape
        B = np.zeros((ne, nq, 3, 3, 27, 3))  # dF_kL of unknown (a, k)
        for k in range(3):
            B[:, :, k, :, :, k] = self.G.transpose(0, 1, 3, 2)
        B = B.reshape(ne, nq, 9, 81)
        CB = (C.reshape(ne, nq, 9, 9) * W[..., None, None]) @ B
        K = B.reshape(ne, nq * 9, 81).swapaxes(1, 2) @ CB.reshape(ne, nq * 9, 81)
        div = np.einsum("eqr,eqrd->eqd", (X(J * W) * H).reshape(ne, nq, 9), B, optimize=True)
        Kp = np.einsum("eqb,eqd->ebd", self.N, div, optimize=True)
        M = np.einsum("eqb,eq,eqc->ebc", self.N, W, self.N, optimize=True) / bulk
        n = self.u.N + self.p.N
        ed, pd = self.edofs.reshape(ne, 81), self.pdofs
        r = np.zeros(n)
        np.add.at(r, ed, np.einsum("eqr,eqrd->ed", (stress * X(W)).reshape(ne, nq, 9), B, optimize=True))
        np.add.at(r, pd, np.einsum("eqb,eq->eb", self.N, (J - 1 - p / bulk) * W))
        ij = lambda a, b: (np.repeat(a, b.shape[1], axis=1).ravel(), np.tile(b, (1, a.shape[1])).ravel())
        A = sp.csc_matrix((K.ravel(), ij(ed, ed)), shape=(n, n))
        L = sp.csc_matrix((Kp.ravel(), ij(pd, ed)), shape=(n, n))
        A = A + L + L.T - sp.csc_matrix((M.ravel(), ij(pd, pd)), shape=(n, n))
        f, Kc = self.press(x, centre, rho)
        r[: self.u.N] += f
        return (A + Kc).tocsc(), r, f

    def press(self, x, centre, rho):
        """Penalty contact on the reference skin: forces (residual's sign) and tangent."""
        k = PENALTY * self.w.E
        uf = self.face.interpolate(x[: self.u.N])
        q = self.face.global_coordinates()
        dx, dy = q[0] + uf[0] - centre[0], q[1] + uf[1] - centre[1]
        dist = np.hypot(dx, dy)
        g, nx, ny = np.maximum(rho - dist, 0), dx / dist, dy / dist
        n = self.u.N + self.p.N
        dofs = self.face.element_dofs.T  # (facet, 81)
        V = np.stack([np.stack([np.broadcast_to(b[0].value[i], dist.shape) for i in (0, 1)]) for b in self.face.basis])
        a, t = V[:, 0] * nx + V[:, 1] * ny, V[:, 1] * nx - V[:, 0] * ny
        wt = self.face.dx * k
        f = np.zeros(self.u.N)
        np.add.at(f, dofs, -np.einsum("dfq,fq->fd", a, g * wt))
        on = (g > 0) * wt
        Kf = np.einsum("dfq,efq,fq->fde", a, a, on, optimize=True) - np.einsum("dfq,efq,fq->fde", t, t, wt * g / dist, optimize=True)
        i, j = np.repeat(dofs, dofs.shape[1], axis=1).ravel(), np.tile(dofs, (1, dofs.shape[1])).ravel()
        return f, sp.csc_matrix((Kf.ravel(), (i, j)), shape=(n, n))

    def tap(self, rho, theta_deg, steps_deg):
        """Yields (theta_deg, force in N, strain contact, strain far) after each step."""
        w, a = self.w, self.a
        s, c = np.sin(w.alpha), np.cos(w.alpha)
        q = np.array([a, float(w.R(a))]) + rho * np.array([s, c])
        x = np.zeros(self.u.N + self.p.N)
        last, done, previous = x.copy(), 0.0, 0.0
        for angle in steps_deg:
            if angle > theta_deg + 1e-9:
                break
            # Start: extrapolate the last step.
            guess = x if done == 0 else x + (x - last) * (angle - done) / (done - previous)
            last, x = x, guess.copy()
            t = np.radians(angle)
            centre = np.array([q[0] * np.cos(t) + q[1] * np.sin(t), -q[0] * np.sin(t) + q[1] * np.cos(t)])
            for it in range(25):
                A, r, f = self.system(x, centre, rho)
                free = self.keep
                miss = np.linalg.norm(r[free])
                dx = splu(A[free][:, free], permc_spec="COLAMD").solve(-r[free])
                step = min(1.0, 1.5 / max(np.max(np.abs(dx[: len(dx) // 2])), 1e-12))
                x[free] += step * dx
                if np.linalg.norm(dx * step) < 1e-7 * max(1.0, np.linalg.norm(x)):
                    break
            previous, done = done, angle
            force = np.hypot(f[self.comp == 0].sum(), f[self.comp == 1].sum()) * 2  # two halves
            yield angle, force, self.strain(x, +1), self.strain(x, -1), it + 1, miss

    def strain(self, x, side, x_ss=5.0, l=2.0):
        """Mean strain of the skin's line y = side * R between x_ss and x_ss + l cos(alpha), from its length."""
        on = (np.abs(self.loc[2]) < 1e-9) & (np.abs(self.loc[1] - side * self.w.R(self.loc[0])) < 1e-6 * self.w.D)
        keys = [np.flatnonzero(on & (self.comp == k)) for k in (0, 1)]
        order = [k[np.argsort(self.loc[0][k])] for k in keys]
        X = self.loc[0][order[0]]
        ends = np.linspace(x_ss, x_ss + l * np.cos(self.w.alpha), 21)
        px = quadratic(X, X + x[order[0]], ends)
        py = quadratic(X, self.loc[1][order[1]] + x[order[1]], ends)
        return np.hypot(np.diff(px), np.diff(py)).sum() / l - 1


# Small steps, or Newton leaves the solution.
STEPS = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]


def main(out, quick=False):
    laws = [("coarse", d, 21.0, 2, 1.4, law) for law in ("mooney-rivlin", "yeoh") for d in (4.0, 10.0)]
    if "--laws" in sys.argv:
        return measure(laws, pathlib.Path(out) / "finite_laws.csv", quick)
    jobs = [("coarse", 10.0, 21.0, 2, 1.4), ("coarse", 4.0, 21.0, 2, 1.4), ("coarse", 10.0, 33.0, 2, 1.4), ("coarse", 4.0, 33.0, 2, 1.4), ("fine", 10.0, 21.0, 3, 1.0)]
    measure([(*job, "neo-hookean") for job in (jobs[:1] if quick else jobs)], pathlib.Path(out) / "finite.csv", quick)
    measure(laws[:1] if quick else laws, pathlib.Path(out) / "finite_laws.csv", quick)


def measure(jobs, file, quick):
    rows = []
    for mesh, d, a, n, fine, law in jobs:
        solver = Finite(Whisker(d=d), a, n, fine, law)
        start = time.time()
        for angle, force, near, far, its, miss in solver.tap(3.0, 1.0 if quick else 10.0, STEPS):
            print(law, mesh, d, a, angle, force, near, far, its, miss, solver.u.N, round(time.time() - start), flush=True)
            named = {} if law == "neo-hookean" else {"law": law}
            rows.append(dict(**named, mesh=mesh, unknowns=len(solver.keep), D_mm=10.0, d_mm=d, a_mm=a, pole_radius_mm=3.0, theta_deg=angle, normal_force_N=force, strain_contact=near, strain_far=far))  # fmt: skip
            tables.write(file, rows)


if __name__ == "__main__":
    main(sys.argv[1], "--quick" in sys.argv)
