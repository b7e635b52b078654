"""One study on 1, 2 and 4 devices: the same bits in the same rows."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from jaxbiped.study import shard_files, store


@pytest.mark.parametrize(
    ("sensor", "counts"),
    [("oracle", (1, 4)), pytest.param("raycast", (1, 2, 4), marks=pytest.mark.slow)],  # a compilation for each count
)
def test_number_of_devices_does_not_matter(tmp_path, sensor, counts):
    environment = os.environ | {"XLA_FLAGS": "--xla_force_host_platform_device_count=4"}
    argv = [sys.executable, "-m", "tests.study.on_devices", str(tmp_path), sensor, *map(str, counts)]
    subprocess.run(argv, check=True, env=environment, cwd=Path(__file__).parents[2])
    first, _ = store.read(tmp_path / "1")
    assert first.height == 44 and first["code"].n_unique() > 1
    with np.load(tmp_path / "cores.npz") as expected:
        assert 0.5 < np.isfinite(expected["arr_0"]).mean() < 1
        for count in counts:
            assert store.read(tmp_path / str(count))[0].equals(first), count
            for path in shard_files.shard_paths(tmp_path / "1"):
                assert (tmp_path / str(count) / "rows" / path.name).read_bytes() == path.read_bytes()
            with np.load(tmp_path / f"{count}.npz") as found:
                for name in expected:
                    np.testing.assert_array_equal(found[name], expected[name], err_msg=f"{count} {name}")
