"""Writes the small maps beside it: `python tests/data/make_maps.py`.

A Moving AI map with every terrain, its scenario with optimal lengths from SciPy's Dijkstra in float64, and the same
floor plan as a ROS map with a grey border of unknown cells.
"""

from pathlib import Path

import numpy as np
import yaml
from PIL import Image
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

HERE = Path(__file__).parent
ROWS, COLUMNS = 24, 36


def floor_plan() -> np.ndarray:
    """Characters [ROWS, COLUMNS]: four rooms with doors, a pond, a swamp and a few trees."""
    plan = np.full((ROWS, COLUMNS), ".", "U1")
    plan[0], plan[-1], plan[:, 0], plan[:, -1] = "@", "@", "@", "@"
    plan[11, :], plan[:, 18] = "O", "@"
    plan[11, 5], plan[11, 30], plan[5, 18], plan[17:19, 18] = ".", "G", ".", "."
    plan[3:8, 23:28] = "W"
    plan[14:20, 6:12] = "S"
    rng = np.random.default_rng(2)
    free = np.argwhere(plan == ".")
    trees = free[rng.choice(len(free), 60, replace=False)]
    plan[tuple(trees.T)] = "T"
    plan[5, 17:20], plan[17, 17:20], plan[10:13, 5], plan[10:13, 30] = ".", ".", ".", "G"
    return plan


def graph(free: np.ndarray) -> coo_array:
    """Octile moves between free cells that never cut a corner."""
    rows, columns = free.shape
    number = np.arange(free.size).reshape(free.shape)
    start, end, length = [], [], []
    for i, j in np.argwhere(free):
        for di, dj in [(0, 1), (1, 0), (1, 1), (1, -1)]:
            k, m = i + di, j + dj
            if 0 <= k < rows and 0 <= m < columns and free[k, m] and free[i, m] and free[k, j]:
                start.append(number[i, j])
                end.append(number[k, m])
                length.append(np.hypot(di, dj))
    return coo_array((length, (start, end)), shape=(free.size, free.size)).tocsr()


def main():
    plan = floor_plan()
    text = f"type octile\nheight {ROWS}\nwidth {COLUMNS}\nmap\n" + "".join("".join(row) + "\n" for row in plan)
    (HERE / "rooms.map").write_text(text)
    free = np.isin(plan, [".", "G", "S"])
    edges = graph(free)
    rng = np.random.default_rng(3)
    cells = np.argwhere(free)
    lines = ["version 1"]
    while len(lines) < 41:
        start, goal = cells[rng.integers(len(cells), size=2)]
        length = dijkstra(edges, directed=False, indices=start[0] * COLUMNS + start[1])[goal[0] * COLUMNS + goal[1]]
        if np.isfinite(length):
            positions = [COLUMNS, ROWS, start[1], start[0], goal[1], goal[0]]
            lines.append("\t".join(map(str, [int(length // 4), "rooms.map", *positions, f"{length:.8f}"])))
    (HERE / "rooms.map.scen").write_text("\n".join(lines) + "\n")

    grey = np.where(free, 254, 0).astype(np.uint8)
    grey = np.pad(grey, 2, constant_values=205)  # what map_saver writes for unknown
    Image.fromarray(grey).save(HERE / "rooms.pgm")
    sheet = {
        "image": "rooms.pgm",
        "resolution": 0.05,
        "origin": [-1.0, -0.5, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    (HERE / "rooms.yaml").write_text(yaml.safe_dump(sheet, sort_keys=False))


if __name__ == "__main__":
    main()
