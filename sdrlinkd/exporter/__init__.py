"""Prometheus metrics of daemons: a family for each figure of the snapshot, from its schema."""

from sdrlinkd.exporter.collector import Collector
from sdrlinkd.exporter.families import Family, families, plain, samples
from sdrlinkd.exporter.page import metrics_page

__all__ = ["Collector", "Family", "families", "metrics_page", "plain", "samples"]
