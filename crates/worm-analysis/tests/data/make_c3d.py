"""Makes worm.c3d, a real C3D file as motion capture leaves it: `python make_c3d.py worm.csv worm.c3d`, with ezc3d 1.7.

worm.csv is from `wormd simulate --slope 20 --cycles 3 --rate 10 --noise 0 --positions-only --out worm.csv`. The canal lies
askew in the laboratory (rotated about two axes and shifted), each cell's marker sits a little aside, a marker on the canal's
wall stands still, one label was never seen, and cell 2 is lost in one frame. An analogue channel with two samples a frame
is there because laboratories have them.
"""

import csv
import sys

import ezc3d
import numpy as np

rows = list(csv.DictReader(line for line in open(sys.argv[1]) if not line.startswith("#")))
along = np.array([[float(row[f"x{cell}_m"]) for row in rows] for cell in range(1, 5)]) * 1e3
frames = along.shape[1]
axis = np.array([np.cos(0.3) * np.cos(0.35), np.cos(0.3) * np.sin(0.35), np.sin(0.3)])
asides = np.array([[2.0, -1.0, 15.0], [1.0, 3.0, 14.0], [-2.0, 0.5, 16.0], [0.0, -3.0, 15.5]])
asides -= np.outer(asides @ axis, axis)

# In an order that tells nothing of the cells.
labels = ["Wall", "Worm:c3", "Worm:c1", "Lost", "Worm:c4", "Worm:c2"]
points = np.zeros((4, len(labels), frames))
points[3] = 1.0
for index, label in enumerate(labels):
    if label.startswith("Worm"):
        cell = int(label[-1]) - 1
        points[:3, index] = (along[cell][:, None] * axis + asides[cell] + [300.0, -120.0, 40.0]).T
    elif label == "Wall":
        points[:3, index] = np.array([[250.0], [-140.0], [10.0]])
    else:
        points[:3, index] = np.nan
points[:3, labels.index("Worm:c2"), 5] = np.nan

file = ezc3d.c3d()
file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
file["parameters"]["POINT"]["RATE"]["value"] = [10.0]
file["parameters"]["POINT"]["LABELS"]["value"] = labels
file["data"]["points"] = points
file["parameters"]["ANALOG"]["RATE"]["value"] = [20.0]
file["parameters"]["ANALOG"]["LABELS"]["value"] = ["one"]
file["data"]["analogs"] = np.zeros((1, 1, frames * 2))
residuals = np.zeros((1, len(labels), frames))
residuals[0][np.isnan(points[0])] = -1.0
file["data"]["meta_points"]["residuals"] = residuals
file.write(sys.argv[2])
