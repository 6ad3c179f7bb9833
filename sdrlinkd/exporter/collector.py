"""Collects the metrics of daemons when Prometheus asks."""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    InfoMetricFamily,
    Metric,
    StateSetMetricFamily,
)

from sdrlinkd.asking import snapshot_at
from sdrlinkd.exporter.families import (
    RUNTIME_DIR,
    Family,
    Labels,
    Sample,
    families,
    info,
    plain,
    samples,
)
from sdrlinkd.exporter.names import PREFIX
from sdrlinkd.reports import Snapshot

OF_DAEMON = ("node", "namespace")

Ask = Callable[[Path], Snapshot | None]


class Collector:
    """The metrics of all daemons in `directories()`, which are asked at each scrape."""

    def __init__(self, directories: Callable[[], Iterable[Path]], ask: Ask | None = None) -> None:
        self._directories = directories
        self._ask = ask or snapshot_at
        self._grown: dict[Path, _Grown] = {}

    def describe(self) -> list[Metric]:
        """Nothing: which metrics there are depends on the daemons."""
        return []

    def collect(self) -> Iterator[Metric]:
        """All metrics, family by family, each of all daemons."""
        found = {path: self._ask(path) for path in self._directories()}
        self._grown = {path: self._grown.get(path, _Grown()) for path in found}
        up = GaugeMetricFamily(f"{PREFIX}_up", "Whether the daemon answers.", labels=[RUNTIME_DIR])
        about = InfoMetricFamily(PREFIX, "Version and kind of the daemon.", labels=OF_DAEMON)
        made: dict[str, Metric] = {}
        for path, snapshot in found.items():
            up.add_metric([str(path)], float(snapshot is not None))
            if snapshot is None:
                continue
            daemon = (str(snapshot.node), snapshot.namespace)
            figures = plain(snapshot)
            about.add_metric(daemon, info(figures) | {RUNTIME_DIR: str(path)})
            grown = self._grown[path].since(snapshot.uptime_s)
            for family, values in samples(figures):
                if family.name not in made:
                    made[family.name] = _metric(family)
                for sample in values:
                    _add(made[family.name], family, daemon, sample, grown)
        yield up
        if made:
            yield about
        yield from (made[family.name] for family in families() if family.name in made)


class _Grown:
    """The counters of one daemon, which only grow until it starts anew.

    The ledger sometimes moves one message from one name to another, which Prometheus would take for
    a restart.
    """

    def __init__(self) -> None:
        self._uptime_s = 0.0
        self._values: dict[tuple[str, Labels], float] = {}

    def since(self, uptime_s: float) -> "_Grown":
        """Begin anew if the daemon did."""
        if uptime_s < self._uptime_s:
            self._values.clear()
        self._uptime_s = uptime_s
        return self

    def at_least(self, name: str, sample: Sample) -> float:
        """The value of a counter, which is never less than before."""
        key = name, sample.labels
        value = max(sample.value, self._values.get(key, 0.0))
        self._values[key] = value
        return value


def _metric(family: Family) -> Metric:
    name, labels = f"{PREFIX}_{family.name}", [*OF_DAEMON, *family.labels]
    if family.kind == "counter":
        return CounterMetricFamily(name, family.help, labels=labels)
    if family.kind == "state":
        return StateSetMetricFamily(name, family.help, labels=labels)
    return GaugeMetricFamily(name, family.help, labels=labels)


def _add(
    metric: Metric, family: Family, daemon: tuple[str, ...], sample: Sample, grown: _Grown
) -> None:
    labels = dict(zip(OF_DAEMON, daemon, strict=True)) | dict(sample.labels)
    if family.kind == "counter":
        metric.add_sample(f"{metric.name}_total", labels, grown.at_least(family.name, sample))
    elif family.kind == "state":
        labels[metric.name] = labels.pop(family.path[-1])
        metric.add_sample(metric.name, labels, sample.value)
    else:
        metric.add_sample(metric.name, labels, sample.value)
