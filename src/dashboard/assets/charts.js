// The history of a cell: position, deformation and motor current over the last minutes, by uPlot.

import { byId, fillChoice, show } from "./dom.js";

const SPANS = [
  { value: 60, label: "1 min" },
  { value: 180, label: "3 min" },
  { value: 600, label: "10 min" },
];
const HEIGHT = 150;
/** Least range of a position, mm: a worm at rest is a flat line, not enlarged noise. */
const MIN_RANGE_MM = 2;

export class Charts {
  #cell = 0;
  #spanS = 60;
  #store;
  #plots = [];
  #drawnNs = 0;

  constructor(store) {
    this.#store = store;
    const room = byId("charts");
    new ResizeObserver(() => this.#resize()).observe(room);
    // Its colours are those of the scheme.
    for (const query of ["(prefers-color-scheme: dark)", "(prefers-contrast: more)"]) {
      matchMedia(query).addEventListener("change", () => this.#rebuild());
    }
  }

  draw() {
    const newestNs = this.#store.samples.at(-1)?.time_ns ?? 0;
    if (newestNs === this.#drawnNs && this.#plots.length > 0) return;
    this.#drawnNs = newestNs;
    if (this.#plots.length === 0) this.#rebuild();
    const data = this.#data();
    this.#plots.forEach((plot, index) => {
      // Of a worm that nobody sees there are no positions.
      show(plot.root, data.series[index].some((value) => value !== null));
      plot.setData([data.seconds, data.series[index]]);
    });
  }

  #choose(change) {
    change();
    this.#rebuild();
    this.#drawnNs = 0;
    this.draw();
  }

  #data() {
    const { samples } = this.#store;
    const endNs = samples.at(-1)?.time_ns ?? 0;
    const kept = samples.filter((sample) => (endNs - sample.time_ns) * 1e-9 <= this.#spanS);
    const inMm = (value) => (typeof value === "number" ? value * 1e3 : null);
    return {
      seconds: kept.map((sample) => (sample.time_ns - endNs) * 1e-9),
      series: [
        kept.map((sample) => inMm(sample.position_m[this.#cell])),
        kept.map((sample) => inMm(sample.deformation_m[this.#cell])),
        kept.map((sample) => inMm(sample.motor_current_a)),
      ],
    };
  }

  #rebuild() {
    this.#plots.forEach((plot) => plot.destroy());
    const { cells, full_scale_m: fullM } = this.#store.worm;
    const cellOptions = Array.from({ length: cells }, (_, cell) => ({ value: cell, label: String(cell + 1) }));
    fillChoice(byId("cell-choice"), cellOptions, this.#cell, (cell) => this.#choose(() => (this.#cell = cell)));
    fillChoice(byId("span-choice"), SPANS, this.#spanS, (spanS) => this.#choose(() => (this.#spanS = spanS)));
    for (const button of byId("cell-choice").children) button.setAttribute("aria-label", `Cell ${button.textContent}`);
    const fullMm = fullM * 1e3;
    const atLeast = (_, low, high) => {
      if (low === null) return [-1, 1];
      const more = Math.max(0, (MIN_RANGE_MM - (high - low)) / 2) + 0.05 * (high - low);
      return [low - more, high + more];
    };
    const symmetric = (_, low, high) => {
      const most = Math.max(fullMm * 1.1, Math.abs(low ?? 0), Math.abs(high ?? 0));
      return [-most, most];
    };
    const fromZero = (_, low, high) => [Math.min(0, low ?? 0), Math.max(100, (high ?? 0) * 1.1)];
    const name = `cell ${this.#cell + 1}`;
    this.#plots = [
      this.#plot(`${name}: position, mm`, "--accent", atLeast, 1),
      this.#plot(`${name}: deformation of its tip, mm (it slides at ±${fullMm.toFixed(2)})`, "--forward", symmetric, 2),
      this.#plot("motor current, mA", "--warn", fromZero, 0),
    ];
  }

  #plot(title, colour, range, digits) {
    const style = getComputedStyle(document.documentElement);
    const of = (name) => style.getPropertyValue(name).trim();
    const axis = { stroke: of("--muted"), grid: { stroke: of("--line"), width: 1 }, ticks: { stroke: of("--line"), width: 1 } };
    const options = {
      title,
      width: byId("charts").clientWidth,
      height: HEIGHT,
      legend: { show: false },
      cursor: { drag: { x: false, y: false } },
      scales: { x: { time: false, range: () => [-this.#spanS, 0] }, y: { range } },
      series: [{}, { stroke: of(colour), width: 1.5, points: { show: false } }],
      axes: [
        { ...axis, size: 28, values: (_, ticks) => ticks.map((tick) => (tick === 0 ? "now" : `${tick} s`)) },
        { ...axis, size: 56, values: (_, ticks) => ticks.map((tick) => tick.toFixed(digits)) },
      ],
    };
    return new uPlot(options, [[], []], byId("charts"));
  }

  #resize() {
    const width = byId("charts").clientWidth;
    this.#plots.forEach((plot) => plot.setSize({ width, height: HEIGHT }));
  }
}
