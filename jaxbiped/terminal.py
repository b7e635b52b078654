"""Output streams of a command: they never stop it, whatever happens to the terminal.

A reader that goes away, a full disk, a closed descriptor or an encoding that lacks our symbols must not cost a result
that took hours. So standard output and standard error are replaced by streams that swallow what cannot be written, and
the command line reports at the end what was lost.
"""

from __future__ import annotations

import codecs
import contextlib
import os
import shlex
import shutil
import signal
import sys
import threading
import unicodedata
from collections.abc import Iterator
from typing import Any

from jaxbiped.errors import InputError
from jaxbiped.files import reason

# Symbols that we print, for encodings that lack them. Letters lose their accents; all others become question marks.
ASCII = str.maketrans(
    {
        "×": "x", "−": "-", "–": "-", "—": "-", "±": "+-", "°": " deg", "·": "*", "→": "->", "←": "<-",
        "≤": "<=", "≥": ">=",
        "“": '"', "”": '"', "‘": "'", "’": "'", "─": "-", "━": "=", "│": "|", "╭": "+", "╮": "+", "╰": "+", "╯": "+",
    }
)  # fmt: skip
NARROWEST = 40  # [columns] narrower text is not legible, and tyro never stops wrapping it
PLAIN = "jaxbiped.plain"  # name of the handler of encoding errors
ENDING = {signal.SIGTERM: "terminated", **({signal.SIGHUP: "terminal closed"} if hasattr(signal, "SIGHUP") else {})}


def plain(error: UnicodeError) -> tuple[str, int]:
    """The replacement for characters that an encoding lacks."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = unicodedata.normalize("NFKD", error.object[error.start : error.end].translate(ASCII))
    signs = (sign for sign in text if not unicodedata.combining(sign))
    return "".join(sign if sign.isascii() else "?" for sign in signs), error.end


codecs.register_error(PLAIN, plain)


class Sink:
    """A text stream whose `write` and `flush` never fail: after the first error it swallows everything."""

    def __init__(self, stream: Any):
        self.stream = stream
        self.error: OSError | ValueError | None = None  # the first one; a ValueError for a closed file

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)

    def write(self, text: str) -> int:
        self.attempt(self.stream.write, text)
        return len(text)

    def writelines(self, lines) -> None:
        self.write("".join(lines))

    def flush(self) -> None:
        self.attempt(self.stream.flush)

    def isatty(self) -> bool:
        with contextlib.suppress(ValueError):  # closed
            return self.error is None and self.stream.isatty()
        return False

    def attempt(self, action, *arguments) -> None:
        """Call `action` unless the stream has failed before."""
        if self.error is not None:
            return
        try:
            action(*arguments)
        except (OSError, ValueError) as error:
            self.error = error
            silence(self.stream)

    def problem(self) -> InputError | None:
        """The error about what could not be written; None if the reader merely stopped reading."""
        if isinstance(self.error, OSError) and not isinstance(self.error, BrokenPipeError):
            return InputError(f"cannot be written: {reason(self.error)}", field="standard output")
        return None


def silence(stream: Any) -> None:
    """Discard what a stream still holds and all that follows, so that Python can close it without an error."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
        stream.flush()


@contextlib.contextmanager
def lasting_streams() -> Iterator[Sink]:
    """Replace standard output and standard error by `Sink`s, in encodings that can print everything.

    Yields:
      That of standard output, flushed and with its errors recorded when the block ends.
    """
    keep_descriptors()
    before, sinks, errors = (sys.stdout, sys.stderr), [], []
    with contextlib.ExitStack() as stack:
        stack.enter_context(wide_enough())
        for stream in before:
            stream = stream or stack.enter_context(open(os.devnull, "w", encoding="utf-8"))
            errors.append(getattr(stream, "errors", None))
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors=PLAIN)
            with contextlib.suppress(OSError, ValueError, AttributeError):
                os.set_blocking(stream.fileno(), True)  # otherwise a slow reader causes an error
            sinks.append(Sink(stream))
        sys.stdout, sys.stderr = sinks
        try:
            yield sinks[0]
        finally:
            for sink in sinks:
                sink.flush()
            sys.stdout, sys.stderr = before
            for stream, handler in zip(before, errors, strict=True):
                if handler and hasattr(stream, "reconfigure"):
                    with contextlib.suppress(ValueError):
                        stream.reconfigure(errors=handler)


@contextlib.contextmanager
def wide_enough() -> Iterator[None]:
    """Treat a terminal as at least `NARROWEST` wide."""
    asked = os.environ.get("COLUMNS")
    if shutil.get_terminal_size().columns >= NARROWEST:
        yield
        return
    os.environ["COLUMNS"] = str(NARROWEST)
    try:
        yield
    finally:
        del os.environ["COLUMNS"]
        os.environ |= {} if asked is None else {"COLUMNS": asked}


def keep_descriptors() -> None:
    """Open those of descriptors 0 to 2 that are closed; otherwise the next file opened would receive printed output."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free descriptor


def command_line() -> str:
    """The command line of this process, for people to repeat."""
    return legible(shlex.join(["jaxbiped", *sys.argv[1:]]))


def legible(text: str) -> str:
    """The name of a file as text; bytes that are not valid text become question marks."""
    return text.encode("utf-8", "replace").decode()


class Terminated(KeyboardInterrupt):
    """SIGTERM or SIGHUP: ends a command as Ctrl-C does, so that nothing half-written is left behind."""

    def __init__(self, number: int):
        super().__init__(ENDING[signal.Signals(number)])
        self.status = 128 + number  # as for a process killed by the signal


@contextlib.contextmanager
def ended_by_signals() -> Iterator[None]:
    """Raise `Terminated` in the main thread when this process is asked to end; a second request ends it at once.

    A signal that is ignored (`nohup`) or already has a handler is left alone.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, _: object) -> None:
        signal.signal(number, signal.SIG_DFL)
        raise Terminated(number)

    ours = [number for number in ENDING if signal.getsignal(number) == signal.SIG_DFL]
    for number in ours:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)
