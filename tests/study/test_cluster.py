"""Studies on a real Dask scheduler with real worker processes: their tables are those of one machine."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path

import dask
import polars as pl
import psutil
import pytest

from jaxbiped import cli
from jaxbiped.arenas.source import find_family, name_of
from jaxbiped.devices import cores
from jaxbiped.errors import InputError
from jaxbiped.study import cluster, shard_files, store
from jaxbiped.study.cluster import Cluster, connect, local_cluster
from jaxbiped.study.run_study import Engine, compute_study
from tests.study import pretend
from tests.study.engine import CONFIG, TABLE, engine

ROOT = Path(__file__).parents[2]
PAUSE = 0.15  # [s] a made-up shard


def process(*argv, **environment):
    """A process of Dask's command line."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | environment
    return subprocess.Popen([sys.executable, "-m", *argv], env=environment, stderr=subprocess.DEVNULL)


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def start_scheduler():
    """A scheduler that listens: process and address."""
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    running = process("distributed.cli.dask_scheduler", "--host", address, "--no-dashboard")
    while True:
        assert running.poll() is None
        try:
            socket.create_connection(("127.0.0.1", port)).close()
            return running, address
        except OSError:
            time.sleep(0.05)


def start_worker(address, threads=1, **environment):
    """A worker that nobody restarts."""
    options = ("--no-nanny", "--no-dashboard", "--memory-limit", "0", "--nthreads", str(threads))
    return process("distributed.cli.dask_worker", address, *options, **environment)


def end(*processes):
    for running in processes:
        running.kill()
        running.wait()


@pytest.fixture(scope="module")
def scheduler():
    """Its address. Tests start workers there, and end them."""
    running, address = start_scheduler()
    yield address
    end(running)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The same study in this process."""
    folder = tmp_path_factory.mktemp("whole") / "r"
    compute_study(folder, CONFIG, engine=Engine(engine))
    return folder


@pytest.fixture
def begun(tmp_path):
    """Where made-up shards leave their marks."""
    return tmp_path / "begun"


def marks(begun):
    """(shard, process, threads) of each shard that was begun."""
    return [tuple(map(int, line.split())) for line in begun.read_text().splitlines()] if begun.exists() else []


def assert_same_study(folder, whole):
    ours, theirs = store.read(folder), store.read(whole)
    assert ours[0].equals(theirs[0]) and ours[1].state == "finished"
    for path in shard_files.shard_paths(whole):
        assert (folder / "rows" / path.name).read_bytes() == path.read_bytes()


def stopping(inner, count, error=KeyboardInterrupt):
    """An engine that is interrupted after some shards."""

    def breaking(*arguments, **how):
        for number, shard in enumerate(inner(*arguments, **how)):
            if number == count:
                raise error
            yield shard

    return breaking


def test_killed_worker(scheduler, whole, begun, tmp_path):
    """SIGKILL in the middle of a shard: another worker computes it, and nothing twice that had been handed out."""
    workers = {running.pid: running for running in (start_worker(scheduler, 1), start_worker(scheduler, 2))}
    try:
        with connect(scheduler) as client:
            client.wait_for_workers(2, timeout=60)
            on_cluster = Cluster(client, compute=partial(pretend.compute, begun=begun, pause=PAUSE))
            told, handed_out, lost = [], set(), []

            def killing(*arguments, **how):
                for number, (shard, rows) in enumerate(on_cluster(*arguments, **how)):
                    handed_out.add(shard.number)
                    yield shard, rows
                    if number == 2:
                        while len({pid for _, pid, _ in marks(begun)}) < 2:
                            time.sleep(0.01)
                        victim = marks(begun)[-1][1]
                        os.kill(victim, signal.SIGKILL)
                        lost.extend(n for n, pid, _ in marks(begun) if pid == victim and n not in handed_out)

            manifest = compute_study(
                tmp_path / "r", CONFIG, engine=Engine(killing, on_cluster.device, on_progress=told.append)
            )
            assert on_cluster.workers() == 1
    finally:
        end(*workers.values())
    assert_same_study(tmp_path / "r", whole)
    shards = [shard for shard, _, _ in marks(begun)]
    # What the worker held when it died is lost with it: the shard that it was at, and those not fetched yet.
    again = [shard for shard in set(shards) if shards.count(shard) > 1]
    assert set(shards) == set(range(10)) and len(shards) == 10 + len(again)
    assert lost[-1] in again and set(again) <= set(lost)
    assert {threads for _, _, threads in marks(begun)} == {1, 2}
    assert manifest.device == "2 x cpu"
    assert (told[-1].ended, told[-1].reached, told[-1].total) == (80, int(TABLE["success"].sum()), 80)


def test_local_workers_go_on_with_it_and_back(whole, begun, tmp_path):
    """Begun here, gone on with on a cluster of processes, ended here; by N workers that share the cores."""
    folder = tmp_path / "r"
    with pytest.raises(KeyboardInterrupt):
        compute_study(folder, CONFIG, engine=Engine(stopping(engine, 3)))
    with local_cluster(2) as client:
        on_cluster = Cluster(client, compute=partial(pretend.compute, begun=begun, slow=(3,)))
        with pytest.raises(KeyboardInterrupt):
            compute_study(folder, CONFIG, resume=True, engine=Engine(stopping(on_cluster, 4), on_cluster.device))
        told = []
        assert len(list(on_cluster(CONFIG, told.append, done=set(range(10)) - {3, 5}))) == 2
        assert [progress.ended for progress in told] == [8, 8 + 2, 8 + 8]  # shard 3 said that it had two missions done
        # Where the order counts it is kept, and the others do not run far ahead of a slow one.
        ordered = Cluster(client, ordered=True, compute=partial(pretend.compute, begun=begun, slow=(0, 4)))
        assert [shard.number for shard, _ in ordered(CONFIG, done={1})] == [0, *range(2, 10)]
    stored = store.read_manifest(folder)
    assert stored.state == "stopped" and 3 not in {
        shard_files.shard_number(path) for path in shard_files.shard_paths(folder)
    }
    compute_study(folder, CONFIG, resume=True, engine=Engine(engine))
    assert_same_study(folder, whole)
    assert {threads for _, _, threads in marks(begun)} == {max(1, cores() // 2)}


def test_shard_that_kills_its_workers(begun, tmp_path):
    deadly = partial(pretend.compute, begun=begun, deadly=(1,))
    died = pytest.raises(InputError, match=r"shard 1: its workers died.*a smaller --shard needs less")
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}), local_cluster(1) as client, died:
        compute_study(tmp_path / "r", CONFIG, engine=Engine(Cluster(client, compute=deadly)))
    assert store.read(tmp_path / "r")[1].state == "stopped" and len(shard_files.shard_paths(tmp_path / "r")) == 1


def test_scheduler_and_workers_that_vanish(monkeypatch, begun, tmp_path):
    """No worker for too long, then no scheduler: one line each, and what was stored stays."""
    monkeypatch.setattr(cluster, "WAITING", 2.0)
    running, address = start_scheduler()
    worker = start_worker(address)
    try:
        with connect(address) as client:
            client.wait_for_workers(1, timeout=60)
            on_cluster = Cluster(client, compute=partial(pretend.compute, begun=begun))

            def then(action):
                def engine(*arguments, **how):
                    for number, shard in enumerate(on_cluster(*arguments, **how)):
                        yield shard
                        if number == 1:
                            action()

                return engine

            with pytest.raises(InputError, match=rf"scheduler: has had no worker for 2 s.*dask worker {address}"):
                compute_study(tmp_path / "r", CONFIG, engine=Engine(then(lambda: end(worker))))
            with pytest.raises(InputError, match="has had no worker"):
                Cluster(client)
            worker = start_worker(address)
            client.wait_for_workers(1, timeout=60)
            with pytest.raises(InputError, match=r"scheduler: is gone; .* --resume continues the study"):
                compute_study(tmp_path / "r", CONFIG, resume=True, engine=Engine(then(lambda: end(running))))
    finally:
        end(worker, running)
    manifest = store.read_manifest(tmp_path / "r")
    assert manifest.state == "stopped" and len(shard_files.shard_paths(tmp_path / "r")) >= 4


def installed(folder, name, version):
    """A folder that, first on the path of a process, makes a package seem to be of another version."""
    place = folder / f"{name}-{version}.dist-info"
    place.mkdir(parents=True)
    (place / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    return {"PYTHONPATH": f"{folder}:{ROOT}", "PYTHONSAFEPATH": "1"}


def test_worker_of_another_version(scheduler, begun, tmp_path):
    """Refused before anything runs; one that joins later, with its first shard."""
    other = installed(tmp_path / "old", "jaxbiped", "0.0.9")
    refused = r"worker tcp://127.0.0.1:\d+: has jaxbiped 0.0.9 \(here .*\); all workers must have the client's versions"
    workers = [start_worker(scheduler)]
    try:
        with connect(scheduler) as client:
            client.wait_for_workers(1, timeout=60)
            on_cluster = Cluster(client, compute=partial(pretend.compute, begun=begun, pause=PAUSE))
            workers.append(start_worker(scheduler, **other))
            client.wait_for_workers(2, timeout=60)
            with pytest.raises(InputError, match=refused):
                compute_study(tmp_path / "r", CONFIG, engine=Engine(on_cluster))
            with pytest.raises(InputError, match=refused):
                Cluster(client)
            with pytest.raises(InputError, match=r"is the address of a Dask worker, not of its scheduler"):
                cluster.knock(next(iter(client.nthreads())))
    finally:
        end(*workers)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("somewhere", "must be the address of a Dask scheduler"),
        ("127.0.0.1:99999", "must be the address of a Dask scheduler"),
        ("http://127.0.0.1:80", "must be the address of a Dask scheduler"),
        ("tcp://127.0.0.1:{closed}", "no Dask scheduler answers there: connection refused"),
        ("tcp://127.0.0.1:{silent}", "no Dask scheduler answers there: the listening program is not one"),
        ("127.0.0.1:{rude}", "no Dask scheduler answers there: the listening program is not one"),
    ],
)
def test_scheduler_that_is_not_there(address, message, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cluster, "ANSWER", 1.0)
    with socket.socket() as silent, socket.socket() as rude:
        for listener in (silent, rude):
            listener.bind(("127.0.0.1", 0))
            listener.listen()

        def answer():
            with rude.accept()[0], rude.accept()[0] as second:  # the first only looks whether anything listens
                second.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")

        threading.Thread(target=answer, daemon=True).start()
        ports = {"closed": free_port(), "silent": silent.getsockname()[1], "rude": rude.getsockname()[1]}
        address = address.format(**ports)
        began = time.monotonic()
        assert cli.main(["compare", "--arenas", "4", "--scheduler", address]) == 2
        assert time.monotonic() - began < 10
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and f"scheduler: {message}" in said and address in said
    assert not any(tmp_path.iterdir())


def test_options_that_do_not_go_together(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["compare", "--workers", "2", "--scheduler", "tcp://127.0.0.1:1"]) == 2
    assert "workers: does not go with --scheduler" in capsys.readouterr().err
    assert cli.main(["compare", "--workers", "0"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, "jaxbiped.study.cluster")
    assert cli.main(["compare", "--workers", "2"]) == 2
    assert "workers: needs distributed: pip install 'jaxbiped[cluster]'" in capsys.readouterr().err


@pytest.mark.slow  # processes that compile the closed loop, the first of them for all
def test_commands_on_workers_give_the_local_table(monkeypatch, tmp_path):
    """The real loop, in a command of which a worker is killed midway; and a rule that takes shards in their order."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", str(tmp_path / "cache"))
    study = ["--arenas", "16", "--shard", "2", "--strategies", "full", "floor_only", "--sensor", "oracle"]

    def start(out, *more):
        return subprocess.Popen([sys.executable, "-m", "jaxbiped.cli", "compare", *study, "--out", out, *more])

    assert start("local", "--until-width", "1.2").wait() == 0
    assert start("ordered", "--until-width", "1.2", "--workers", "2").wait() == 0
    (local, _), (ordered, manifest) = (store.read(tmp_path / name) for name in ("local", "ordered"))
    assert local.equals(ordered) and manifest.device == "2 x cpu"
    assert (tmp_path / "local/stopping.toml").read_text() == (tmp_path / "ordered/stopping.toml").read_text()
    running = start("spread", "--workers", "2")
    while len(shard_files.shard_paths(tmp_path / "spread")) < 1:
        assert running.poll() is None
        time.sleep(0.01)
    workers = [child for child in psutil.Process(running.pid).children() if "spawn_main" in " ".join(child.cmdline())]
    assert len(workers) == 2
    workers[0].kill()
    assert running.wait() == 0
    spread = store.read(tmp_path / "spread")[0]
    assert spread.height == 32 and spread.filter(pl.col("arena").is_in(local["arena"].unique().to_list())).equals(local)


OWN_PLANNER = """
def right_then_down(classes, levels, start_ij, goal_ij, costs):
    if (classes == 4).sum() % 7 == 3:
        raise RuntimeError("refuses")  # on a worker, too, this ends one mission and not the study
    (i, j), (p, q) = start_ij, goal_ij
    across = [(i, k) for k in range(j, q, 1 if q > j else -1)]
    return [*across, *((k, q) for k in range(i, p, 1 if p > i else -1)), (p, q)]
"""


@pytest.mark.slow  # as above
def test_a_planner_on_the_host_gives_the_same_rows_on_workers(monkeypatch, tmp_path):
    """Its functions are numbered in each process by itself, so that a batch must name them in another way."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "planner_of_this_test.py").write_text(OWN_PLANNER)
    own = "planner_of_this_test:right_then_down"
    study = ["--arenas", "12", "--shard", "3", "--families", "bump", "gate", "--strategies", own, "full"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    for out, *more in (["local"], ["spread", "--workers", "2"]):
        command = [sys.executable, "-m", "jaxbiped.cli", "compare", *study, "--out", out, *more]
        subprocess.run(command, check=True, env=environment)
    local, spread = (store.read(tmp_path / name)[0].drop("planning_time") for name in ("local", "spread"))
    assert local.equals(spread) and local.height == 24
    mine = local.filter(pl.col("strategy") == "right_then_down")
    assert mine["planning_calls"].sum() > mine.height and mine["code"].n_unique() > 1


def test_workers_of_this_machine_find_modules_of_the_working_directory(tmp_path, monkeypatch):
    """A generator of a module there, as `--families lab:hills` names it, goes to a worker and is found by it."""
    (tmp_path / "hills_of_this_test.py").write_text("def hills(key):\n    return key\n")
    monkeypatch.chdir(tmp_path)
    family = find_family("hills_of_this_test:hills")
    with local_cluster(1) as client:
        assert client.submit(name_of, family).result(timeout=60) == "hills"
