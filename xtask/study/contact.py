"""Tissue that an applicator presses, solved anew by another finite-element program.

python contact.py PROBLEM.npz

The problem is what `bench-contact` writes: neo-Hookean tetrahedra (E 0.609 kPa, nu 0.45), held nodes, a load per
volume, a sphere on a shaft without friction. felupe computes the forces and the stiffness of the tissue. The
contact is a penalty at the nodes of the surface, stiffer from round to round: energy k/2 gap^2 for each node in
each part (sphere, side of the shaft). The tissue is loaded first, with no applicator; then the applicator comes
in steps: from outside along `away`, or in its cavity by growing. Newton with a line search on the energy.
One line of JSON: largest and mean distance to the displacement of `bench-contact` over all nodes (mm), the
resulting force of both (mN) and how far they are apart, the distance from round to round, the deepest node.
"""

import json
import os
import sys

for name in ("OMP", "MKL", "OPENBLAS"):
    os.environ[f"{name}_NUM_THREADS"] = "1"
import felupe as fe
import numpy as np
import pypardiso
import scipy.sparse as sparse

YOUNG_KPA, POISSON = 0.609, 0.45
MU = YOUNG_KPA / 2 / (1 + POISSON)
LAMBDA = YOUNG_KPA * POISSON / (1 + POISSON) / (1 - 2 * POISSON)
# mN/mm, stiffer from round to round.
PENALTIES = (1.0, 10.0, 100.0, 1e3, 1e4, 1e5)
STEPS = 10
ITERATIONS = 80
GOAL_MN = 1e-7
# So far outside an applicator begins, mm.
AWAY_MM = 60.0
FACES = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


def surface_nodes(cells):
    """Nodes on faces of one cell alone."""
    corners = np.concatenate([cells[:, face] for face in FACES])
    _, where, count = np.unique(
        np.sort(corners, axis=1), axis=0, return_index=True, return_counts=True)
    open_faces = where[count == 1]
    nodes = [corners[open_faces].ravel()]
    if cells.shape[1] == 10:
        face, cell = np.divmod(open_faces, len(cells))
        for f, corner in enumerate(FACES):
            for e, ends in enumerate(EDGES):
                if set(ends) <= set(corner):
                    nodes.append(cells[cell[face == f], 4 + e])
    return np.unique(np.concatenate(nodes))


class Tissue:
    """The cells, their energy, forces and stiffness."""

    def __init__(self, problem):
        self.x, cells = problem["nodes"], problem["cells"]
        quadratic = cells.shape[1] == 10
        mesh = fe.Mesh(self.x, cells, "tetra10" if quadratic else "tetra")
        self.region = (fe.RegionQuadraticTetra if quadratic else fe.RegionTetra)(mesh)
        self.field = fe.FieldContainer([fe.Field(self.region, dim=3)])
        self.law = fe.NeoHookeCompressible(mu=MU, lmbda=LAMBDA)
        self.solid = fe.SolidBody(self.law, self.field)
        force = fe.SolidBodyForce(self.field, values=problem["load"])
        self.weight = -np.asarray(force.assemble.vector(self.field).toarray()).ravel()
        # The sign that a body force has differs between versions: it does positive work along itself.
        self.weight *= np.sign(self.weight.reshape(-1, 3).sum(axis=0) @ problem["load"])
        still = np.ones(len(self.x), bool)
        still[np.unique(cells)] = False
        still[problem["held"]] = True
        self.free = np.flatnonzero(np.repeat(~still, 3))
        on = surface_nodes(cells)
        self.surface = on[~still[on]]

    def energy(self, u, scale):
        self.field[0].values[:] = u
        with np.errstate(invalid="ignore"):
            density = self.law.function([*self.field.extract(), None])[0]
        total = (density * self.region.dV).sum() - scale * self.weight @ u.ravel()
        return total if np.isfinite(total) else np.inf

    def forces(self, u, scale):
        self.field[0].values[:] = u
        inner = self.solid.assemble.vector(self.field).toarray().ravel()
        return inner - scale * self.weight, self.solid.assemble.matrix(self.field).tocsr()


class Applicator:
    """A sphere on a shaft that pushes nodes out with a stiffness."""

    def __init__(self, centre, radius, axis, shaft, penalty):
        self.centre, self.radius, self.axis = centre, radius, axis
        self.shaft, self.penalty = shaft, penalty

    def gaps(self, places):
        """Gap, direction and 1 / distance from the axis or centre, for each part; gaps of parts that do not act are 0."""
        out = places - self.centre
        far = np.linalg.norm(out, axis=1)
        yield far - self.radius, out / far[:, None], 1 / far, None
        if self.shaft[0] > 0:
            along = out @ self.axis
            beside = out - along[:, None] * self.axis
            far = np.linalg.norm(beside, axis=1)
            gap = np.where((along >= 0) & (along <= self.shaft[1]), far - self.shaft[0], 0.0)
            yield gap, beside / far[:, None], 1 / far, self.axis

    def energy(self, places):
        return sum(self.penalty / 2 * (np.minimum(gap, 0) ** 2).sum() for gap, *_ in self.gaps(places))

    def forces(self, places):
        """Gradient of the energy (n, 3) and its 3 x 3 blocks."""
        gradient, blocks = np.zeros_like(places), np.zeros((len(places), 3, 3))
        for gap, normal, bend, axis in self.gaps(places):
            depth = np.minimum(gap, 0)
            gradient += self.penalty * depth[:, None] * normal
            both = normal[:, :, None] * normal[:, None, :]
            flat = np.eye(3) - both - (0 if axis is None else np.outer(axis, axis))
            blocks += self.penalty * ((gap < 0)[:, None, None] * both + (depth * bend)[:, None, None] * flat)
        return gradient, blocks


def equilibrium(tissue, u, scale, applicator=None):
    """Newton from u; the mixed second term of the gap is left out where the matrix would lose its sign."""
    solver = pypardiso.PyPardisoSolver()
    on = tissue.surface
    dofs = (3 * on[:, None] + np.arange(3)).astype(int)

    def energy(u):
        contact = applicator.energy(tissue.x[on] + u[on]) if applicator else 0.0
        return tissue.energy(u, scale) + contact

    now = energy(u)
    for _ in range(ITERATIONS):
        residual, matrix = tissue.forces(u, scale)
        if applicator:
            gradient, blocks = applicator.forces(tissue.x[on] + u[on])
            np.add.at(residual, dofs.ravel(), gradient.ravel())
            rows, columns = np.repeat(dofs, 3, axis=1).ravel(), np.tile(dofs, (1, 3)).ravel()
            matrix = matrix + sparse.csr_matrix((blocks.ravel(), (rows, columns)), matrix.shape)
        free = tissue.free
        if np.abs(residual[free]).max() < GOAL_MN:
            return u
        step = np.zeros(residual.size)
        step[free] = -solver.solve(matrix[free][:, free].tocsr(), residual[free])
        slope = residual @ step
        if slope > 0:
            step, slope = -step, -slope
        share = 1.0
        while share > 1e-6:
            tried = u + share * step.reshape(u.shape)
            then = energy(tried)
            # Near the end rounding hides the descent.
            if then <= now + 1e-4 * share * slope + 1e-13 * abs(now):
                break
            share /= 2
        u, now = tried, then
    raise RuntimeError(f"residual {np.abs(residual[free]).max():.1e} mN after {ITERATIONS} iterations")


def solve(problem):
    tissue = Tissue(problem)
    u = np.zeros_like(tissue.x)
    for k in range(1, 5):
        u = equilibrium(tissue, u, k / 4)
    radius, shaft = problem["radius"][0], problem["shaft"]
    from_outside = problem["away"].any()
    for k in range(1, STEPS + 1):
        share = k / STEPS
        centre = problem["centre"] + (1 - share) * AWAY_MM * problem["away"]
        grown = 1.0 if from_outside else share
        at = (centre, grown * radius, problem["axis"], shaft * [grown, 1.0])
        u = equilibrium(tissue, u, 1.0, Applicator(*at, PENALTIES[0]))
    rounds, on = [], tissue.surface
    for penalty in PENALTIES[1:]:
        before, applicator = u, Applicator(*at, penalty)
        u = equilibrium(tissue, u, 1.0, applicator)
        rounds.append(float(np.linalg.norm(u - before, axis=1).max()))
    gradient, _ = applicator.forces(tissue.x[on] + u[on])
    forces = np.zeros_like(u)
    forces[on] = -gradient
    deepest = min(gap.min() for gap, *_ in applicator.gaps(tissue.x[on] + u[on]))
    return tissue, u, forces, rounds, float(deepest)


def main():
    problem = dict(np.load(sys.argv[1]))
    tissue, u, forces, rounds, deepest = solve(problem)
    bears = np.unique(problem["cells"])
    off = np.linalg.norm((u - problem["moved"])[bears], axis=1)
    own, theirs = problem["forces"].sum(axis=0), forces.sum(axis=0)
    print(json.dumps({
        "nodes": len(bears), "off_mm": off.max(), "mean_mm": off.mean(),
        "moved_mm": float(np.linalg.norm(u[bears], axis=1).max()),
        "force_mn": float(np.linalg.norm(theirs)), "own_force_mn": float(np.linalg.norm(own)),
        "force_off": float(np.linalg.norm(own - theirs) / np.linalg.norm(theirs)),
        "node_force_off": float(
            np.linalg.norm(problem["forces"] - forces, axis=1).max() / np.linalg.norm(forces, axis=1).max()),
        "rounds_mm": rounds, "deepest_mm": deepest,
        "pressed": int((np.linalg.norm(forces, axis=1) > 0).sum()),
    }))


if __name__ == "__main__":
    main()
