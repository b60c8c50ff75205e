"""An assembly of rigid bodies and springs written out by hand, to check the engine against."""

from __future__ import annotations

import numpy as np

IDENTITY = np.eye(3)


def lever(r):
    """u_point = u + theta x r as a (6, 6) matrix, from the cross product's definition."""
    columns = np.array([np.cross(axis, r) for axis in np.eye(3)]).T
    return np.block([[np.eye(3), columns], [np.zeros((3, 3)), np.eye(3)]])


def tensor(six):
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def random_rotation(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def random_inertia(rng, mass):
    """The tensor of eight random point masses about their own centre: always one that a body can have."""
    points = rng.normal(size=(8, 3)) * 0.1
    points -= points.mean(axis=0)
    moment = mass / 8 * sum(np.dot(p, p) * np.eye(3) - np.outer(p, p) for p in points)
    return (moment[0, 0], moment[1, 1], moment[2, 2], moment[0, 1], moment[0, 2], moment[1, 2])


class RandomAssembly:
    """``count`` bodies, a tree of springs and some loops, optionally held by a fixation.

    Everything the engine is asked for is also assembled here with numpy: M, K, C over bodies then fixation.
    """

    def __init__(self, seed, count=10, fixed=True, damper=False, zeta=0.0, apart=0.05, k=(4, 9)):
        rng = np.random.default_rng(seed)
        self.names = [f"b{i}" for i in range(count)]
        self.mass = rng.uniform(0.1, 20.0, count)
        self.cog = rng.normal(size=(count, 3)) * 0.3
        self.inertia = [random_inertia(rng, m) for m in self.mass]
        self.fixed = fixed
        self.fixation = rng.normal(size=3) * 0.3
        pairs = [(i, rng.integers(i)) for i in range(1, count)] + [(0, count - 1), (1, count - 2)]
        if fixed:
            pairs += [(count, 0), (count, count // 2)]
        self.springs = []
        for n, (i, j) in enumerate((i, j) for i, j in pairs if i != j):
            p1 = rng.normal(size=3) * 0.3
            self.springs.append(
                {
                    "name": f"s{n}",
                    "ends": (int(i), int(j)),
                    "p1": p1,
                    "p2": p1 + rng.normal(size=3) * apart,
                    "axes": random_rotation(rng),
                    "k": 10 ** rng.uniform(*k, 6) * np.r_[1, 1, 1, 1e-2, 1e-2, 1e-2],
                    "c": rng.uniform(0, 100, 6) if damper else None,
                    "zeta": zeta if np.isscalar(zeta) else float(rng.uniform(*zeta)),
                }
            )

    def model(self, ibs, turn=IDENTITY, shift=(0, 0, 0), swap=False, order=None):
        """The same assembly as an ibsdyn model, moved as a whole by a rotation and a shift."""

        def move(p):
            return tuple(turn @ p + shift)

        model = ibs.Model("random")
        if self.fixed:
            model.fixation("ground", position=move(self.fixation))
        for i in order if order is not None else range(len(self.names)):
            t = turn @ tensor(self.inertia[i]) @ turn.T
            model.rigid_body(
                self.names[i],
                mass=self.mass[i],
                cog=move(self.cog[i]),
                inertia=(t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2]),
            )
        names = [*self.names, "ground"]
        for s in self.springs:
            a, b = (names[i] for i in s["ends"])
            p, q = move(s["p1"]), move(s["p2"])
            if swap:
                a, b, p, q = b, a, q, p
            model.connection(
                s["name"],
                a,
                b,
                position1=p,
                position2=q,
                stiffness=s["k"],
                axes=turn @ s["axes"],
                damping=s["c"],
                zeta=s["zeta"],
            )
        return model

    def matrices(self):
        """M, K, C (explicit dampers) over all bodies, then the fixation."""
        points = [*self.cog, self.fixation] if self.fixed else list(self.cog)
        size = 6 * len(points)
        M, K, C = (np.zeros((size, size)) for _ in range(3))
        for i, m in enumerate(self.mass):
            M[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = m * np.eye(3)
            M[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = tensor(self.inertia[i])
        for s in self.springs:
            rows = self.strain(s)
            K += rows.T @ np.diag(s["k"]) @ rows
            if s["c"] is not None:
                C += rows.T @ np.diag(s["c"]) @ rows
        return M, K, C

    def strain(self, s):
        """(6, N) deformation of a spring along its own axes at its elastic centre."""
        points = [*self.cog, self.fixation] if self.fixed else list(self.cog)
        centre = (s["p1"] + s["p2"]) / 2
        turn = np.kron(np.eye(2), s["axes"].T)
        rows = np.zeros((6, 6 * len(points)))
        for sign, i in ((-1, s["ends"][0]), (1, s["ends"][1])):
            rows[:, 6 * i : 6 * i + 6] += sign * turn @ lever(centre - points[i])
        return rows


def scaled_error(a, b):
    """Largest |a - b| over sqrt(b_ii b_jj)."""
    scale = np.sqrt(np.abs(np.diag(b)))
    return np.max(np.abs(a - b) / np.outer(scale, scale))
