// What the page knows of the worm: the history that the server sent first, and what came since.

import { Lateness } from "./stream.js";

/** What is kept, as the server keeps it: ten minutes of samples, gait cycles, changes. */
const MAX_SAMPLES = 3000;
const MAX_CYCLES = 2048;
const MAX_CHANGES = 256;
/** Time between samples, ns. */
const SAMPLE_NS = 200_000_000;

export class Store {
  worm = null;
  wormd = "";
  /** The newest frame. */
  frame = null;
  /** The newest word about the server's connection to the relay. */
  status = { connected: false, problem: "waiting for the server" };
  samples = [];
  /** Gait cycles with their energies: {cycle, energy}. */
  cycles = [];
  alarms = [];
  events = [];
  remedies = {};
  faultRemedies = {};
  #lateness = new Lateness();
  #bootId = "";
  /** How old the newest frame was when it arrived, beside what it says, and when that was, ms. */
  #lateMs = 0;
  #arrivedMs = -Infinity;

  takeHello(hello) {
    if (hello.boot_id !== this.#bootId) {
      this.#bootId = hello.boot_id;
      this.#lateness.reset();
      this.frame = null;
      this.#arrivedMs = -Infinity;
    }
    this.worm = hello.worm;
    this.wormd = hello.wormd;
    this.samples = hello.samples;
    this.cycles = hello.cycles.map((cycle, index) => ({ cycle, energy: hello.energy[index] }));
    this.alarms = hello.alarms.slice(-MAX_CHANGES);
    this.events = hello.events.slice(-MAX_CHANGES);
    this.remedies = hello.remedies;
    this.faultRemedies = hello.fault_remedies;
  }

  takeFrame(frame) {
    this.#arrivedMs = performance.now();
    this.#lateMs = this.#lateness.of(frame.time_ns / 1e6, this.#arrivedMs);
    this.frame = frame;
    this.status = { connected: true, problem: null };
    frame.cycles.forEach((cycle, index) => this.cycles.push({ cycle, energy: frame.energy[index] }));
    this.cycles.splice(0, this.cycles.length - MAX_CYCLES);
    this.alarms.push(...frame.alarms);
    this.alarms.splice(0, this.alarms.length - MAX_CHANGES);
    this.events.push(...frame.events);
    this.events.splice(0, this.events.length - MAX_CHANGES);
    this.#takeSample(frame);
  }

  takeStatus(status) {
    this.status = status;
  }

  #takeSample({ state, estimate }) {
    if (!state || !estimate || estimate.time_ns === 0) return;
    const lastNs = this.samples.at(-1)?.time_ns ?? 0;
    if (estimate.time_ns < lastNs + SAMPLE_NS) return;
    const { time_ns, phase, position_m, deformation_m } = estimate;
    this.samples.push({ time_ns, phase, motor_current_a: state.motor_current_a, position_m, deformation_m });
    this.samples.splice(0, this.samples.length - MAX_SAMPLES);
  }

  /** How long ago the newest frame was made, ms; infinite without one. */
  frameAgeMs() {
    return performance.now() - this.#arrivedMs + this.#lateMs;
  }

  /** What the worm's clock shows now, ns, as far as that is known. */
  nowNs() {
    return this.frame ? this.frame.time_ns + this.frameAgeMs() * 1e6 : 0;
  }

  /** How old the newest message of a topic is, ms; null where there was none. */
  ageMs(topic) {
    if (!this.frame) return null;
    const since = (time_ns) => (time_ns ? Math.max(0, (this.nowNs() - time_ns) / 1e6) : null);
    if (topic === "cycle") return since(this.cycles.at(-1)?.cycle.end_ns);
    if (topic === "inferred") return since(this.frame.inferred?.end_ns);
    if (topic === "range") return since(this.frame.range?.end_ns);
    const age = this.frame.age_ms[topic];
    return age === null || age === undefined ? null : age + this.frameAgeMs();
  }
}
