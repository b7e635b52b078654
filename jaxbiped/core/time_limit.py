"""A time limit for Python code in any thread."""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any

SetAsyncExc = ctypes.pythonapi.PyThreadState_SetAsyncExc
SetAsyncExc.argtypes, SetAsyncExc.restype = (ctypes.c_ulong, ctypes.py_object), ctypes.c_int
LOOK = 0.01  # [s] between two checks for late calls
REST = 1.0  # [s] without a call, after which the watcher stops


class TimeLimit(BaseException):
    """Code exceeded its time limit. Not an `Exception`, so that code which catches all of these does not catch it."""


@dataclass
class Call:
    """One call under a limit. Whoever takes the token, the watcher or the completed call, decides how it ends.

    No lock is shared with the watcher: an interrupt might come while it is held, and then it would never be released.
    """

    end: float  # deadline, on `time.monotonic`
    token: list = field(default_factory=lambda: [None])
    sent: bool = False  # whether it was interrupted


CALLS: dict[int, Call] = {}  # by thread
WAKE: SimpleQueue = SimpleQueue()
WATCHER: list[threading.Thread] = []
RESTING = [False]


def within(seconds: float | int, function: Callable, *arguments: Any) -> Any:
    """`function(*arguments)`; limits do not nest.

    Python code is interrupted between two of its instructions, so a library's compiled code returns first.

    Raises:
      TimeLimit: it took longer.
    """
    me, call = threading.get_ident(), Call(time.monotonic() + seconds)
    result, error = None, None
    try:
        CALLS[me] = call
        begin_to_watch()
        try:
            result = function(*arguments)
        except TimeLimit:
            raise
        except BaseException as raised:
            error = raised
        try:
            call.token.pop()
        except IndexError:  # it is late, and the interrupt is pending, or was swallowed by the called code
            while not call.sent:
                time.sleep(0.0001)
            for _ in range(3):
                time.sleep(0)
            raise TimeLimit from None
    finally:
        CALLS.pop(me, None)
    if error is not None:
        raise error
    if time.monotonic() > call.end:
        raise TimeLimit
    return result


def begin_to_watch() -> None:
    """Make sure that a watcher is running."""
    if not (WATCHER and WATCHER[0].is_alive()):
        thread = threading.Thread(target=watch, daemon=True, name="jaxbiped time limits")
        WATCHER[:] = [thread]  # two of them, started at once, do no harm
        thread.start()
    if RESTING[0]:
        WAKE.put(None)


def watch() -> None:
    """Interrupt calls that exceed their limits."""
    RESTING[0], seen = False, time.monotonic()
    while True:
        now = time.monotonic()
        for thread, call in list(CALLS.items()):
            seen = now
            if now > call.end and not call.sent:
                try:
                    call.token.pop()
                except IndexError:  # it has just ended
                    continue
                SetAsyncExc(thread, TimeLimit)
                call.sent = True
        if now - seen < REST:
            time.sleep(LOOK)
            continue
        RESTING[0] = True
        if not CALLS:
            WAKE.get()
        RESTING[0], seen = False, time.monotonic()
