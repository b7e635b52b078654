"""A study that was stopped at any instant goes on, ends as one that never was, and is taken up by nobody else."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from functools import partial

import polars as pl
import pytest

from jaxbiped import files
from jaxbiped.arenas.config import PopulationConfig
from jaxbiped.errors import InputError
from jaxbiped.mission.params import MissionConfig
from jaxbiped.study import shard_files, store
from jaxbiped.study.lock import FolderLock
from jaxbiped.study.resumption import refuse_taken
from jaxbiped.study.run_study import Engine, compute_study
from tests.study.engine import CONFIG, TABLE, engine

compute_here = partial(compute_study, config=CONFIG, engine=Engine(engine))


def listing(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


@pytest.fixture
def stopped(tmp_path):
    """A study that was stopped after four shards."""

    def breaking(config, on_progress=None, **how):
        for count, shard in enumerate(engine(config, on_progress, **how)):
            if count == 4:
                raise KeyboardInterrupt
            yield shard

    with pytest.raises(KeyboardInterrupt):
        compute_study(tmp_path / "r", CONFIG, engine=Engine(breaking))
    return tmp_path / "r"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The same study, never stopped."""
    folder = tmp_path_factory.mktemp("whole") / "r"
    compute_here(folder)
    return folder


def assert_same_study(folder, whole):
    ours, theirs = store.read(folder), store.read(whole)
    assert ours[0].equals(theirs[0]) and ours[0].height == len(TABLE)
    assert listing(folder) == listing(whole)
    for path in shard_files.shard_paths(whole):
        assert (folder / "rows" / path.name).read_bytes() == path.read_bytes()
    known = ("state", "config", "config_hash", "versions", "seed", "arenas", "shards", "rows")
    for name in known:
        assert getattr(ours[1], name) == getattr(theirs[1], name), name


def test_stopped_study_goes_on(stopped, whole):
    before = store.read_manifest(stopped)
    assert before.state == "stopped" and before.wall_time > 0
    manifest = compute_here(stopped, resume=True)
    assert_same_study(stopped, whole)
    assert manifest.resumed == 1 and manifest.wall_time > before.wall_time


@pytest.mark.parametrize("moment", [0, 5])
def test_killed_study_goes_on(tmp_path, whole, moment):
    """SIGKILL as a shard is begun: at most that one is computed twice."""
    folder, begun = tmp_path / "r", tmp_path / "begun"
    child = subprocess.Popen([sys.executable, "-m", "tests.study.engine", str(folder), str(begun)])
    try:
        while not (begun.exists() and begun.read_text().count("\n") > moment):
            assert child.poll() is None
            time.sleep(0.005)
    finally:
        child.send_signal(signal.SIGKILL)
        child.wait()
    done = len(shard_files.shard_paths(folder))
    assert moment <= done <= moment + 1 and store.read_manifest(folder).state == "running"
    assert (folder / ".lock").exists() and store.read(folder)[0].height == 8 * done  # readable as it is
    compute_here(folder, resume=True, engine=Engine(partial(engine, begun=begun)))
    assert_same_study(folder, whole)
    assert len(begun.read_text().split()) <= 10 + 1


def test_killed_while_writing(stopped, whole):
    """What was being written when the power went is swept up."""
    for place in ("rows/.part-00004.parquet.77.part", ".manifest.json.77.part"):
        (stopped / place).write_bytes(b"half")
    compute_here(stopped, resume=True)
    assert_same_study(stopped, whole)


@pytest.mark.parametrize("left", [[], [".lock"], [".lock", "rows"], [".lock", "rows", "points.parquet"]])
def test_killed_before_its_manifest(tmp_path, whole, left):
    folder = tmp_path / "r"
    folder.mkdir()
    for name in left:
        (folder / name).mkdir() if name == "rows" else (folder / name).touch()
    compute_here(folder, resume=True)
    assert_same_study(folder, whole)


def test_resuming_nothing_begins_it(tmp_path, whole):
    assert compute_here(tmp_path / "new" / "r", resume=True).resumed == 0
    assert_same_study(tmp_path / "new" / "r", whole)


def refused(folder, match, config=CONFIG):
    """The study is refused, and nothing in its folder changes."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with pytest.raises(InputError, match=match):
        compute_here(folder, config=config, resume=True)
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_another_folder_is_not_taken_up(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    refused(tmp_path, "is not a results folder")


def test_without_resume_a_stopped_study_is_refused(stopped):
    with pytest.raises(InputError, match="must be new or empty"):
        compute_here(stopped)


def test_a_new_study_where_one_was_stopped_is_told_to_resume(stopped, whole, tmp_path):
    with pytest.raises(InputError, match=r"out: holds an unfinished study: --resume continues it"):
        refuse_taken(stopped)
    with pytest.raises(InputError, match="must be a folder that does not exist yet"):
        refuse_taken(whole)
    refuse_taken(tmp_path / "new")


def test_finished_study_is_refused(whole):
    refused(whole, rf"is finished.* `jaxbiped report {whole}`")


def test_other_config_is_refused_with_the_difference(stopped):
    mission = MissionConfig(costs={"c3": 20.0})
    changed = CONFIG.model_copy(update={"seed": 4, "mission": mission})
    refused(stopped, r"another config.*: seed 0 -> 4, mission.costs.c3 10.0 -> 20.0$", changed)
    many = CONFIG.model_copy(update={"mission": MissionConfig(preset="ideal")})
    refused(stopped, r"mission.preset rendered -> ideal, .* and \d+ more$", many)
    fixed = CONFIG.model_copy(update={"population": PopulationConfig(bump_width=0.2)})
    refused(stopped, r"population.bump_width None -> 0.2$", fixed)


def edit(folder, **changes):
    """Change the stored manifest."""
    path = folder / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def test_other_versions_are_refused(stopped):
    versions = store.read_manifest(stopped).versions
    edit(stopped, versions=versions | {"jax": "0.1.0"})
    refused(stopped, r"manifest.json: was started with jax 0.1.0 \(here .*\), and can only be resumed with the same")
    edit(stopped, versions=versions, device="8 x TPU v4")
    refused(stopped, r"was started with device TPU v4 \(here cpu\)")
    edit(stopped, format=2)
    refused(stopped, r"reads manifests of format 1 \(got 2\)")


def test_more_devices_of_a_kind_are_taken(stopped, whole):
    edit(stopped, device="2 x cpu")
    compute_here(stopped, resume=True)
    assert_same_study(stopped, whole)


@pytest.mark.parametrize("damage", ["cut", "garbage", "empty", "fewer", "columns"])
def test_damaged_shard_is_named_and_can_be_removed(stopped, whole, damage):
    path = stopped / "rows" / "part-00002.parquet"
    data = path.read_bytes()
    if damage == "fewer":
        pl.read_parquet(path).head(3).write_parquet(path)
    elif damage == "columns":
        pl.read_parquet(path).drop("code").write_parquet(path)
    else:
        path.write_bytes({"cut": data[: len(data) // 2], "garbage": b"not parquet" * 9, "empty": b""}[damage])
    refused(stopped, r"part-00002.parquet: .*remove .* to have it computed again")
    path.unlink()
    compute_here(stopped, resume=True)
    assert_same_study(stopped, whole)


def test_shard_of_another_study_is_named(stopped):
    path = stopped / "rows" / "part-00000.parquet"
    path.rename(path.with_name("part-00010.parquet"))
    refused(stopped, r"part-00010.parquet: is not a shard of this study, which has 10")


def test_two_runs_into_one_folder_are_refused(stopped):
    lock = FolderLock(stopped)
    try:
        with pytest.raises(InputError, match=f"is being written by process {os.getpid()}"):
            compute_here(stopped, resume=True)
    finally:
        lock.release()


def test_disk_that_fills_up_leaves_what_was_stored(stopped, whole, monkeypatch):
    count = len(shard_files.shard_paths(stopped))

    def fills_up(_):
        if len(shard_files.shard_paths(stopped)) == count + 2:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", fills_up)
    with pytest.raises(InputError, match="no space left"):
        compute_here(stopped, resume=True)
    frame, manifest = store.read(stopped)
    assert frame.height == 8 * (count + 2) and manifest.state in ("running", "stopped")
    monkeypatch.undo()
    assert compute_here(stopped, resume=True).resumed == 2
    assert_same_study(stopped, whole)
