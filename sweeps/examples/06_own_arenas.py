"""Arenas of your own, from a random key: 06_own_arenas.py [ARENAS]"""

import sys

import jax

import jaxbiped as jb


def corridor(key):
    """A wall with a door of 50 to 70 cm, and a bump in it."""
    width, at = jax.random.uniform(key, (2,))
    low, high = 0.25 + 0.2 * at, 0.75 + 0.2 * at + 0.2 * width  # [m] y of the door's ends
    wall = 0.8, 0.0, 0.2, 0.4  # its x, the yaw, its depth and its height
    boxes = [  # x, y, yaw, length, width, bottom, top
        (wall[0], low / 2, wall[1], wall[2], low, 0.0, wall[3]),
        (wall[0], (high + 1.4) / 2, wall[1], wall[2], 1.4 - high, 0.0, wall[3]),
        (wall[0], (low + high) / 2, wall[1], wall[2], high - low, 0.0, 0.03),
    ]
    return jb.make_arena(boxes, start=(0.2, 0.7, 0.0), goal=(1.5, 0.7), difficulty=1 - width)


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    study = jb.Study(jb.RandomArenas(families=[corridor], count=count), ["full", "floor_only"])
    print(jb.evaluate(study).compare("full", "floor_only"))
