"""A linear problem of the mechanics' reference data solved by another finite-element program.

python solvers.py dolfinx|felupe MESH.npz tilt|sit TOLERANCE

The problem of `supine solve` with the rest state `net`: neo-Hookean tetrahedra with four nodes, E 0.609 kPa,
nu 0.45, 1000 kg/m3, nodes of the chest wall held, the load the change of gravity from supine. Newton with
full steps, a direct solver, one thread. TOLERANCE: norm of the residual, relative to that of the load.
It is solved twice from the start and the second time counts, so that compiling and loading do not.
One line of JSON: CPU seconds, Newton iterations, memory before and at most (MB), largest displacement (mm);
null where the program finds no solution.
"""

import json
import os
import resource
import sys
import time

for name in ("OMP", "MKL", "OPENBLAS"):
    os.environ[f"{name}_NUM_THREADS"] = "1"
import numpy as np

YOUNG_KPA, POISSON, WEIGHT = 0.609, 0.45, 1000 * 9.81e-6
MU = YOUNG_KPA / 2 / (1 + POISSON)
LAMBDA = YOUNG_KPA * POISSON / (1 + POISSON) / (1 - 2 * POISSON)
ITERATIONS = 30


def force(pose):
    """Change of gravity from supine, kPa/mm."""
    ap, lat = np.radians(7.0), np.radians(5.0)
    tilt = [np.sin(lat) * np.cos(ap), np.cos(lat) * np.cos(ap), -np.sin(ap)]
    target = {"tilt": tilt, "sit": [0.0, 0.0, -1.0]}[pose]
    return WEIGHT * (np.array(target) - np.array([0.0, 1.0, 0.0]))


def dolfinx(mesh, pose, tolerance):
    import ufl
    from dolfinx import fem, nls
    from dolfinx import mesh as meshes
    from dolfinx.fem.petsc import NonlinearProblem
    from mpi4py import MPI
    from petsc4py import PETSc

    cell = ufl.Mesh(ufl.VectorElement("Lagrange", "tetrahedron", 1))
    body = meshes.create_mesh(MPI.COMM_WORLD, mesh["tets"].astype(np.int64), mesh["nodes"], cell)
    space = fem.VectorFunctionSpace(body, ("Lagrange", 1))
    # The program numbers nodes anew; it keeps what they were called.
    given = np.empty(len(mesh["nodes"]), int)
    given[space.dofmap.list.array] = np.asarray(body.geometry.input_global_indices)[
        body.geometry.dofmap.array]
    wall = np.flatnonzero(np.isin(given, mesh["wall"])).astype(np.int32)
    held = fem.dirichletbc(np.zeros(3), wall, space)
    u, v, du = fem.Function(space), ufl.TestFunction(space), ufl.TrialFunction(space)
    gradient = ufl.Identity(3) + ufl.grad(u)
    log_j = ufl.ln(ufl.det(gradient))
    energy = (MU / 2 * (ufl.inner(gradient, gradient) - 3) - MU * log_j + LAMBDA / 2 * log_j**2)
    load = fem.Constant(body, force(pose))
    whole = energy * ufl.dx(degree=1) - ufl.dot(load, u) * ufl.dx(degree=2)
    residual = ufl.derivative(whole, u, v)
    problem = NonlinearProblem(residual, u, [held], ufl.derivative(residual, u, du))

    free = np.isin(np.arange(len(given)), mesh["wall"], invert=True)
    goal = tolerance * np.linalg.norm(nodal_load(mesh, pose)[free])

    def solve():
        u.x.array[:] = 0
        solver = nls.petsc.NewtonSolver(MPI.COMM_WORLD, problem)
        solver.rtol, solver.atol, solver.max_it = 0, goal, ITERATIONS
        solver.convergence_criterion = "residual"
        linear = solver.krylov_solver
        linear.setType("preonly")
        linear.getPC().setType("lu")
        linear.getPC().setFactorSolverType("mumps")
        iterations, _ = solver.solve(u)
        moved = np.empty((len(given), 3))
        moved[given] = u.x.array.reshape(-1, 3)
        return iterations, moved

    return solve


def nodal_load(mesh, pose):
    """A quarter of each tetrahedron's share at each of its nodes, mN."""
    corners = mesh["nodes"][mesh["tets"]]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    share = np.bincount(mesh["tets"].ravel(), np.repeat(volume / 4, 4), len(mesh["nodes"]))
    return share[:, None] * force(pose)


def felupe(mesh, pose, tolerance):
    import felupe as fe
    import pypardiso

    def solve():
        body = fe.Mesh(mesh["nodes"], mesh["tets"], "tetra")
        field = fe.FieldContainer([fe.Field(fe.RegionTetra(body), dim=3)])
        solid = fe.SolidBody(fe.NeoHookeCompressible(mu=MU, lmbda=LAMBDA), field)
        values = nodal_load(mesh, pose)
        weight = fe.PointLoad(field, np.arange(len(values)).tolist(), values=values)
        mask = np.isin(np.arange(len(values)), mesh["wall"])
        bounds = {"wall": fe.Boundary(field[0], mask=mask)}
        fixed, free = fe.dof.partition(field, bounds)
        pardiso = pypardiso.PyPardisoSolver()
        done = fe.newtonraphson(
            items=[solid, weight], dof0=fixed, dof1=free,
            ext0=fe.dof.apply(field, bounds, fixed),
            solver=lambda matrix, right: pardiso.solve(matrix.tocsr(), right),
            tol=tolerance, maxiter=ITERATIONS, verbose=0)
        return done.iterations, field[0].values

    return solve


def memory_mb(line):
    with open("/proc/self/status") as status:
        return next(int(w.split()[1]) for w in status if w.startswith(line)) * 1.024e-3


def main():
    program, path, pose, tolerance = sys.argv[1:]
    mesh = dict(np.load(path))
    mesh["wall"] = np.unique(mesh["tris"][mesh["tags"] == 1])
    solve = {"dolfinx": dolfinx, "felupe": felupe}[program](mesh, pose, float(tolerance))
    before = memory_mb("VmRSS")
    for _ in range(2):
        start = time.process_time()
        try:
            iterations, moved = solve()
        except (RuntimeError, ValueError) as reason:
            # What both raise when they do not converge.
            print("null")
            print(reason, file=sys.stderr)
            return
        seconds = time.process_time() - start
    print(json.dumps({
        "cpu_s": seconds, "iterations": int(iterations), "before_mb": before,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1.024e-3,
        "max_mm": float(np.linalg.norm(moved, axis=1).max()),
    }))


if __name__ == "__main__":
    main()
