// Appends what has come to the lines of charts: [[ms, {picture: {line: value}}], …].
window.sdrAppend = (charts, seconds, most) => {
  for (const [picture, id] of Object.entries(charts)) {
    const chart = getElement(id)?.chart;
    if (!chart) continue;
    const series = chart.getOption().series.map((line) => {
      const points = seconds.map(([ms, values]) => [ms, values[picture][line.name] ?? null]);
      return { id: line.id, data: [...line.data, ...points].slice(-most) };
    });
    chart.setOption({ series });
  }
};
