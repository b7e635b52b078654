"""A time limit for Python code in any thread."""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

SetAsyncExc = ctypes.pythonapi.PyThreadState_SetAsyncExc
SetAsyncExc.argtypes, SetAsyncExc.restype = (ctypes.c_ulong, ctypes.py_object), ctypes.c_int


class TimeLimit(BaseException):
    """Code took longer than it may. No `Exception`, so that code which catches all of these does not catch it."""


LOCK = threading.Condition()
RUNNING: dict[int, list] = {}  # thread: when it must have ended, and whether it was interrupted
WATCHERS: list[threading.Thread] = []


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise `TimeLimit` in this thread when what is inside takes longer; limits do not nest.

    Python code is interrupted between two of its instructions, so that a library's compiled code returns first.
    """
    me, entry = threading.get_ident(), [time.monotonic() + seconds, False]
    with LOCK:
        RUNNING[me] = entry
        if not (WATCHERS and WATCHERS[0].is_alive()):
            WATCHERS[:] = [threading.Thread(target=watch, daemon=True, name="jaxbiped time limits")]
            WATCHERS[0].start()
        elif len(RUNNING) == 1:
            LOCK.notify()
    try:
        yield
        late = time.monotonic() > entry[0]
    finally:
        with LOCK:
            RUNNING.pop(me, None)
            if entry[1]:  # interrupted, perhaps only on its way: nothing may be raised after this
                SetAsyncExc(me, ctypes.py_object())
    if late:
        raise TimeLimit


def watch() -> None:
    """Interrupt what takes too long."""
    with LOCK:
        while True:
            now = time.monotonic()
            for thread, entry in RUNNING.items():
                if now > entry[0] and not entry[1]:
                    entry[1] = True
                    SetAsyncExc(thread, TimeLimit)
            waiting = [entry[0] - now for entry in RUNNING.values() if not entry[1]]
            LOCK.wait(max(0.001, min(waiting)) if waiting else None)
