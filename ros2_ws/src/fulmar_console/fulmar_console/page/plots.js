// Curves below the view, by uPlot: five times a second, and never more than some hundred samples.
import { uPlot } from "./vendor.js";
const KEPT = 500;
const REDRAW_MS = 200;
const HEIGHT = 118;
const AXIS = { stroke: "#9aabba", grid: { stroke: "#243240", width: 1 }, ticks: { stroke: "#243240" }, size: 46, font: "11px sans-serif" };
const COLORS = ["#64b5f6", "#ffca5c", "#6fd08c", "#ff8a80", "#b39ddb", "#80cbc4", "#f48fb1", "#c5e1a5"];

// Small and large values both readable: an axis that says 0, 0, 0 says nothing.
function short(value) {
  if (value === null || value === undefined) return "";
  const size = Math.abs(value);
  return size !== 0 && (size < 0.01 || size >= 1e5) ? value.toExponential(0) : String(Number(value.toPrecision(3)));
}

export class Plots {
  constructor(parent) {
    this.parent = parent;
    this.charts = new Map();
    this.recorded = new Map(); // of the selected robot: title -> {xs, labels, columns}
    setInterval(() => this.refresh(), REDRAW_MS);
    new ResizeObserver(() => this.resize()).observe(parent);
  }

  clear() {
    this.recorded.clear();
    for (const { plot, box } of this.charts.values()) {
      plot.destroy();
      box.remove();
    }
    this.charts.clear();
  }

  // One sample more of a plot whose curves have these labels.
  add(title, x, labels, values) {
    let each = this.recorded.get(title);
    if (!each || each.labels.join() !== labels.join()) {
      each = { xs: [], labels, columns: labels.map(() => []) };
      this.recorded.set(title, each);
    }
    if (each.xs.length && x <= each.xs.at(-1)) return;
    each.xs.push(x);
    values.forEach((value, i) => each.columns[i].push(value));
    if (each.xs.length > KEPT) for (const column of [each.xs, ...each.columns]) column.splice(0, KEPT / 5);
    each.dirty = true;
  }

  refresh() {
    if (document.hidden || !this.parent.offsetParent) return;
    for (const [title, each] of this.recorded) {
      if (!each.dirty) continue;
      each.dirty = false;
      this.setData(title, each.xs, each.labels.map((label, i) => ({ label, ys: each.columns[i] })));
    }
  }

  // Any curves: [{label, color, ys}].
  setData(title, xs, curves) {
    let chart = this.charts.get(title);
    const key = curves.map((each) => each.label).join();
    if (chart && chart.key !== key) {
      chart.plot.destroy();
      chart.box.remove();
      chart = null;
    }
    if (!chart) chart = this.make(title, key, curves);
    chart.plot.setData([xs, ...curves.map((each) => each.ys)]);
  }

  make(title, key, curves) {
    const box = document.createElement("div");
    box.append(Object.assign(document.createElement("h3"), { textContent: title }));
    this.parent.append(box);
    const series = curves.map(({ label, color }, i) => ({
      label, stroke: color || COLORS[i % COLORS.length], width: 1.6, points: { show: false }, value: (_, value) => short(value),
    }));
    const options = {
      width: Math.max(160, box.clientWidth), height: HEIGHT, legend: { show: curves.length > 1 && curves.length < 4 },
      scales: { x: { time: false } }, cursor: { points: { show: false } }, series: [{ label: "s" }, ...series],
      axes: [AXIS, { ...AXIS, values: (_, ticks) => ticks.map(short) }],
    };
    const chart = { box, key, plot: new uPlot(options, [[], ...curves.map(() => [])], box) };
    this.charts.set(title, chart);
    this.resize(); // the others have become narrower
    return chart;
  }

  resize() { for (const { plot, box } of this.charts.values()) plot.setSize({ width: Math.max(160, box.clientWidth), height: HEIGHT }); }
}
