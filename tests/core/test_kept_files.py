"""Files of the cache are whole or not there, whoever else reads, writes and removes them."""

import os
from concurrent.futures import ThreadPoolExecutor

from jaxbiped.core import kept_files

KIND = b"a kind 1\n"


def test_what_is_written_is_read(tmp_path):
    path = tmp_path / "new" / "folder" / "file"
    assert kept_files.read(path, KIND) is None
    for data in (b"", b"\0\n" * 1000, KIND):
        assert kept_files.write(path, KIND, data) and kept_files.read(path, KIND) == data
    assert [file.name for file in path.parent.iterdir()] == ["file"]
    assert kept_files.read(path, b"a kind 2\n") is None and kept_files.read(path.parent, KIND) is None


def test_whatever_is_damaged_is_none(tmp_path):
    path = tmp_path / "file"
    kept_files.write(path, KIND, bytes(range(100)))
    whole = path.read_bytes()
    wrong = [whole[:n] for n in range(len(whole))] + [whole + b"x", b"x" + whole]
    wrong += [whole[:n] + bytes([whole[n] ^ 1]) + whole[n + 1 :] for n in range(len(whole))]
    for data in wrong:
        path.write_bytes(data)
        assert kept_files.read(path, KIND) is None
    assert kept_files.write(path, KIND, b"new") and kept_files.read(path, KIND) == b"new"


def test_where_nothing_can_be_written_nothing_is(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("mine")
    for path in (tmp_path / "file" / "below", "/proc/none/file", tmp_path / ("x" * 300)):
        assert not kept_files.write(tmp_path / path, KIND, b"data")
    (tmp_path / "folder").mkdir()
    assert not kept_files.write(tmp_path / "folder", KIND, b"data")  # there is a folder of this name

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    assert not kept_files.write(tmp_path / "new", KIND, b"data")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder"]


def test_the_files_that_were_not_used_for_longest_go(tmp_path):
    size = 10 + len(KIND) + kept_files.DIGEST
    for k in range(6):
        path = tmp_path / f"folder{k % 2}" / str(k)
        kept_files.write(path, KIND, bytes(10))
        os.utime(path, (1000 + k, 1000 + k))
    kept_files.read(tmp_path / "folder0" / "0", KIND)  # used just now
    assert [file.path.name for file in kept_files.files(tmp_path)] == ["0", "5", "4", "3", "2", "1"]
    kept_files.prune(tmp_path, 3 * size)
    assert [file.path.name for file in kept_files.files(tmp_path)] == ["0", "5", "4"]
    kept_files.prune(tmp_path, 2 * size - 1)
    assert [file.path.name for file in kept_files.files(tmp_path)] == ["0"]
    assert [path.name for path in tmp_path.iterdir()] == ["folder0"]  # the empty one has gone
    kept_files.prune(tmp_path, 0)
    kept_files.prune(tmp_path / "nowhere", 0)
    assert kept_files.files(tmp_path) == kept_files.files(tmp_path / "nowhere") == []


def test_many_at_once(tmp_path):
    """Each reads something whole, or nothing, while others write and remove the same files."""
    values = [bytes([k]) * 5000 for k in range(8)]

    def work(k):
        path = tmp_path / "p" / str(k % 3)
        kept_files.write(path, KIND, values[k % 8])
        if k % 5 == 0:
            kept_files.prune(tmp_path, 6000)
        found = kept_files.read(path, KIND)
        return found is None or found in values

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(work, range(400)))
    assert all(not file.path.name.startswith(".") for file in kept_files.files(tmp_path))
