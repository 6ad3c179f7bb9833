"""Which gateway sends an operator's command to a robot, and when (fleet document, section 5)."""

from collections import OrderedDict
from dataclasses import dataclass
from enum import Enum

from sdrlinkd.fleet.formats import Command, Fate

HOLD_S = 0.05
"""Time in s for which the others wait whether the leader takes a command."""
KEPT_S = 5.0
"""Time in s for which a command is known, which is longer than any receipt takes."""
MOST_KNOWN = 4096
MOST_OPERATORS = 256
TAKEN = "taken"
_FAILED = ("unknown", "dropped")
DEFAULT_LIFESPAN_S = 1.0

Id = tuple[int, str, str, int | None]
"""(robot, topic, operator, number or None) of a command."""


class Refusal(Enum):
    """Why a command is not sent; the value is the counter's name."""

    OUTDATED = "down_outdated"
    AGAIN = "down_again"


@dataclass(slots=True)
class Order:
    """A command, and what this gateway knows of it; times in s."""

    id: Id
    command: Command
    cdr: bytes
    came_at: float
    due_at: float = 0.0
    """When this gateway sends it unless another says that it has, where it is held."""
    patience_s: float = 0.0
    """Further time to wait for other gateways, which may hear the robot better."""

    @property
    def until(self) -> float:
        """When its lifespan ends."""
        ls = self.command.ls
        return self.came_at + (DEFAULT_LIFESPAN_S if ls is None else ls / 1e3)


class Commands:
    """The commands of operators at one gateway."""

    def __init__(self, own_id: int) -> None:
        self._own_id = own_id
        self._known: OrderedDict[Id, Order] = OrderedDict()
        self._held: dict[Id, Order] = {}
        """Those that this gateway sends when their time comes."""
        self._early: OrderedDict[Id, Fate] = OrderedDict()
        """What was said of commands that have not come here yet."""
        self._newest: OrderedDict[tuple[int, str, str], int] = OrderedDict()

    def take(
        self, robot: int, topic: str, command: Command, cdr: bytes, now: float, patience_s: float,
        *, leads: bool,
    ) -> Order | Refusal | None:  # fmt: skip
        """Take a command: the order to send now, why it is refused, or None if it is not sent now.

        `patience_s` is added to the time for which this gateway waits for others.
        """
        operator, number = (robot, topic, command.op), command.n
        self._forget(now)
        if number is None:
            return Order((*operator, None), command, cdr, now) if leads else None
        if (*operator, number) in self._known:
            return Refusal.AGAIN
        newest = self._newest.get(operator, -1)
        if number <= newest:
            # It came before, even if that is no longer known.
            return Refusal.AGAIN if number == newest else Refusal.OUTDATED
        self._newest[operator] = number
        self._newest.move_to_end(operator)
        if len(self._newest) > MOST_OPERATORS:
            self._newest.popitem(last=False)
        order = Order((*operator, number), command, cdr, now, patience_s=patience_s)
        self._known[order.id] = order
        if len(self._known) > MOST_KNOWN:
            self._drop(next(iter(self._known)))
        early = self._early.pop(order.id, None)
        if leads and early is None:
            return order
        self._hold(order, now + HOLD_S + patience_s)
        if early is not None:
            self._note(order, early, now)
        return None

    def told(self, robot: int, fate: Fate, now: float) -> None:
        """Take what another gateway says of a command."""
        if fate.gw == self._own_id or fate.n is None:
            return
        id_ = (robot, fate.topic, fate.op, fate.n)
        order = self._known.get(id_)
        if order is not None:
            self._note(order, fate, now)
            return
        self._early[id_] = fate
        if len(self._early) > MOST_KNOWN:
            self._early.popitem(last=False)

    def due(self, now: float) -> list[Order]:
        """The commands that no other gateway has taken in time."""
        due = [each for each in self._held.values() if each.due_at <= now]
        for order in due:
            del self._held[order.id]
        return [each for each in due if now < each.until]

    @property
    def due_at(self) -> float:
        """When `due` has something next, in s."""
        return min((each.due_at for each in self._held.values()), default=float("inf"))

    def _note(self, order: Order, fate: Fate, now: float) -> None:
        if fate.fate in _FAILED:
            self._hold(order, now + order.patience_s)
        else:
            self._held.pop(order.id, None)

    def _hold(self, order: Order, until: float) -> None:
        order.due_at = until
        self._held[order.id] = order

    def _drop(self, id_: Id) -> None:
        del self._known[id_]
        self._held.pop(id_, None)

    def _forget(self, now: float) -> None:
        while self._known:
            first = next(iter(self._known.values()))
            if now < first.came_at + KEPT_S:
                break
            self._drop(first.id)
