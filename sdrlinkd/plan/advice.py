"""Advice on what to change if the channel cannot carry the traffic; all advice is verified."""

import math
from collections.abc import Callable, Sequence

from sdrlinkd.plan.traffic import Load

LEAST = 0.02
"""Smallest share of a topic's messages that the advice may leave."""
STEPS = 10

Carries = Callable[[Sequence[Load]], bool]
"""Returns whether the channel carries the given loads."""


def slower(loads: Sequence[Load], asked: Sequence[float], carries: Carries) -> str:
    """Advice on which topics to send less often.

    `asked` has the airtime of each topic, as a share of what the channel carries.
    """
    largest = max(range(len(loads)), key=asked.__getitem__)
    name, faster = loads[largest].name, "use a higher MCS or rate"
    told = f"{100 * sum(asked):.0f} % of the channel's capacity is requested. "
    who = f"{name} takes the most, {100 * asked[largest]:.0f} %: "
    alone = _most(loads, {largest}, carries)
    if alone is not None:
        at_hz, period = alone[largest].rate_hz, _periods(alone[largest : largest + 1])
        smaller = f"make it smaller (compress), or {faster}"
        return f"{told}{who}send it at {at_hz:.3g} Hz or less ({period}), {smaller}"
    every = _most(loads, set(range(len(loads))), carries)
    if every is None:
        never = "even a fiftieth of the rates does not fit"
        return f"{told}{who}{never}; {faster}, or fewer robots"
    smaller = f"make them smaller (compress), or {faster}"
    return f"{told}{who}slowing it alone is not enough. Slow all ({_periods(every)}), {smaller}"


def _periods(loads: Sequence[Load]) -> str:
    return ", ".join(f"topic.{load.name}.period_s = {1 / load.rate_hz:.3g}" for load in loads)


def _most(loads: Sequence[Load], which: set[int], carries: Carries) -> list[Load] | None:
    """`loads` with those in `which` as frequent as the channel carries; None if below LEAST."""
    found, low, high = None, LEAST, 1.0
    factor = low
    for _ in range(STEPS):
        tried = [
            load._replace(rate_hz=1 / _up(1 / (load.rate_hz * factor))) if i in which else load
            for i, load in enumerate(loads)
        ]
        if carries(tried):
            found, low = tried, factor
        elif found is None:
            return None
        else:
            high = factor
        factor = (low + high) / 2
    return found


def _up(value: float) -> float:
    """`value` rounded up to three digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / unit - 1e-9) * unit:.6g}")
