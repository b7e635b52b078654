"""The grid's layout: what is allowed."""

import pytest

from jaxbiped.config import parse
from jaxbiped.errors import InputError
from jaxbiped.mapping.config import MapConfig
from jaxbiped.mapping.grid import GridSpec


@pytest.mark.parametrize(
    ("pitch", "shape"), [(0.1, (14, 18)), (0.05, (28, 36)), (0.025, (56, 72)), (0.0125, (112, 144)), (0.2, (7, 9))]
)
def test_shapes(pitch, shape):
    assert GridSpec(pitch=pitch).shape == shape
    assert GridSpec(pitch=pitch).cell_share == pytest.approx(pitch**2 / 0.0025)


@pytest.mark.parametrize(
    ("field", "numbers"),
    [
        ("pitch", {"pitch": 0.03}),
        ("pitch", {"pitch": 1.7}),
        ("pitch", {"pitch": 0.0}),
        ("pitch", {"pitch": -0.05}),
        ("pitch", {"pitch": float("nan")}),
        ("pitch", {"size_x": float("inf")}),
        ("lowest", {"lowest": 1}),
        ("ground_levels", {"ground_levels": 0}),
        ("levels", {"levels": 3}),
        ("levels", {"levels": 40}),
        ("level_height", {"level_height": 0.0}),
        ("max_radius", {"max_radius": 5.0}),
        ("max_radius", {"max_radius": float("nan")}),
    ],
)
def test_bad_layouts_name_the_field(field, numbers):
    with pytest.raises(InputError) as caught:
        GridSpec(**numbers)
    assert caught.value.field == field


@pytest.mark.parametrize(
    "wrong", [{"voxel_share": 1.0}, {"max_range": 0}, {"solid_points": -1}, {"refit_inlier": float("nan")}, {"typo": 1}]
)
def test_bad_thresholds(wrong):
    with pytest.raises(InputError):
        parse(MapConfig, wrong)


def test_traced_thresholds_have_every_field():
    params = MapConfig(fused_points=12).params()
    assert params.fused_points == 12 and params.voxel_points == 2
