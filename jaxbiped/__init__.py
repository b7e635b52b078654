"""Batch evaluation, in JAX, of stereo grid-map motion planning for biped robots.

The method is that of Yamashita, Kitaoka and Kaneko, "Motion Planning of Biped Robot Equipped with
Stereo Camera Using Grid Map" (2011), called "the paper" in every docstring of this package.
The rooms follow the paper's Fig. 2: arenas, sensing, mapping, planning, motion, mission; then study
and report. A room uses the rooms before it, never those after it.
"""

__version__ = "0.1.0"
