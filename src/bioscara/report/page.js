"use strict";
(() => {
  const run = JSON.parse(document.getElementById("data").textContent);
  const main = document.getElementById("charts");
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const sync = uPlot.sync("run");
  const charts = [];

  const shade = (u) => {
    const { left, top, width, height } = u.bbox;
    const at = (t) => Math.min(Math.max(u.valToPos(t, "x", true), left), left + width);
    u.ctx.fillStyle = style("--band");
    u.ctx.fillRect(at(0), top, at(run.end) - at(0), height);
  };

  const axis = (extra) => ({
    stroke: () => style("--quiet"),
    grid: { stroke: () => style("--line"), width: 1 },
    ticks: { stroke: () => style("--line"), width: 1 },
    font: "11px system-ui, sans-serif",
    ...extra,
  });

  const labelled = (u, ticks, index, space, step) => tickLabels(ticks, step);
  // Room for the longest label: 7 pixels for each character, and the tick.
  const room = (u, labels) => 20 + 7 * Math.max(4, ...(labels ?? []).map((label) => label.length));
  const number = (unit) => (u, value, index) => {
    const scale = u.scales[u.series[index].scale];
    return valueLabel(value, scale.min, scale.max, unit);
  };

  const chart = (caption, unit, time, series) => {
    const figure = document.createElement("figure");
    const title = document.createElement("figcaption");
    title.textContent = caption + " ";
    const small = document.createElement("small");
    small.textContent = unit;
    title.append(small);
    figure.append(title);
    main.append(figure);
    const plot = new uPlot({
      width: figure.clientWidth,
      height: 210,
      legend: { live: true },
      cursor: { sync: { key: sync.key }, points: { size: 5 } },
      scales: { x: { time: false } },
      axes: [
        axis({ size: 26, space: 70, values: (...all) => labelled(...all).map((label) => label && label + " s") }),
        axis({ size: room, values: labelled }),
      ],
      series: [
        { label: "time", value: number(" s") },
        ...series.map(({ label, color, dash }) => ({
          label, dash, width: 1.5, value: number(""), points: { show: false }, stroke: () => style(color),
        })),
      ],
      hooks: { drawClear: [shade] },
    }, [time, ...series.map(({ values }) => values)], figure);
    charts.push([plot, figure]);
  };

  const measured = (values) => ({ label: "measured", color: "--measured", values });
  const reference = (values) => ({ label: "reference", color: "--reference", dash: [6, 4], values });
  for (const joint of run.joints) {
    chart(`${joint.name} position`, joint.unit, joint.time, [measured(joint.position), reference(joint.reference)]);
    chart(`${joint.name} velocity`, `${joint.unit}/s`, joint.time,
      [measured(joint.velocity), reference(joint.reference_velocity)]);
    chart(`${joint.name} tracking error`, `m${joint.unit}`, joint.time,
      [{ label: "error", color: "--error", values: joint.error }]);
  }
  if (run.time.length) {
    chart("bus time per cycle", "ms", run.time, [{ label: "bus time", color: "--bus", values: run.bus_time }]);
    chart("begin of the cycle after schedule", "ms", run.time, [{ label: "late", color: "--bus", values: run.late }]);
  }

  const resize = () => charts.forEach(([plot, figure]) => plot.setSize({ width: figure.clientWidth, height: 210 }));
  addEventListener("resize", resize);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.forEach(([plot]) => plot.redraw()));
})();
