"""hovi and another library in one environment: installed, imported in both orders, a plan, gravity.

python examples/benchmarks/one_environment.py [HOVI] [--python PYTHON] [--only NAME ...]

HOVI is what pip installs, such as a wheel; by default the folder of the project. Each
library gets an environment of its own with hovi, and a row. Nothing of this runs in CI.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
MINUTES = 20
"""Time limit of an installation, in [min]."""
COMMON = """
import json, sys, warnings
order = sys.argv[1]
if order == "hovi first":
    import hovi
IMPORT
import hovi
import numpy as np
path = str(hovi.example("two_link.urdf"))
scene = hovi.Scene(hovi.load_robot(path), [hovi.effects.Gravity()])
motion = hovi.plan(scene, [0.0, 0.0], [0.6, 0.4], 1.0, limits="none")
at = motion.trajectory.sample([0.0, 0.37, 1.0])
rows = list(zip(at.q, at.v, at.a, strict=True))
TORQUES
apart = float(np.abs(np.array(tau) - at.tau).max())
print(json.dumps([str(motion.status), apart]))
"""
PINOCCHIO = """
model = pinocchio.buildModelFromUrdf(path)
data = model.createData()
tau = [pinocchio.rnea(model, data, *row) for row in rows]
"""


@dataclass(frozen=True)
class Library:
    """A library: what pip installs, the name of its module, and its torques for `rows`."""

    package: str
    imported: str
    torques: str

    @property
    def program(self) -> str:
        """Prints the status of a plan of hovi, and how far the torques are apart, in [N m]."""
        return COMMON.replace("IMPORT", self.imported).replace("TORQUES", self.torques)


LIBRARIES = {
    "pink": Library(
        "pin-pink",
        "import pinocchio, pink",
        PINOCCHIO + "pink.Configuration(model, data, rows[0][0])",
    ),
    "mujoco": Library(
        "mujoco",
        "import mujoco",
        """
spec = mujoco.MjSpec.from_file(path)  # a link without inertia would get that of its shape
spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
model = spec.compile()
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT  # contacts of links that meet
data, tau = mujoco.MjData(model), []
for q, v, a in rows:
    data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
    mujoco.mj_inverse(model, data)
    tau.append(data.qfrc_inverse.copy())
""",
    ),
    "drake": Library(
        "drake",
        "import pydrake.all as drake",
        """
plant = drake.MultibodyPlant(0.0)
drake.Parser(plant).AddModels(path)
plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
plant.Finalize()
context, tau = plant.CreateDefaultContext(), []
forces = drake.MultibodyForces(plant)
for q, v, a in rows:
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    plant.CalcForceElementsContribution(context, forces)
    tau.append(plant.CalcInverseDynamics(context, a, forces))
""",
    ),
    "crocoddyl": Library(
        "crocoddyl",
        "import pinocchio, crocoddyl",
        PINOCCHIO
        + """
state = crocoddyl.StateMultibody(model)
assert np.allclose(state.integrate(state.zero(), np.ones(4)), 1.0)
""",
    ),
}


def last_line(done: subprocess.CompletedProcess[str]) -> str:
    """What a program says last, shortened for a table."""
    lines = [line for line in (done.stderr or done.stdout).splitlines() if line.strip()]
    said = next((line for line in lines if line.startswith("ERROR")), lines[-1] if lines else "")
    return said[:160].replace("|", "/") or f"exit code {done.returncode}"


def row(name: str, hovi: str, python: str) -> list[str]:
    """What was tried with a library."""
    library = LIBRARIES[name]
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([python, "-m", "venv", folder], check=True)
        inside = str(Path(folder) / "bin" / "python")
        install = [inside, "-m", "pip", "install", "--quiet", hovi, library.package]
        done = subprocess.run(install, capture_output=True, text=True, timeout=60 * MINUTES)
        if done.returncode != 0:
            return [name, "", f"not installed together: {last_line(done)}", "", ""]
        version = f"import importlib.metadata as m; print(m.version({library.package!r}))"
        known = subprocess.run([inside, "-c", version], capture_output=True, text=True)
        found = [tried(library, inside, order) for order in ("hovi first", "hovi second")]
    return [name, known.stdout.strip(), *(said for said, _ in found), found[0][1]]


def tried(library: Library, python: str, order: str) -> tuple[str, str]:
    """What came of a program in one order of the imports, and of its torques."""
    done = subprocess.run(
        [python, "-c", library.program, order], capture_output=True, text=True, cwd="/"
    )
    if done.returncode != 0:
        return f"fails: {last_line(done)}", ""
    status, apart = json.loads(done.stdout.splitlines()[-1])
    return f"plan: {status}", f"{apart:.0e} N m"


def main(arguments: list[str]) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("hovi", nargs="?", default=str(TOP))
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--only", nargs="*", default=list(LIBRARIES))
    given = parser.parse_args(arguments)
    print("| library | version | imported after hovi | before hovi | torques apart by |")
    print("|---|---|---|---|---:|")
    for name in given.only:
        print("| " + " | ".join(row(name, given.hovi, given.python)) + " |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
