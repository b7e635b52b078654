"""Seconds spent compiling."""

from __future__ import annotations

import threading
import time

import jax


class CompileClock:
    """Seconds that this process spent tracing, lowering or compiling, as reported by JAX.

    JAX reports an interval when it ends, after those nested in it: nested intervals count only once.
    """

    EVENTS = (
        "/jax/core/compile/jaxpr_trace_duration",
        "/jax/core/compile/jaxpr_to_mlir_module_duration",
        "/jax/core/compile/backend_compile_duration",
    )

    def __init__(self):
        self.stretches: list[tuple[float, float]] = []  # disjoint: begin, end
        self.lock = threading.Lock()
        jax.monitoring.register_event_duration_secs_listener(self.listen)

    def listen(self, event: str, duration: float, **_: object) -> None:
        if event in self.EVENTS:
            end = time.perf_counter()
            self.add(end - duration, end)

    def add(self, begin: float, end: float) -> None:
        """Count an interval that ends after all that were counted before."""
        with self.lock:
            while self.stretches and self.stretches[-1][1] > begin:
                begin = min(begin, self.stretches.pop()[0])
            self.stretches.append((begin, end))

    @property
    def seconds(self) -> float:
        """The total."""
        with self.lock:
            return sum((end - begin for begin, end in self.stretches), 0.0)
