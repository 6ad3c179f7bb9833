"""State machines as tables: (state, event) → next state."""

from collections.abc import Mapping
from enum import Enum
from typing import TypeVar

from sdrlinkd.errors import IllegalStepError

S = TypeVar("S", bound=Enum)
H = TypeVar("H", bound=Enum)


def after(table: Mapping[tuple[S, H], S], state: S, happens: H) -> S:
    """The state that follows `state` when `happens` occurs. Raises IllegalStepError."""
    following = table.get((state, happens))
    if following is None:
        raise IllegalStepError(f"{happens.name} in {state.name}")
    return following
