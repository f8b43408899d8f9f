"""Linear elasticity of a body of revolution, one Fourier harmonic in the azimuth at a time.

Displacement: u_r = U cos(m phi), u_phi = V sin(m phi), u_z = W cos(m phi); z runs along the whisker, phi = 0 is the contact side.
Mixed displacement-pressure elements (scikit-fem, biquadratic / bilinear: Taylor-Hood), so nearly incompressible rubber does not lock.
The meridian is meshed with quadrilaterals in z and eta = r / R(z). Units: mm, N, MPa.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad1, ElementQuad2, ElementVector, MeshQuad, asm


@dataclass(frozen=True)
class Whisker:
    """Base and tip diameter, length between them: mm. Modulus: MPa."""

    D: float = 10.0
    d: float = 4.0
    L_a: float = 50.0
    E: float = 3.2
    nu: float = 0.499

    @property
    def taper(self):
        return (self.D - self.d) / (2 * self.L_a)  # tan(alpha)

    @property
    def alpha(self):
        return np.arctan(self.taper)

    def R(self, s):
        """Radius; for s < 0 (inside a socket) the cone is continued."""
        return self.D / 2 - self.taper * np.asarray(s, float)


def stations(points, sizes):
    """Mesh lines along z: every point is a line, between two points the spacing grows from one wanted size to the other."""
    lines = [points[0]]
    for a, b, ha, hb in zip(points, points[1:], sizes, sizes[1:]):
        n = max(1, int(np.ceil((b - a) / (ha if abs(ha - hb) < 1e-12 else (hb - ha) / np.log(hb / ha)) - 1e-9)))
        t = np.linspace(0, 1, n + 1)[1:]
        q = hb / ha
        lines += list(a + (b - a) * (t if abs(q - 1) < 1e-9 else (q**t - 1) / (q - 1)))
    return np.array(lines)


def radial(n, grade):
    """Mesh lines in eta = r / R: n cells, the outermost `grade` times smaller than the innermost."""
    cells = grade ** (-np.arange(n) / max(n - 1, 1))
    return np.concatenate([[0.0], np.cumsum(cells) / cells.sum()])


class Body:
    """Mesh, bases and constraints; `solve(m, loads)` answers one harmonic."""

    def __init__(self, whisker, z, eta, clamp="bonded", socket=0.0):
        """`clamp`: bonded (the face z = 0 is fixed), glued (the skin is fixed for z <= 0), socket (the skin slides for z <= 0 without
        friction and does not lift off). `socket`: length behind the wall, mm; its rear face is free, but for the socket's mean slip."""
        self.whisker, self.clamp, self.socket = whisker, clamp, socket
        mesh = MeshQuad.init_tensor(z, eta)
        x, e = mesh.p
        self.mesh = MeshQuad(np.vstack([x, e * whisker.R(x)]), mesh.t)
        self.u = Basis(self.mesh, ElementVector(ElementQuad2(), 3), intorder=6)
        self.p = Basis(self.mesh, ElementQuad1(), intorder=6)
        loc = self.u.doflocs
        comp = np.zeros(self.u.N, int)  # component of every displacement unknown
        for k in range(3):
            for table in (self.u.nodal_dofs, self.u.facet_dofs, self.u.interior_dofs):
                comp[table[k::3].ravel()] = k
        self.comp, self.z, self.r = comp, loc[0], loc[1]
        skin = np.abs(self.r - whisker.R(self.z)) < 1e-9 * whisker.D
        order = np.argsort(self.z[skin & (comp == 0)])
        # Unknowns on the skin, by component, sorted along z.
        self.skin = [np.flatnonzero(skin & (comp == k))[np.argsort(self.z[skin & (comp == k)])] for k in range(3)]
        self.skin_z = self.z[self.skin[0]]
        self.on_skin = skin

    def fixed(self, m):
        c, axis = self.comp, self.r < 1e-12
        if self.clamp == "bonded":
            out = np.abs(self.z) < 1e-9
        else:
            inside = self.on_skin & (self.z < 1e-9)
            out = inside if self.clamp == "glued" else inside & (c == 0)
            if self.clamp == "socket" and m == 0:  # a smooth socket does not hold the whisker back: its rear face does
                out |= (np.abs(self.z - self.z.min()) < 1e-9) & (c == 2)
        # On the axis: m = 0: U = 0; m = 1: U + V = 0 and W = 0; m >= 2: everything is 0. For m >= 1 the unknowns 0 and 1 are
        # a = (U - V) / 2 and b = (U + V) / 2, so that every condition concerns one unknown. In a smooth socket U = 0 ties a to -b: see `turn`.
        if m == 0:
            out |= (axis & (c == 0)) | (c == 1)
        elif m == 1:
            out |= axis & (c != 0)
        else:
            out |= axis
        return out

    def stiffness(self, m):
        """Stiffness and pressure coupling, for the unknowns (U, V, W) (m = 0) or (a, b, W) (m >= 1)."""
        w = self.whisker
        mu = w.E / (2 * (1 + w.nu))
        bulk = w.E * w.nu / ((1 + w.nu) * (1 - 2 * w.nu))  # Lame's lambda
        circ = 2 * np.pi if m == 0 else np.pi

        def uvw(u):
            g = u.grad  # index: component, (z, r)
            if m == 0:
                return u[0], u[1], g[0], g[1], g[2], u[2]
            return u[0] + u[1], u[1] - u[0], g[0] + g[1], g[1] - g[0], g[2], u[2]

        def strains(u, r):
            U, V, gU, gV, gW, W = uvw(u)
            return (gU[1], (U + m * V) / r, gW[0], gU[0] + gW[1], gV[1] - (m * U + V) / r, gV[0] - m * W / r)

        @BilinearForm
        def shear(u, v, q):
            r = q.x[1]
            s, t = strains(u, r), strains(v, r)
            return mu * circ * r * (2 * (s[0] * t[0] + s[1] * t[1] + s[2] * t[2]) + s[3] * t[3] + s[4] * t[4] + s[5] * t[5])

        @BilinearForm
        def volume(u, v, q):
            r = q.x[1]
            s = strains(u, r)
            return circ * r * (s[0] + s[1] + s[2]) * v

        @BilinearForm
        def squeeze(u, v, q):
            return circ * q.x[1] / bulk * u * v

        K, B, M = asm(shear, self.u), asm(volume, self.u, self.p), asm(squeeze, self.p)
        return sp.bmat([[K, B.T], [B, -M]], format="csr")

    def turn(self, m):
        """Columns: the unknowns kept. For m >= 1 skin unknowns are turned back to (U, V) so that the skin can be held and loaded directly."""
        n = self.u.N
        T = sp.identity(n + self.p.N, format="lil")
        if m > 0:
            i, j = self.skin[0], self.skin[1]  # a, b -> U, V: a = (U - V)/2, b = (U + V)/2
            T[i, i], T[i, j] = 0.5, -0.5
            T[j, i], T[j, j] = 0.5, 0.5
        return T.tocsr()

    def solve(self, m, loads):
        """Displacements (U or a, V or b, W off the skin; U, V, W on the skin) for loads given on the displacement unknowns, one a column."""
        T = self.turn(m)
        A = (T.T @ self.stiffness(m) @ T).tocsc()
        keep = np.flatnonzero(~np.concatenate([self.fixed(m), np.zeros(self.p.N, bool)]))
        rhs = np.zeros((A.shape[0], loads.shape[1]))
        rhs[: self.u.N] = loads
        x = np.zeros_like(rhs)
        x[keep] = splu(A[keep][:, keep], permc_spec="COLAMD").solve(rhs[keep])
        return (T @ x)[: self.u.N], x[: self.u.N]

    def point_load(self, a):
        """Unit force normal to the skin at z = a, pressing at phi = 0: the same vector for every harmonic."""
        i = int(np.argmin(np.abs(self.skin_z - a)))
        f = np.zeros((self.u.N, 1))
        f[self.skin[0][i]], f[self.skin[2][i]] = -np.cos(self.whisker.alpha), -np.sin(self.whisker.alpha)
        return f

    def section(self, m, raw, a):
        """Rigid motion of the section z = a: (lateral, rotation, axial), from its area averages. `raw`: unknowns a, b, W."""
        keys = [np.flatnonzero((np.abs(self.z - a) < 1e-9) & (self.comp == k)) for k in range(3)]
        keys = [k[np.argsort(self.r[k])] for k in keys]
        r = self.r[keys[0]]
        # Simpson per cell is exact for a quadratic unknown times r.
        wts = np.zeros(len(r))
        for j in range(0, len(r) - 2, 2):
            wts[j : j + 3] += (r[j + 2] - r[j]) / 6 * np.array([1, 4, 1])
        R = r[-1]
        if m == 0:
            return 0.0, 0.0, float(2 * wts @ (raw[keys[2]] * r) / R**2)
        return float(2 * wts @ (raw[keys[0]] * r) / R**2), float(4 * wts @ (raw[keys[2]] * r**2) / R**4), 0.0

    def skin_along(self, skin_values, x):
        """Displacement along the generator at skin stations x, from (U, V, W): its differences are elongations."""
        t = -np.sin(self.whisker.alpha) * skin_values[self.skin[0]] + np.cos(self.whisker.alpha) * skin_values[self.skin[2]]
        return quadratic(self.skin_z, t, x)


def quadratic(z, f, x):
    """Interpolates in the biquadratic cells: z holds ends and middles alternately."""
    x = np.atleast_1d(np.asarray(x, float))
    e = np.clip(np.searchsorted(z[::2], x, side="right") - 1, 0, (len(z) - 1) // 2 - 1)
    z0, z2 = z[2 * e], z[2 * e + 2]
    t = (x - z0) / (z2 - z0)
    return (2 * t - 1) * (t - 1) * f[2 * e] + 4 * t * (1 - t) * f[2 * e + 1] + t * (2 * t - 1) * f[2 * e + 2]
