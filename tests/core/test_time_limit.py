"""Limits end what takes too long, in any thread, and nothing else."""

import contextlib
import threading
import time

import pytest

from jaxbiped.core.time_limit import TimeLimit, within


def spin(seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        pass
    return "done"


def test_what_takes_too_long_is_interrupted():
    begun = time.monotonic()
    with pytest.raises(TimeLimit):
        within(0.05, spin, 30)
    assert time.monotonic() - begun < 5
    assert within(30, spin, 0.01) == "done"


def test_what_catches_all_exceptions_is_interrupted_too():
    def stubborn():
        while True:
            with contextlib.suppress(Exception):
                spin(30)

    with pytest.raises(TimeLimit):
        within(0.05, stubborn)


def test_what_swallows_the_interrupt_is_late_when_it_returns():
    def deaf():
        try:
            spin(30)
        except BaseException:
            return "not late at all"

    with pytest.raises(TimeLimit):
        within(0.05, deaf)


def test_compiled_code_returns_first_and_is_too_late():
    with pytest.raises(TimeLimit):
        within(0.02, time.sleep, 0.1)


def test_nothing_is_raised_after_it():
    """Calls that end about when they are late, many times: an interrupt that is on its way must not come later."""
    ends = {"done": 0, "late": 0}
    for k in range(300):
        limit = 0.001 * 1.03 ** (k % 150)
        try:
            ends[within(limit, spin, 0.009)] += 1
        except TimeLimit:
            ends["late"] += 1
        spin(0.0002)
    assert ends["late"] and ends["done"]


def test_each_thread_has_its_own():
    ended = {}

    def run(name, limit, seconds):
        try:
            ended[name] = within(limit, spin, seconds)
        except TimeLimit:
            ended[name] = "late"

    threads = [threading.Thread(target=run, args=(k, 0.05 if k % 2 else 60, 60 if k % 2 else 0.1)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert ended == {k: "late" if k % 2 else "done" for k in range(6)}


def test_errors_pass_through_and_the_watcher_wakes_again():
    def wrong():
        raise KeyError("what")

    with pytest.raises(KeyError, match="what"):
        within(5, wrong)
    time.sleep(1.3)  # the watcher rests by now
    with pytest.raises(TimeLimit):
        within(0.05, spin, 30)
