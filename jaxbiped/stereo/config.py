"""The options of the matcher."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from jaxbiped.config import Model


class MatchParams(Model):
    """Parameters of the matcher, with values that proved necessary on rendered and on real pairs.

    Small blocks and low penalties follow slanted surfaces. With penalties four times as high, mode `5way`, OpenCV's own
    default, which has no path from below, has an error of 0.1 px on a receding floor.
    """

    num_disparities: int = Field(160, ge=16, le=2048, multiple_of=16)
    """[px] Search range; sets the nearest distance that can be measured."""
    min_disparity: int = Field(0, ge=-1024, le=1024)
    """[px] Smallest disparity; below 0 for cameras that squint (`doffs`)."""
    block_size: int = Field(3, ge=1, le=11)
    """[px] Side of a block; odd."""
    p1: int = Field(30, ge=0, le=8191)
    """Penalty on a change of disparity by 1 px to the next pixel."""
    p2: int = Field(250, ge=1, le=8192)
    """Penalty on a greater change; above p1. (OpenCV sums penalties in 16 bits.)"""
    pre_filter_cap: int = Field(63, ge=1, le=63)
    """Gradients beyond this are clipped."""
    uniqueness: int = Field(5, ge=0, le=99)
    """[%] Margin by which the best match must beat the next."""
    speckle_size: int = Field(200, ge=0, le=2**30)
    """[px] Patches with no more pixels than this are dropped; 0 for none."""
    speckle_range: int = Field(2, ge=1, le=2048)
    """[px] Largest change of disparity within a patch."""
    left_right: int = Field(1, ge=-1, le=2048)
    """[px] Largest difference of left and right disparities; -1 for no check."""
    agreement: float = Field(0.35, ge=-1, lt=1)
    """Smallest correlation of the two images' gradients around a matched pixel; -1 for no check. Both images share
    texture; plain surfaces show each camera's own noise, which a matcher matches as well, and wrongly."""
    agreement_window: int = Field(15, ge=3, le=101)
    """[px] Side of the window of that correlation; odd."""
    mode: Literal["3way", "hh", "5way"] = "3way"
    """Search paths: 3 (fast), all 8 (3 times the time), or 5."""
    slanted: bool = True
    """Search again for surfaces that one image shows much wider than the other, which takes as long again."""

    @model_validator(mode="after")
    def check_whole(self) -> MatchParams:
        for name in ("block_size", "agreement_window"):
            if getattr(self, name) % 2 == 0:
                raise ValueError(f"{name} must be odd, got {getattr(self, name)}")
        if self.p2 <= self.p1:
            raise ValueError(f"p2 must be above p1 ({self.p1}), got {self.p2}")
        return self
