"""Statistics of the latest figures, as `ros2 topic` reports them."""

import math
from collections import deque


class Spread:
    """Mean, minimum, maximum and standard deviation of the last `window` values."""

    def __init__(self, window: int) -> None:
        self._values: deque[float] = deque(maxlen=window)

    def add(self, value: float) -> None:
        """Add a value; beyond `window` values, the oldest is dropped."""
        self._values.append(value)

    def __len__(self) -> int:
        return len(self._values)

    @property
    def total(self) -> float:
        """The sum of all values in the window."""
        return math.fsum(self._values)

    @property
    def first(self) -> float:
        """The oldest value in the window."""
        return self._values[0]

    @property
    def mean(self) -> float:
        """The mean of the values; 0 if there are none."""
        return self.total / len(self._values) if self._values else 0.0

    @property
    def least(self) -> float:
        """The smallest value; 0 if there is none."""
        return min(self._values, default=0.0)

    @property
    def most(self) -> float:
        """The largest value; 0 if there is none."""
        return max(self._values, default=0.0)

    @property
    def std_dev(self) -> float:
        """The standard deviation of the population, as ROS computes it."""
        mean = self.mean
        return math.sqrt(math.fsum((each - mean) ** 2 for each in self._values) / max(1, len(self)))


class Rate:
    """Like `ros2 topic hz`: measures the times between messages, in s."""

    def __init__(self, window: int) -> None:
        self._between = Spread(window)
        self._last_s: float | None = None

    def add(self, at_s: float, size: int, age_s: float | None) -> None:  # noqa: ARG002
        """Add a message that came at `at_s`."""
        if self._last_s is not None:
            self._between.add(at_s - self._last_s)
        self._last_s = at_s

    def lines(self) -> list[str]:
        """The lines to print; none before the second message."""
        spread = self._between
        if not len(spread) or not spread.total:
            return []
        return [f"average rate: {1 / spread.mean:.3f}", _spread(spread)]


class Bandwidth:
    """Like `ros2 topic bw`: measures payload bytes per second."""

    def __init__(self, window: int) -> None:
        self._sizes = Spread(window)
        self._times: deque[float] = deque(maxlen=window)

    def add(self, at_s: float, size: int, age_s: float | None) -> None:  # noqa: ARG002
        """Add a message of `size` bytes that came at `at_s`."""
        self._sizes.add(size)
        self._times.append(at_s)

    def lines(self) -> list[str]:
        """The lines to print; none before the second message."""
        sizes = self._sizes
        if len(sizes) < 2 or self._times[-1] <= self._times[0]:
            return []
        # The measured time starts with the first message, which therefore does not count.
        per_s = (sizes.total - sizes.first) / (self._times[-1] - self._times[0])
        of_sizes = (
            f"mean: {_bytes(sizes.mean)} min: {_bytes(sizes.least)} max: {_bytes(sizes.most)}"
        )
        return [f"{_bytes(per_s)}/s from {len(sizes)} messages", f"\tMessage size {of_sizes}"]


class Delay:
    """Like `ros2 topic delay`: measures the ages of messages at their handover, in s."""

    def __init__(self, window: int) -> None:
        self._ages = Spread(window)
        self._unknown = 0

    def add(self, at_s: float, size: int, age_s: float | None) -> None:  # noqa: ARG002
        """Add a message's age in s; None if unknown."""
        if age_s is None:
            self._unknown += 1
        else:
            self._ages.add(age_s)

    def lines(self) -> list[str]:
        """The lines to print; messages of unknown age are counted but in no statistics."""
        told = [f"{self._unknown} messages of unknown age"] if self._unknown else []
        if not len(self._ages):
            return told
        return [f"average delay: {self._ages.mean:.3f}", _spread(self._ages), *told]


Measure = Rate | Bandwidth | Delay


def _spread(spread: Spread) -> str:
    return (
        f"\tmin: {spread.least:.3f}s max: {spread.most:.3f}s std dev: {spread.std_dev:.5f}s "
        f"window: {len(spread)}"
    )


def _bytes(count: float) -> str:
    """A number of bytes as ROS writes it."""
    for unit, scale in (("MB", 1e6), ("KB", 1e3)):
        if count >= scale:
            return f"{count / scale:.2f} {unit}"
    return f"{count:.0f} B"
