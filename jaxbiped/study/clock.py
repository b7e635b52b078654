"""Seconds spent compiling."""

from __future__ import annotations

import jax


class CompileClock:
    """Seconds that this process has spent compiling, by JAX's own count."""

    EVENTS = (
        "/jax/core/compile/jaxpr_trace_duration",
        "/jax/core/compile/jaxpr_to_mlir_module_duration",
        "/jax/core/compile/backend_compile_duration",
    )

    def __init__(self):
        self.seconds = 0.0
        jax.monitoring.register_event_duration_secs_listener(self.listen)

    def listen(self, event: str, duration: float, **_: object) -> None:
        if event in self.EVENTS:
            self.seconds += duration
