"""Notes when a message passes each stage of a daemon and its modem; nothing else of them changes.

Python imports this file by itself, in every process that has its folder in PYTHONPATH. It wraps the
functions at which a stage ends as their modules are imported. Each note is a line in a file beside
the daemon's sockets: the stage, and the monotonic time in ns.
"""

import os
import sys
import time
from collections.abc import Callable, Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any

FILE = os.open(os.environ["WATERFALL"], os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)


def note(stage: str, at_ns: int | None = None) -> None:
    """Note that a message passes `stage`."""
    os.write(FILE, f"{stage} {time.monotonic_ns() if at_ns is None else at_ns}\n".encode())


def _wrap(
    owner: Any, name: str, before: str = "", after: str = "", if_result: bool = False
) -> None:
    inner = getattr(owner, name)

    def wrapped(*args: Any, **kwargs: Any) -> Any:
        began_ns = time.monotonic_ns()
        if before and not if_result:
            note(before, began_ns)
        result = inner(*args, **kwargs)
        if if_result and result is None:
            return result
        if before and if_result:
            note(before, began_ns)
        if after:
            note(after)
        return result

    setattr(owner, name, wrapped)


def _link(module: ModuleType) -> None:
    _wrap(module.Link, "submit", "submit", "accepted")
    _wrap(module.Link, "next_burst", "compose", "composed", if_result=True)


def _bus(module: ModuleType) -> None:
    _wrap(module.Bus, "publish", "publish")


def _daemon_side(module: ModuleType) -> None:
    told = module.ModemProcess._told  # noqa: SLF001

    def wrapped(self: Any, message: Any) -> None:
        if getattr(message, "heard", None):
            note("told")
        told(self, message)

    module.ModemProcess._told = wrapped  # noqa: SLF001


def _transmission(module: ModuleType) -> None:
    _wrap(module.Transmission, "send", "ordered")
    hand_over = module.Transmission._hand_over  # noqa: SLF001

    def wrapped(self: Any, made: Any) -> Any:
        now_ns, rate = time.monotonic_ns(), self._rate_hz
        ahead = made.order.start - self._now()
        note("modulated", now_ns)
        note("begins", now_ns + round(1e9 * ahead / rate))
        note("ends", now_ns + round(1e9 * (ahead + len(made.samples)) / rate))
        return hand_over(self, made)

    module.Transmission._hand_over = wrapped  # noqa: SLF001


def _receiving(module: ModuleType) -> None:
    hear = module.ReceiverThread.hear
    pdus = module._pdus  # noqa: SLF001
    began_ns = [0]

    def noted(self: Any, block: Any) -> None:
        began_ns[0] = time.monotonic_ns()
        hear(self, block)

    def found(events: Sequence[Any]) -> Any:
        heard = pdus(events)
        if heard:
            note("block", began_ns[0])
            note("received")
        return heard

    module.ReceiverThread.hear = noted
    vars(module)["_pdus"] = found


HOOKS: dict[str, Callable[[ModuleType], None]] = {
    "sdrlinkd.link.link": _link,
    "sdrlinkd.bus.bus": _bus,
    "sdrlinkd.modem.process.modem_process": _daemon_side,
    "sdrlinkd.modem.process.transmission": _transmission,
    "sdrlinkd.modem.process.receiving": _receiving,
}


class _Hooking(MetaPathFinder):
    """Finds the modules of HOOKS as ever, and wraps their functions once they are loaded."""

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        """The module's spec, with a loader that calls its hook; None for every other module."""
        hook = HOOKS.get(fullname)
        spec = PathFinder.find_spec(fullname, path, target) if hook else None
        if spec is None or spec.loader is None or hook is None:
            return spec
        run: Any = spec.loader.exec_module

        def run_and_hook(module: ModuleType) -> None:
            run(module)
            hook(module)

        spec.loader.exec_module = run_and_hook  # type: ignore[method-assign]
        return spec


sys.meta_path.insert(0, _Hooking())
