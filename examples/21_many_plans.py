"""
Many plans
==========

A study plans a scene with fields that vary, in worker processes, and keeps a table of the results:
here, where a two-link arm can put a payload within a second, and what that costs.
"""

# %%
# What varies is named by the fields of the scene file. Positions of the tip are replaced by the
# nearest configurations that reach them.

import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
box = {"lower": [-2.1, 0.0, -2.1], "upper": [2.1, 0.0, 2.1], "grid": [15, 1, 15]}
study = hovi.Study(
    scene="two_link_reach",
    vary=[
        {"field": "goal", "poses": {"frame": "tip", **box}},
        {"field": "effects.payload", "values": [{"frame": "tip", "mass": 0.5}]},
    ],
)
print(f"{study.count} plans")

# %%
# The same call continues what was interrupted, and does nothing where all is done.

report = study.run(folder / "study", workers=2)
print(f"{report.new} of {report.count} plans were missing, {report.failures}")
assert report.complete
assert study.run(folder / "study").new == 0

# %%
# The table is a frame of pandas, or of polars with ``frame="polars"``.

plans = hovi.Study.load(folder / "study")
minima = plans[plans["success"]]
print(plans["status"].value_counts())
print(minima[["goal.position[0]", "goal.position[2]", "cost", "nit"]].describe())

# %%
# The arm hangs at rest, so a goal near the bottom costs least, and one at the top most.

figure, ax = plt.subplots(layout="constrained")
missed = plans[~plans["success"]]
ax.plot(missed["goal.position[0]"], missed["goal.position[2]"], ".", color="0.8")
drawn = ax.scatter(
    minima["goal.position[0]"], minima["goal.position[2]"], c=minima["cost"], norm="log", s=40
)
figure.colorbar(drawn, label="cost")
ax.set(xlabel="x [m]", ylabel="z [m]", aspect="equal")
figure.savefig(folder / "reach.png")

# %%
# Each motion is stored, and any of them can be replayed.

dearest = minima.loc[minima["cost"].idxmax()]
motion = hovi.Study.motion(folder / "study", dearest["key"])
print(f"the dearest of them costs {dearest['cost']:.4g} and lasts {motion.duration} s")
