"""A results folder: whole or not there, one writer, and errors that name the file."""

import errno
import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest

from jaxbiped import files
from jaxbiped.config import Model
from jaxbiped.errors import InputError
from jaxbiped.statistics.schema import SCHEMA
from jaxbiped.study import store
from jaxbiped.study.lock import FolderLock
from tests.study.synthetic import rows

FRAME = rows(20)


class Config(Model):
    cost: float = 1.0


def create(folder, **changes):
    return store.create(
        folder, store.StudyHeader(Config(), **{"seed": 3, "arenas": 20, "command": "jaxbiped compare", **changes})
    )


def listing(folder):
    return sorted(str(path.relative_to(folder)) for path in Path(folder).rglob("*"))


@pytest.fixture
def finished(tmp_path):
    with create(tmp_path / "r") as results:
        results.append(FRAME.filter(pl.col("arena") >= 10), shard=1)
        results.append(FRAME.filter(pl.col("arena") < 10), shard=0)
        results.finish(compile_time=2.5)
    return tmp_path / "r"


def test_what_is_read_has_names(finished):
    found = store.read(finished)
    rows, manifest = found
    assert found.rows is rows and found.manifest is manifest
    with pytest.raises(AttributeError):
        found.rows = None


def test_what_is_written_is_read(finished):
    frame, manifest = store.read(finished)
    assert frame.equals(FRAME.sort("arena", maintain_order=True))
    assert (manifest.state, manifest.shards, manifest.rows, manifest.seed, manifest.arenas) == (
        "finished",
        2,
        100,
        3,
        20,
    )
    assert (manifest.config, manifest.command, manifest.compile_time) == ({"cost": 1.0}, "jaxbiped compare", 2.5)
    assert set(manifest.versions) == {"jaxbiped", "jax", "jaxlib", "numpy", "mujoco", "python"}
    assert manifest.wall_time > 0 and manifest.device and len(manifest.config_hash) == 12
    assert listing(finished) == ["manifest.json", "rows", "rows/part-00000.parquet", "rows/part-00001.parquet"]


def test_scan_is_lazy_and_the_same(finished):
    lazy = store.scan(finished)
    assert isinstance(lazy, pl.LazyFrame)
    assert lazy.collect().sort("arena", "strategy").equals(FRAME.sort("arena", "strategy"))


def test_shards_are_numbered_and_missing_ones_show(tmp_path):
    with create(tmp_path / "r") as results:
        assert results.append(FRAME.head(5)).name == "part-00000.parquet"
        assert results.append(FRAME.slice(5, 5), shard=7).name == "part-00007.parquet"
        assert results.append(FRAME.slice(10, 5)).name == "part-00008.parquet"
        assert results.done() == {0, 7, 8}
        with pytest.raises(InputError, match=r"part-00007.parquet: this shard is already written"):
            results.append(FRAME.slice(15, 5), shard=7)


def test_a_bad_frame_writes_nothing(tmp_path):
    with create(tmp_path / "r") as results, pytest.raises(InputError, match="elapsed"):
        results.append(FRAME.drop("elapsed"))
    assert listing(tmp_path) == []


@pytest.mark.parametrize("kind", ["filled", "file"])
def test_an_existing_place_is_refused(tmp_path, kind):
    place = tmp_path / "r"
    if kind == "filled":
        place.mkdir()
        (place / "notes.txt").write_text("mine")
    else:
        place.write_text("mine")
    before = listing(tmp_path)
    with pytest.raises(InputError, match=r"r: .*must be new or empty"):
        create(place)
    assert listing(tmp_path) == before


def test_an_empty_folder_is_taken(tmp_path):
    with create(tmp_path) as results:
        results.append(FRAME)
        results.finish()
    assert store.read(tmp_path)[0].height == 100


def test_a_stopped_study_keeps_its_shards_and_says_so(tmp_path):
    with pytest.raises(KeyboardInterrupt), create(tmp_path / "r") as results:
        results.append(FRAME.head(50))
        raise KeyboardInterrupt
    frame, manifest = store.read(tmp_path / "r")
    assert manifest.state == "stopped" and frame.height == 50
    assert listing(tmp_path / "r") == ["manifest.json", "rows", "rows/part-00000.parquet"]


def test_a_study_stopped_before_its_first_shard_leaves_nothing(tmp_path):
    with pytest.raises(KeyboardInterrupt), create(tmp_path / "r"):
        raise KeyboardInterrupt
    assert listing(tmp_path) == []


def test_one_writer(tmp_path):
    with create(tmp_path / "r"), pytest.raises(InputError, match=rf"is being written by process {os.getpid()}"):
        FolderLock(tmp_path / "r")


def test_the_lock_of_another_process_is_alive_until_it_dies(tmp_path):
    script = (
        f"from jaxbiped.study.lock import FolderLock; FolderLock({str(tmp_path)!r}); print('held', flush=True); input()"
    )
    holder = subprocess.Popen([sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(InputError, match=f"process {holder.pid}"):
            create(tmp_path)
    finally:
        holder.kill()  # dies without letting go: its lock file stays, dead
        holder.wait()
        holder.stdin.close()
        holder.stdout.close()
    assert (tmp_path / ".lock").exists()
    create(tmp_path).close()
    assert listing(tmp_path) == []


def full_disk(*_):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_at_the_start_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(files.os, "fsync", full_disk)
    with pytest.raises(InputError, match=r"manifest.json: cannot be written: no space left on device"):
        create(tmp_path / "r")
    assert listing(tmp_path) == []


def test_a_full_disk_in_the_middle_keeps_whole_shards_only(tmp_path):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    cannot = pytest.raises(InputError, match=r"part-00001.parquet: cannot be written: file too large")
    with cannot, create(tmp_path / "r") as results:
        results.append(FRAME)
        try:
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, before[1]))  # a real write, really cut short
            results.append(rows(400, seed=1).with_columns(pl.col("arena") + 20))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert listing(tmp_path / "r") == ["manifest.json", "rows", "rows/part-00000.parquet"]
    assert store.read(tmp_path / "r")[0].height == 100


def test_a_place_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file/r: cannot be written"):
        create(tmp_path / "file" / "r")


@pytest.mark.parametrize("read", [store.read, store.scan])
@pytest.mark.parametrize("damage", ["cut", "garbage", "empty"])
def test_a_damaged_shard_is_named(finished, read, damage):
    path = finished / "rows" / "part-00001.parquet"
    data = path.read_bytes()
    path.write_bytes({"cut": data[: len(data) // 2], "garbage": b"not parquet" * 9, "empty": b""}[damage])
    with pytest.raises(InputError, match=r"part-00001.parquet: is damaged"):
        read(finished)


def test_a_shard_of_other_columns_is_named(finished):
    FRAME.drop("code").write_parquet(finished / "rows" / "part-00001.parquet")
    with pytest.raises(InputError, match=r"part-00001.parquet: code: column missing"):
        store.read(finished)
    with pytest.raises(InputError, match=r"part-00001.parquet: is not a shard of this format"):
        store.scan(finished)


def test_a_lost_shard_is_noticed(finished):
    (finished / "rows" / "part-00001.parquet").unlink()
    with pytest.raises(InputError, match=r"1 shards with 50 rows, where the manifest says 2 with 100"):
        store.read(finished)


def test_manifests_that_cannot_be_read_are_named(tmp_path, finished):
    with pytest.raises(InputError, match="nowhere: no such results folder"):
        store.read(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"has no manifest.json"):
        store.read(tmp_path)
    manifest = finished / "manifest.json"
    data = json.loads(manifest.read_text())
    for text, match in [
        (manifest.read_text()[:40], "manifest.json: is not valid JSON"),
        (json.dumps(data | {"format": 2}), r"reads manifests of format 1 \(got 2\)"),
        (json.dumps([1]), "reads manifests of format 1"),
        (json.dumps(data | {"seed": "three"}), r"manifest.json: seed: .*whole number"),
        (json.dumps(data | {"colour": 1}), "manifest.json: colour: unknown key"),
    ]:
        manifest.write_text(text)
        with pytest.raises(InputError, match=match):
            store.read(finished)


def test_an_empty_study_reads_as_no_rows(tmp_path):
    with create(tmp_path / "r") as results:
        results.finish()
    frame, manifest = store.read(tmp_path / "r")
    assert frame.schema == SCHEMA and frame.height == 0 and manifest.rows == 0
    assert store.scan(tmp_path / "r").collect().height == 0
