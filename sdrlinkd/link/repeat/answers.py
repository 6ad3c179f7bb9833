"""The PDUs that others lack and that we can send again: which of them, and when."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from math import inf

from sdrlinkd.link.packing import TopicEntryIds
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import Outgoing
from sdrlinkd.link.repeat.group import RepeatGroup, Wanted
from sdrlinkd.link.repeat.kept import Kept, KeptPdus, is_lasting
from sdrlinkd.link.repeat.params import RepeatParams
from sdrlinkd.link.schedule import Budget
from sdrlinkd.reports import RepeatReport
from sdrlinkd.wire import BROADCAST, PDU_NUMBERS, Need, Repeat

UNION_S = 0.01
"""Time in s for which a PDU to everyone waits, so that one repetition serves all who ask."""
TWICE_AFTER_S = 0.005
"""Time in s after which a PDU is sent for the second time unasked."""
ANNOUNCED_S = 0.45
"""Time in s for which an announcement counts."""
SHORT_LIFE_S = 0.1
"""Lifespan in s below which nobody can ask in time."""
MOST_WAITING, MOST_OF_ONE = 1024, 128
"""Most PDUs that wait to be sent again, of all robots and of one."""
AGAIN_S = 0.8
"""Age in s up to which a PDU is sent again; receivers know it again for a second."""
MOST_ANNOUNCED = 2
"""How often a PDU is announced in a burst of its own."""
FORGETS = 0.99
"""Factor on what was repeated for each robot, each time that `expire` is called."""
FARTHEST_BEHIND, RELAYED_BEHIND = 128, 150
"""How far behind the next one of its source a PDU in the clear may be: farther behind, one whose
REPEAT is lost would look like a new one. A relay knows less of what the source has sent."""


class Answers:
    """Keeps what was sent, and chooses what is sent again.

    `slower[mcs]` is the MCS with the same code rate and the next lower modulation, or `mcs` itself.
    """

    def __init__(
        self, params: RepeatParams, own_id: int, entry_ids: TopicEntryIds, *,
        has_control: bool, has_numbers: bool, is_sealed: bool, twice: Iterable[Qos] = (),
    ) -> None:  # fmt: skip
        self.is_on = has_control and params.share > 0
        """Whether anything is repeated on request."""
        self._own_id = own_id
        self._is_sealed = is_sealed
        self._twice = frozenset(twice) if has_control else frozenset()
        self._kept = KeptPdus(entry_ids, has_numbers=has_numbers)
        self._budget = Budget(max(params.share, 1e-6))
        self.wanted: dict[tuple[int, int], Wanted] = {}
        """The PDUs that wait to be sent again, by source and number."""
        self._next_number = 0
        """The number of our next PDU, or of one before."""
        self._under_way: dict[tuple[int, int], Wanted] = {}
        """Those in bursts whose outcome the radio has not reported."""
        self._repeated_until: dict[tuple[int, int], float] = {}
        """Until when each PDU was on the air for the last time, as far as it was repeated."""
        self._newest: Counter[int] = Counter()
        """The highest number relayed, by source."""
        self._served_s: defaultdict[int, float] = defaultdict(float)
        """Airtime spent for each robot that asked, in s."""
        self._pdus = self._asked = self._unknown = self._expired = self._refused = 0
        self._airtime_s = 0.0
        self._slower: Sequence[int] = ()

    def set_slower(self, slower: Sequence[int]) -> None:
        """Set, by MCS, that with which its PDUs are repeated."""
        self._slower = slower

    def sent(
        self, numbers: Sequence[int], pdus: Sequence[bytes], plain: Sequence[bytes],
        carried: Sequence[Sequence[Outgoing]], classes: Sequence[Qos], mcs: int, start: float,
        *, is_postponed: bool = False,
    ) -> None:  # fmt: skip
        """Keep the PDUs with messages of a burst that was to leave at `start`.

        `numbers` are those of our own PDUs. `is_postponed`: it left later, with times that account
        for it.
        """
        if not (self.is_on or self._twice):
            return
        self._kept.forget(start)
        for number, octets, inner, messages, qos in zip(
            numbers, pdus, plain or pdus, carried, classes, strict=True
        ):
            if not messages or messages[0].is_bare:
                continue
            is_relayed = messages[0].is_whole
            told = messages[0].pdu_number if is_relayed else number % PDU_NUMBERS
            if told is None or (is_postponed and not is_lasting(octets)):
                continue
            kept = self._kept.keep(told, octets, inner or octets, mcs, qos, messages, start)
            if is_relayed:
                self._newest[kept.src] = max(self._newest[kept.src], told)
            else:
                self._next_number = told + 1
            if qos in self._twice and any(_is_short_lived(each) for each in messages):
                self.wanted[kept.src, told] = Wanted(kept, start + TWICE_AFTER_S)

    def needed(
        self, asker: int, need: Need, at: float, n_others: int, *, is_asked: bool = True
    ) -> None:
        """Take a question that came at `at`, from one of `n_others` robots that hear us, or, unless
        `is_asked`, the lack of an answer.
        """
        if not self.is_on:
            return
        n_of_asker = sum(asker in each.askers for each in self.wanted.values())
        for number in need.numbers():
            self._asked += is_asked
            kept = self._kept.find(need.node, number)
            if kept is None or not kept.is_for(asker) or self._is_stale(kept):
                self._unknown += is_asked
                continue
            if kept.worth_until() <= at:
                self._expired += 1
                continue
            key = kept.src, number
            if self._repeated_until.get(key, -inf) >= at:
                # It is on its way.
                continue
            known = self.wanted.get(key)
            if known is None:
                if len(self.wanted) >= MOST_WAITING or n_of_asker >= MOST_OF_ONE:
                    self._refused += 1
                    continue
                for_all = kept.dst == BROADCAST and n_others > 1
                known = self.wanted[key] = Wanted(kept, at + UNION_S * for_all)
            n_of_asker += asker not in known.askers
            known.askers.add(asker)

    def others_repeat(self, repeat: Repeat, pdu_s: float, at: float) -> None:
        """Take what another robot repeats, in PDUs of `pdu_s`: all robots share the airtime."""
        self._budget.spend((1 + repeat.n_pdus) * pdu_s, at, is_bounded=True)

    def restarted(self, src: int) -> None:
        """Forget the PDUs of a robot that has restarted, and counts anew."""
        self._newest.pop(src, None)
        self._kept.forget_source(src)
        self.wanted = {key: each for key, each in self.wanted.items() if key[0] != src}

    def heard(self, src: int, number: int) -> None:
        """Note that another robot has sent a PDU that we might repeat."""
        self.wanted.pop((src, number), None)

    def due_at(self, now: float) -> float:
        """When the next PDU may be repeated; infinity: none waits."""
        if not self.wanted:
            return inf
        twice_at = min((e.due_at for e in self.wanted.values() if not e.askers), default=inf)
        asked_at = min((e.due_at for e in self.wanted.values() if e.askers), default=inf)
        return min(twice_at, max(asked_at, self._budget.free_at(now)))

    def due(self, start: float, next_number: int) -> list[Wanted]:
        """The PDUs that may be repeated at `start`, as far as they are of their most urgent class.

        What has expired by then is dropped. Our next PDU has `next_number`.
        """
        self._next_number = next_number
        is_free = self._budget.free_at(start) <= start
        due = []
        for key, each in list(self.wanted.items()):
            kept = each.kept
            if kept.worth_until() <= start:
                self._expired += 1
                del self.wanted[key]
            elif kept.first_at < start - AGAIN_S or self._is_stale(kept):
                self._unknown += 1
                del self.wanted[key]
            elif each.due_at <= start and (is_free or not each.askers):
                due.append(each)
        if len(due) > 1:
            qos = min(each.kept.qos for each in due)
            due = [each for each in due if each.kept.qos is qos]
        return due

    def group(self, due: Iterable[Wanted], start: float, most: int) -> RepeatGroup | None:
        """Up to `most` of the PDUs that are `due`, to be repeated in a burst at `start`.

        The robot for which least was repeated comes first, also where fewer fit.
        """
        found = []
        for each in due:
            if self._kept.may_repeat(each.kept):
                found.append(each)
            else:
                # Another message uses one of its entry ids.
                del self.wanted[each.kept.src, each.kept.number]
                self._unknown += 1
        if not found:
            return None

        def rank(each: Wanted) -> tuple[float, int]:
            served_s = min((self._served_s[asker] for asker in each.askers), default=0.0)
            return served_s, each.kept.number

        found.sort(key=rank)
        known = [each for each in found if start - each.announced_at < ANNOUNCED_S]
        first = (known or found)[0].kept
        like = [
            each.kept
            for each in known or found
            if (each.kept.src, each.kept.qos, each.kept.mcs) == (first.src, first.qos, first.mcs)
        ]
        chosen = like[:most]
        mcs = self._slower[first.mcs] if first.mcs < len(self._slower) else first.mcs
        n_known = len(chosen) if known else 0
        return RepeatGroup(chosen, first.qos, mcs, first.src != self._own_id, n_known)

    def announced(self, group: RepeatGroup, start: float, airtime_s: float) -> None:
        """Note that a REPEAT in a burst at `start` announces PDUs of the next bursts."""
        self._budget.spend(airtime_s, start)
        for kept in group.kept:
            wanted = self.wanted[kept.src, kept.number]
            wanted.announced_at = start
            wanted.n_announced += 1
            if wanted.n_announced > MOST_ANNOUNCED:
                del self.wanted[kept.src, kept.number]

    def took(self, group: RepeatGroup, start: float, airtime_s: float) -> None:
        """Note that PDUs are in a burst of `airtime_s` at `start`."""
        each_s = airtime_s / len(group.kept)
        for kept in group.kept:
            key = kept.src, kept.number
            wanted = self._under_way[key] = self.wanted.pop(key)
            self._repeated_until[key] = start + airtime_s
            self._kept.renew_ids(kept, start)
            if wanted.askers:
                self._budget.spend(each_s, start)
                wanted.cost_s = each_s
            for asker in wanted.askers:
                self._served_s[asker] += each_s / len(wanted.askers)

    def left(self, group: RepeatGroup, airtime_s: float) -> None:
        """Note that a burst with repeated PDUs left."""
        self._pdus += len(group.kept)
        self._airtime_s += airtime_s
        for kept in group.kept:
            self._under_way.pop((kept.src, kept.number), None)
            for message in kept.carried:
                message.repeat()

    def not_left(self, group: RepeatGroup, now: float) -> None:
        """Note that a burst with repeated PDUs did not leave: they wait again."""
        for kept in group.kept:
            key = kept.src, kept.number
            self._repeated_until.pop(key, None)
            wanted = self._under_way.pop(key, None)
            if wanted is not None:
                self._budget.spend(-wanted.cost_s, now)
                self.wanted.setdefault(key, wanted)

    def expire(self, now: float) -> None:
        """Forget what is too old to be repeated."""
        self._kept.forget(now)
        for asker in self._served_s:
            self._served_s[asker] *= FORGETS
        if len(self._repeated_until) > MOST_WAITING:
            self._repeated_until = {
                key: until
                for key, until in self._repeated_until.items()
                if self._kept.find(*key) is not None
            }

    def restart(self) -> None:
        """Go on with another clock; what was sent before is forgotten."""
        self._kept.clear()
        self.wanted.clear()
        self._under_way.clear()
        self._repeated_until.clear()
        self._budget.restart()

    def report(self) -> RepeatReport:
        """What was repeated so far."""
        return RepeatReport(
            pdus=self._pdus,
            airtime_s=self._airtime_s,
            asked_of_us=self._asked,
            unknown=self._unknown,
            expired=self._expired,
            refused=self._refused,
        )

    def _is_stale(self, kept: Kept) -> bool:
        """Whether others could take a PDU for a new one."""
        if self._is_sealed:
            return False
        if kept.is_relayed:
            return self._newest[kept.src] - kept.number > RELAYED_BEHIND
        return (self._next_number - kept.number) % PDU_NUMBERS > FARTHEST_BEHIND


def _is_short_lived(message: Outgoing) -> bool:
    return message.expires_at - message.arrived_at < SHORT_LIFE_S
