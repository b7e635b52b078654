"""The factory of backends."""

from __future__ import annotations

from typing import Any, TypeVar

import jax

from jaxbiped.config import parse
from jaxbiped.errors import InputError
from jaxbiped.physics.backend import Backend
from jaxbiped.physics.options import Common

OptionsT = TypeVar("OptionsT", bound=Common)
BACKENDS = ("native", "mjx", "auto")


def make(name: str, model: Any, batch_size: int, **options: Any) -> Backend:
    """A backend for one model and batch size.

    Args:
      name: `native` (MuJoCo's batch, on a CPU), `mjx` (JAX; a GPU, TPU or CPU), or `auto`: `native` if JAX sees
        only a CPU, or with device="cpu", and `mjx` otherwise.
      model: the path of an MJCF file, MJCF text, a `mujoco.MjSpec` or a `mujoco.MjModel`. It is not modified.
      batch_size: number of simulations, B.
      **options: `free_joint`, `watch` and `fields` of all backends (see `options.Common`); `device`: "cpu", "gpu" or
        "tpu"; `threads` of `native`; `impl` and others of `mjx` (see `mjx.Options`).

    Raises:
      InputError: an unknown name or option, a model that cannot be stepped (naming the element), or a requested device
        that does not exist.
    """
    if not isinstance(name, str) or name not in BACKENDS:
        raise InputError(f"must be one of {', '.join(BACKENDS)}", field="backend", value=name)
    if name == "auto":
        device = options.get("device")
        name = "native" if (device or jax.default_backend()) == "cpu" else "mjx"
    if name == "native":
        from jaxbiped.physics import native

        if options.get("device") not in (None, "cpu"):
            raise InputError(
                "native runs on a CPU only; use mjx for other devices", field="device", value=options["device"]
            )
        return native.Native(model, batch_size, settings(native.Options, options))
    from jaxbiped.physics import mjx

    return mjx.Mjx(model, batch_size, settings(mjx.Options, options))


def settings(kind: type[OptionsT], options: dict[str, Any]) -> OptionsT:
    """Options, checked."""
    unknown = sorted(options.keys() - kind.model_fields.keys())
    if unknown:
        raise InputError(f"unknown option; known ones are {', '.join(sorted(kind.model_fields))}", field=unknown[0])
    return parse(kind, options)
