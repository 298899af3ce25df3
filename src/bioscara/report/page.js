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
    u.ctx.fillRect(left, top, at(0) - left, height);
    u.ctx.fillRect(at(run.end), top, left + width - at(run.end), height);
  };

  const axis = (extra) => ({
    stroke: () => style("--quiet"),
    grid: { stroke: () => style("--line"), width: 1 },
    ticks: { stroke: () => style("--line"), width: 1 },
    font: "11px system-ui, sans-serif",
    ...extra,
  });

  const number = (u, value) => (value == null ? "-" : value.toPrecision(5));

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
      axes: [axis({ size: 26, values: (u, ticks) => ticks.map((t) => +t.toFixed(6) + " s") }), axis({ size: 62 })],
      series: [
        { label: "time", value: (u, t) => (t == null ? "-" : t.toFixed(3) + " s") },
        ...series.map(({ label, color, dash }) => ({
          label, dash, width: 1.5, value: number, points: { show: false }, stroke: () => style(color),
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
