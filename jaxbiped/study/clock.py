"""Seconds spent compiling."""

from __future__ import annotations

import threading
import time

import jax


class CompileClock:
    """Seconds during which this process was tracing, lowering or compiling, by JAX's own account.

    JAX reports a stretch of time as it ends, and those within it before: what lies within another counts once.
    """

    EVENTS = (
        "/jax/core/compile/jaxpr_trace_duration",
        "/jax/core/compile/jaxpr_to_mlir_module_duration",
        "/jax/core/compile/backend_compile_duration",
    )

    def __init__(self):
        self.stretches: list[tuple[float, float]] = []  # that do not overlap: begin, end
        self.lock = threading.Lock()
        jax.monitoring.register_event_duration_secs_listener(self.listen)

    def listen(self, event: str, duration: float, **_: object) -> None:
        if event in self.EVENTS:
            end = time.perf_counter()
            self.add(end - duration, end)

    def add(self, begin: float, end: float) -> None:
        """Count a stretch that ends after all that were counted before."""
        with self.lock:
            while self.stretches and self.stretches[-1][1] > begin:
                begin = min(begin, self.stretches.pop()[0])
            self.stretches.append((begin, end))

    @property
    def seconds(self) -> float:
        """All of them."""
        with self.lock:
            return sum((end - begin for begin, end in self.stretches), 0.0)
