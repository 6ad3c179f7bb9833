"""Records of messages sent and received, and the paper's figures of merit."""

from collections import defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sdrlinkd.adapters import from_cdr

ODOMETRY = "nav_msgs/msg/Odometry"
GRID_POINTS = 1000

Path2D = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Sample:
    """A message at the producer or consumer: its payload, and its time on the monotonic clock in s.

    `age_s` is its age by the link, for runs in which it was handed over later than it was on the
    air.
    """

    at: float
    payload: bytes
    age_s: float | None = None
    hops_left: int = 0
    """Hops that it could still have taken, where it was received."""


# A message as sent and as received.
Pair = tuple[Sample, Sample]


@dataclass
class Trace:
    """Messages at the producer and at the consumer, by registry name."""

    types: dict[str, str]
    sent: dict[str, list[Sample]] = field(default_factory=lambda: defaultdict(list))
    received: dict[str, list[Sample]] = field(default_factory=lambda: defaultdict(list))

    @property
    def n_sent(self) -> int:
        """Messages sent, counted at the producer."""
        return sum(len(samples) for samples in self.sent.values())

    @property
    def last_sent_at(self) -> float:
        """Time at which the last message was sent, on the monotonic clock."""
        return max((samples[-1].at for samples in self.sent.values() if samples), default=0.0)

    @property
    def n_received(self) -> int:
        """Messages received by the consumer, whatever their content."""
        return sum(len(samples) for samples in self.received.values())

    def matches(self) -> tuple[dict[str, list[Pair]], int]:
        """((sent, received) pairs by topic, number of received messages that nobody sent).

        Of several with the same bytes, the first one sent was received first. Pairs are in the
        order of sending, as repeated PDUs may bring a message after newer ones.
        """
        pairs: dict[str, list[Pair]] = {}
        foreign = 0
        for name, received in self.received.items():
            waiting: defaultdict[bytes, deque[Sample]] = defaultdict(deque)
            for sample in self.sent.get(name, []):
                waiting[sample.payload].append(sample)
            found: list[Pair] = []
            for sample in received:
                same = waiting[sample.payload]
                if same and same[0].at <= sample.at:
                    sent = same.popleft()
                    found.append((sent, _as_on_air(sent, sample)))
                else:
                    foreign += 1
            pairs[name] = sorted(found, key=lambda pair: pair[0].at)
        return pairs, foreign

    def all_pairs(self) -> list[Pair]:
        """The (sent, received) pairs of all topics."""
        return [pair for found in self.matches()[0].values() for pair in found]

    def path(self, samples: list[Sample]) -> Path2D:
        """Positions `[n, 2]` of odometry messages, in m."""
        poses = (from_cdr(sample.payload, ODOMETRY).pose.pose.position for sample in samples)
        points = np.array([(p.x, p.y) for p in poses], dtype=np.float64).reshape(-1, 2)
        return points[np.isfinite(points).all(axis=1)]

    def odometry_topics(self) -> list[str]:
        """Registry names of odometry topics that were sent."""
        return [name for name in self.sent if self.types[name] == ODOMETRY]


def latencies_s(pairs: Sequence[Pair]) -> NDArray[np.float64]:
    """Times from publishing at the producer to reception at the consumer, ascending, in s."""
    return np.sort([got.at - was.at for was, got in pairs])


def goodput_bytes_per_s(pairs: Sequence[Pair]) -> float:
    """Payload bytes delivered per s, from the first publishing to the last reception."""
    if not pairs:
        return 0.0
    span_s = max(got.at for _, got in pairs) - min(was.at for was, _ in pairs)
    return sum(len(got.payload) for _, got in pairs) / span_s if span_s > 0 else 0.0


def path_error_m(sent: Path2D, received: Path2D) -> float | None:
    """Mean distance in m of two paths on a common grid of arc length (paper section 6).

    Both are interpolated over their own normalised length, so that harmless stretching in time does
    not count. None if either path has no two distinct points.
    """
    grids = [_along(path) for path in (sent, received)]
    if grids[0] is None or grids[1] is None:
        return None
    return float(np.linalg.norm(grids[0] - grids[1], axis=1).mean())


def _along(path: Path2D) -> Path2D | None:
    if len(path) < 2:
        return None
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    length = np.concatenate(([0.0], np.cumsum(steps)))
    if length[-1] == 0:
        return None
    grid = np.linspace(0, length[-1], GRID_POINTS)
    return np.stack([np.interp(grid, length, path[:, i]) for i in range(2)], axis=1)


def _as_on_air(sent: Sample, received: Sample) -> Sample:
    """The reception, with its time on the air if the samples were recorded and played later."""
    if received.age_s is None:
        return received
    return replace(received, at=sent.at + received.age_s, age_s=None)
