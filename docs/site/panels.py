"""Panels of Grafana dashboards in few words, with the builders of Grafana's own SDK."""

import json

from grafana_foundation_sdk.builders import dashboard, prometheus, stat, statetimeline, table
from grafana_foundation_sdk.builders import timeseries as graphs
from grafana_foundation_sdk.builders.common import (
    ReduceDataOptions,
    StackingConfig,
    VizLegendOptions,
    VizTooltipOptions,
)
from grafana_foundation_sdk.cog.encoder import JSONEncoder
from grafana_foundation_sdk.models.common import (
    BigValueColorMode,
    BigValueGraphMode,
    LegendDisplayMode,
    LegendPlacement,
    SortOrder,
    StackingMode,
    TooltipDisplayMode,
    VisibilityMode,
)
from grafana_foundation_sdk.models.dashboard import (
    DashboardCursorSync,
    DashboardLinkType,
    DataSourceRef,
    DataTransformerConfig,
    DynamicConfigValue,
    Threshold,
    ThresholdsMode,
    ValueMap,
    ValueMappingResult,
    VariableRefresh,
    VariableSort,
)
from grafana_foundation_sdk.models.prometheus import PromQueryFormat

SOURCE = DataSourceRef(type_val="prometheus", uid="${datasource}")
TAG = "sdrlink"
HALF, THIRD = 12, 8
RED, AMBER, GREEN, BLUE = "red", "orange", "green", "blue"
ALERTS = 'ALERTS{alertname=~"Sdrlink.*", alertstate="firing"}'

Steps = list[tuple[float | None, str]]
"""Colors from a value on; the first from None, which is from below all values."""
Words = dict[int, tuple[str, str]]
"""What values mean: a word and its color."""


def query(expr: str, legend: str = "", *, now: bool = False) -> prometheus.Dataquery:
    """A query; `now`: for a table, of the present values only."""
    made = prometheus.Dataquery().expr(expr).legend_format(legend or "__auto")
    if now:
        return made.instant().format(PromQueryFormat.TABLE)
    return made.range().format(PromQueryFormat.TIME_SERIES)


def graph(
    title: str, text: str, unit: str, *queries: prometheus.Dataquery, span: int = HALF,
    stacked: bool = False, least: float | None = 0.0,
) -> graphs.Panel:  # fmt: skip
    """Curves over time."""
    panel = graphs.Panel().title(title).description(text).datasource(SOURCE)
    panel.unit(unit).height(8).span(span).fill_opacity(30 if stacked else 5).span_nulls(False)
    panel.legend(
        VizLegendOptions()
        .display_mode(LegendDisplayMode.LIST)
        .placement(LegendPlacement.BOTTOM)
        .show_legend(True)
        .calcs([])
    )
    panel.tooltip(VizTooltipOptions().mode(TooltipDisplayMode.MULTI).sort(SortOrder.DESCENDING))
    if least is not None:
        panel.min(least)
    if stacked:
        panel.stacking(StackingConfig().mode(StackingMode.NORMAL).group("A"))
    for letter, each in zip("ABCDEFGH", queries, strict=False):
        panel.with_target(each.ref_id(letter))
    return panel


def figure(
    title: str, text: str, unit: str, query: prometheus.Dataquery, *, steps: Steps | None = None,
    words: Words | None = None, span: int = 4,
) -> stat.Panel:  # fmt: skip
    """One large value."""
    panel = stat.Panel().title(title).description(text).datasource(SOURCE).unit(unit)
    panel.height(4).span(span).graph_mode(BigValueGraphMode.NONE)
    panel.color_mode(BigValueColorMode.BACKGROUND)
    panel.reduce_options(ReduceDataOptions().calcs(["lastNotNull"]))
    panel.thresholds(_thresholds(steps or [(None, BLUE)])).with_target(query.ref_id("A"))
    if words:
        panel.mappings([_mapping(words)])
    return panel


def states(
    title: str, text: str, words: Words, query: prometheus.Dataquery, *, span: int = 24
) -> statetimeline.Panel:
    """A state over time, in words."""
    panel = statetimeline.Panel().title(title).description(text).datasource(SOURCE)
    panel.height(6).span(span).fill_opacity(80).mappings([_mapping(words)])
    # Without any option the builder writes null, which Grafana's types refuse.
    panel.show_value(VisibilityMode.AUTO).row_height(0.9).merge_values(True)
    return panel.thresholds(_thresholds([(None, GREEN)])).with_target(query.ref_id("A"))


class Column:
    """A column of a table with a row per robot: its name, its query, and how it is shown."""

    def __init__(
        self, name: str, expr: str, unit: str = "short", *, steps: Steps | None = None,
        words: Words | None = None,
    ) -> None:  # fmt: skip
        self.name = name
        self.expr = expr
        self._unit = unit
        self._steps = steps
        self._words = words

    def properties(self) -> list[DynamicConfigValue]:
        """How Grafana shows it."""
        made = [DynamicConfigValue(id_val="unit", value=self._unit)]
        if self._words:
            made.append(DynamicConfigValue(id_val="mappings", value=[_mapping(self._words)]))
        if self._steps:
            steps = _thresholds(self._steps).build()
            made.append(DynamicConfigValue(id_val="thresholds", value=steps))
        if self._steps or self._words:
            shown = {"type": "color-background", "mode": "basic"}
            made.append(DynamicConfigValue(id_val="custom.cellOptions", value=shown))
        return made


def by_robot(title: str, text: str, columns: list[Column], link: str) -> table.Panel:
    """A table with a row per robot, by the label `node`, which links to `link`."""
    panel = table.Panel().title(title).description(text).datasource(SOURCE).height(12).span(24)
    panel.show_header(True)
    names = {"node": "robot", "robot": "worst neighbor"}
    for letter, column in zip("ABCDEFGHIJ", columns, strict=False):
        panel.with_target(query(column.expr, now=True).ref_id(letter))
        panel.override_by_name(column.name, column.properties())
        names[f"Value #{letter}"] = column.name
    order = {name: at for at, name in enumerate(names)}
    hidden = {"Time": True, **{f"Time {at + 1}": True for at in range(len(columns))}}
    panel.with_transformation(
        DataTransformerConfig(id_val="joinByField", options={"byField": "node", "mode": "outer"})
    )
    panel.with_transformation(
        DataTransformerConfig(
            id_val="organize",
            options={"excludeByName": hidden, "indexByName": order, "renameByName": names},
        )
    )
    to_robot = [{"title": "its link", "url": f"{link}?var-node=${{__value.text}}"}]
    panel.override_by_name("robot", [DynamicConfigValue(id_val="links", value=to_robot)])
    return panel


def board(title: str, uid: str, text: str) -> dashboard.Dashboard:
    """An empty dashboard that asks for its data source, and links to the others."""
    made = dashboard.Dashboard(title).uid(uid).description(text).tags([TAG]).readonly()
    made.time("now-15m", "now").refresh("5s").tooltip(DashboardCursorSync.CROSSHAIR)
    others = dashboard.DashboardLink("sdrlink").type(DashboardLinkType.DASHBOARDS).tags([TAG])
    made.link(others.as_dropdown(False).keep_time(True))
    source = dashboard.DatasourceVariable("datasource").label("Prometheus").type("prometheus")
    made.with_variable(source)
    return made.annotation(
        dashboard.AnnotationQuery()
        .name("Alerts")
        .datasource(SOURCE)
        .enable(True)
        .icon_color(RED)
        .expr(ALERTS)
    )


def choice(name: str, label: str, asked: str) -> dashboard.QueryVariable:
    """A variable whose values Prometheus knows, by a query such as label_values(metric, label)."""
    made = dashboard.QueryVariable(name).label(label).query(asked).datasource(SOURCE)
    return made.refresh(VariableRefresh.ON_TIME_RANGE_CHANGED).sort(VariableSort.NUMERICAL_ASC)


def text_of(made: dashboard.Dashboard) -> str:
    """A dashboard as the text of its file."""
    return json.dumps(made.build(), cls=JSONEncoder, indent=1, sort_keys=True) + "\n"


def _thresholds(steps: Steps) -> dashboard.ThresholdsConfig:
    return (
        dashboard.ThresholdsConfig()
        .mode(ThresholdsMode.ABSOLUTE)
        .steps([Threshold(value=value, color=color) for value, color in steps])
    )


def _mapping(words: Words) -> ValueMap:
    return ValueMap(
        {
            str(value): ValueMappingResult(text=text, color=color, index=at)
            for at, (value, (text, color)) in enumerate(words.items())
        }
    )
