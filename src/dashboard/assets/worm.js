// The worm in its canal, to scale along the canal and at the canal's slope: each cell, where its tip touches, a ruler in millimetres. How far
// a tip is deformed is too little to be seen at that scale, so below each cell a gauge shows it against the largest deformation. A worm that
// nobody sees is dashed, and is where the motor's current has it.

import { byId, setText } from "./dom.js";
import { cellPositionsM } from "./inferred.js";

const SVG = "http://www.w3.org/2000/svg";
/** What is shown of the canal before and behind the worm, m. */
const MARGIN_M = 0.03;
/** Distances between labels of the ruler, mm, and the room that one needs, px. */
const LABELS_MM = [10, 20, 50, 100, 200, 500, 1000, 2000, 5000];
const LABEL_PX = 56;
/** Farthest position that is shown, m. */
const MAX_POSITION_M = 1e5;
/** Heights of the parts, px. */
const TOP = 10;
const BODY = 40;
const WALL = 74;
const RULER = 84;
const GAUGE = 118;
const HEIGHT = 132;
const MAX_HEIGHT = 380;

export class WormPicture {
  #svg = byId("worm");
  #canal;
  #body;
  #ruler;
  #cells = [];
  #widthM = 0;
  #rulerKey = "";

  constructor() {
    this.#canal = add(this.#svg, "g");
    add(this.#canal, "rect", { class: "canal", y: TOP, height: WALL - TOP });
    this.#body = add(this.#canal, "line", { class: "spine", y1: BODY, y2: BODY });
    this.#ruler = add(this.#canal, "g", { class: "ruler" });
  }

  draw(worm, frame) {
    const isKnown = (x) => typeof x === "number" && Math.abs(x) < MAX_POSITION_M;
    const measured = (frame.estimate?.position_m ?? frame.state?.position_m ?? []).slice(0, worm.cells);
    const inferred = measured.some(isKnown) ? null : cellPositionsM(worm, frame);
    const positions = inferred ?? measured;
    const known = positions.filter(isKnown);
    this.#canal.toggleAttribute("hidden", known.length === 0);
    if (known.length === 0) {
      const why = frame.inferred
        ? "they are inferred from the motor's current after some gait cycles"
        : "there is no tracker, and nothing is inferred from the motor's current";
      setText(byId("canal-text"), `no positions: ${why}`);
      return;
    }
    const [rear, front] = [Math.min(...known), Math.max(...known)];
    const { lengthPx } = this.#place(worm.slope_deg);
    this.#scale(front - rear);
    const labelMm = LABELS_MM.find((mm) => (mm / 1000 / this.#widthM) * lengthPx >= LABEL_PX) ?? LABELS_MM.at(-1);
    const stepM = labelMm / 5000;
    // The window moves in whole steps of the ruler: the worm visibly crawls, and the canal does not flicker.
    const startM = Math.floor((rear - MARGIN_M) / stepM) * stepM;
    const at = (x) => ((x - startM) / this.#widthM) * lengthPx;

    set(this.#canal.firstElementChild, { x: 0, width: lengthPx });
    set(this.#body, { x1: at(rear), x2: at(front) });
    this.#drawRuler(startM, stepM, labelMm, lengthPx, at);
    const gapM = known.length > 1 ? (front - rear) / (known.length - 1) : 0.03;
    const sizes = { width: Math.min(46, Math.max(14, (gapM / this.#widthM) * lengthPx * 0.55)), fullM: worm.full_scale_m };
    positions.forEach((x, cell) => this.#drawCell(cell, x, frame.estimate, at, sizes, inferred !== null));
    const text = positions.map((x, cell) => `cell ${cell + 1} at ${typeof x === "number" ? (x * 1e3).toFixed(0) : "unknown"} mm`);
    const how = inferred ? `inferred from the motor's current, ± ${(frame.inferred.position_sigma_m * 1e3).toFixed(0)} mm; ` : "";
    this.#svg.setAttribute("aria-label", `The worm in its canal: ${how}${text.join(", ")}`);
    const direction = worm.backward ? "left" : "right";
    setText(byId("canal-text"), `${how}canal ${worm.slope_deg}°, it crawls to the ${direction}; ruler in mm`);
  }

  /** Turns the canal to its slope, as long as there is room. */
  #place(slopeDeg) {
    const room = this.#svg.clientWidth || 600;
    const angle = (slopeDeg * Math.PI) / 180;
    const [sin, cos] = [Math.abs(Math.sin(angle)), Math.cos(angle)];
    const byWidth = cos > 0.01 ? (room - HEIGHT * sin) / cos : Infinity;
    const byHeight = sin > 0.01 ? (MAX_HEIGHT - HEIGHT * cos) / sin : Infinity;
    const lengthPx = Math.max(100, Math.min(byWidth, byHeight));
    const [wide, high] = [lengthPx * cos + HEIGHT * sin, lengthPx * sin + HEIGHT * cos];
    set(this.#svg, { viewBox: `0 0 ${room} ${high}`, height: high });
    // Uphill is to the right; downhill the canal begins at the upper left.
    const startY = slopeDeg >= 0 ? lengthPx * sin : 0;
    const startX = (room - wide) / 2 + (slopeDeg >= 0 ? 0 : HEIGHT * sin);
    set(this.#canal, { transform: `translate(${startX} ${startY}) rotate(${-slopeDeg})` });
    return { lengthPx };
  }

  /** How much of the canal is shown: changes seldom, so that the worm does not breathe. */
  #scale(spanM) {
    const neededM = spanM + 2 * MARGIN_M;
    if (neededM > this.#widthM || neededM < this.#widthM * 0.6) this.#widthM = neededM * 1.15;
  }

  #drawRuler(startM, stepM, labelMm, lengthPx, at) {
    const key = `${startM} ${stepM} ${this.#widthM} ${lengthPx}`;
    if (key === this.#rulerKey) return;
    this.#rulerKey = key;
    this.#ruler.replaceChildren();
    const first = Math.ceil(startM / stepM - 1e-9);
    for (let index = first; index * stepM < startM + this.#widthM; index += 1) {
      const x = at(index * stepM);
      const hasLabel = index % 5 === 0;
      add(this.#ruler, "line", { x1: x, x2: x, y1: RULER - (hasLabel ? 9 : 5), y2: RULER });
      if (hasLabel && x < lengthPx - 12) {
        add(this.#ruler, "text", { x, y: RULER + 12, "text-anchor": "middle" }).textContent = String((index / 5) * labelMm);
      }
    }
  }

  #drawCell(cell, x, estimate, at, { width, fullM }, isInferred) {
    const parts = (this.#cells[cell] ??= this.#makeCell(cell));
    const isKnown = typeof x === "number";
    parts.group.classList.toggle("unseen", !isKnown);
    if (!isKnown) return;
    const centre = at(x);
    const contact = estimate?.contact_m[cell];
    const deformation = estimate?.deformation_m[cell] ?? 0;
    parts.group.dataset.positionMm = (x * 1e3).toFixed(3);
    parts.group.setAttribute("class", `cell ${isInferred ? "inferred" : tipState(estimate, cell)}`);
    set(parts.box, { x: centre - width / 2, width });
    set(parts.label, { x: centre });
    set(parts.foot, { x1: centre, x2: typeof contact === "number" ? at(contact) : centre });
    const half = Math.max(12, width / 2);
    const share = Math.max(-1, Math.min(1, fullM > 0 ? deformation / fullM : 0));
    set(parts.gauge, { x: centre - half, width: 2 * half });
    set(parts.fill, { x: centre + Math.min(0, share) * half, width: Math.abs(share) * half });
    set(parts.zero, { x1: centre, x2: centre });
  }

  #makeCell(cell) {
    const group = add(this.#canal, "g", { class: "cell", "data-cell": cell + 1 });
    const foot = add(group, "line", { class: "foot", y1: BODY + 12, y2: WALL });
    const box = add(group, "rect", { class: "box", y: BODY - 16, height: 32, rx: 5 });
    const label = add(group, "text", { class: "label", y: BODY + 5, "text-anchor": "middle" });
    label.textContent = String(cell + 1);
    const gauge = add(group, "rect", { class: "gauge", y: GAUGE - 5, height: 10 });
    const fill = add(group, "rect", { class: "fill", y: GAUGE - 5, height: 10 });
    const zero = add(group, "line", { class: "zero", y1: GAUGE - 8, y2: GAUGE + 8 });
    return { group, foot, box, label, gauge, fill, zero };
  }
}

/** What a tip does: stick, forward, backward; unknown where nothing says how it is deformed. */
export function tipState(estimate, cell) {
  if (typeof estimate?.deformation_m[cell] !== "number") return "unknown";
  const slides = Math.floor(estimate.sliding_mask / 2 ** cell) % 2 === 1;
  if (!slides) return "stick";
  return estimate.deformation_m[cell] > 0 ? "forward" : "backward";
}

function add(parent, name, attributes = {}) {
  const element = document.createElementNS(SVG, name);
  set(element, attributes);
  parent.append(element);
  return element;
}

function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    element.setAttribute(name, typeof value === "number" ? Math.round(value * 100) / 100 : value);
  }
}
