// The panels with texts and tables. Each is a function of what the page knows, and changes only what has changed.

import { byId, duration, fillRows, fillValues, make, number, scaled, setText, show } from "./dom.js";
import { positionM } from "./inferred.js";
import { STALE_MS } from "./stream.js";
import { tipState } from "./worm.js";

const TIP_TEXT = { stick: "sticks", forward: "slides forward", backward: "slides backward", unknown: "–" };
const PARTS = ["copper", "gears", "sliding", "weight"];
const SHOWN_CYCLES = 12;
const SHOWN_EVENTS = 40;

/** Bit `code` of a mask; the masks have up to 32 bits. */
const hasBit = (mask, code) => Math.floor((mask ?? 0) / 2 ** code) % 2 === 1;
/** The names of alarms, in the order of their codes. */
const ALARMS = [
  "motor-stall", "jammed-cell", "no-progress", "sliding-down", "energy-over-budget", "battery-low", "link-fault", "tracker-fault",
  "device-fault", "model-mismatch", "recording-stopped",
  "friction-loss", "inferred-jam", "more-load",
];

/** Why what is shown is old, or null. */
export function staleness(store, stream) {
  const silentMs = stream.silentMs();
  if (silentMs >= STALE_MS) {
    const since = Number.isFinite(silentMs) ? ` for ${duration(silentMs / 1000)}` : "";
    return `nothing heard of the dashboard server${since}`;
  }
  if (!store.status.connected) return store.status.problem ?? "the dashboard has no connection to the relay";
  if (!store.frame) return "waiting for the relay";
  if (store.frameAgeMs() >= STALE_MS) return `nothing heard of the relay for ${duration(store.frameAgeMs() / 1000)}`;
  for (const topic of ["state", "estimate"]) {
    const ageMs = store.ageMs(topic);
    if (ageMs === null) return `no ${topic} yet`;
    if (ageMs >= STALE_MS) return `no ${topic} for ${duration(ageMs / 1000)}: the values are old`;
  }
  return null;
}

/** Everything that grows old by itself: ages, banner, grey. */
export function drawAges(store, why) {
  document.body.classList.toggle("stale", why !== null);
  const banner = byId("banner");
  show(banner, why !== null);
  setText(banner, why === null ? "" : `OLD VALUES: ${why}`);
  const ageMs = store.ageMs("state");
  setText(byId("freshness"), ageMs === null ? "no data yet" : `state ${duration(ageMs / 1000)} old`);
  for (const element of document.querySelectorAll("[data-age]")) {
    const topic = element.dataset.age;
    const topicMs = store.ageMs(topic);
    setText(element, topicMs === null ? "" : `${duration(topicMs / 1000)} old`);
    // What comes once in a gait cycle is as old as the cycle is long.
    const isOld = topicMs !== null && topicMs >= STALE_MS && !["cycle", "range", "inferred", "recording"].includes(topic);
    element.closest(".panel").classList.toggle("stale", isOld || (topic === "recording" && topicMs >= 3 * STALE_MS));
  }
}

export function drawHead(store, driver) {
  const { frame, worm } = store;
  setText(byId("worm-name"), worm.name);
  setText(byId("about"), `wormd ${store.wormd}, ${worm.port ? `on ${worm.port}` : "virtual worm or unknown port"}`);
  const state = frame?.state;
  const mode = byId("mode");
  setText(mode, state?.mode ?? "waiting");
  mode.dataset.mode = state?.mode ?? "";
  const who = frame?.driver;
  const attends = who?.attends ? ", and the worm crawls while this lasts" : "";
  const name = driver.drives ? "you drive" : `${who?.name} drives`;
  setText(byId("driver"), who ? `${name}${attends}` : "nobody drives");
  byId("driver").classList.toggle("me", driver.drives);
}

/** The title of the tab says what is wrong, also where it is not looked at. */
export function drawTitle(store, why) {
  const raised = unacknowledged(store).map(({ alarm }) => alarm.kind);
  const name = store.worm?.name ?? "wormd";
  const old = why ? "(old) " : "";
  const alarm = raised.length > 0 ? `⚠ ${raised[0]} – ` : "";
  const title = `${old}${alarm}${name}`;
  if (document.title !== title) document.title = title;
}

function unacknowledged(store) {
  const { raised = [], raised_text: texts = [], state } = store.frame ?? {};
  return raised
    .map((alarm, index) => ({ alarm, text: texts[index] ?? alarm.kind }))
    .filter(({ alarm }) => !hasBit(state?.acknowledged_mask, ALARMS.indexOf(alarm.kind)));
}

export function drawValues({ frame }) {
  const state = frame.state;
  if (!state) return;
  const estimate = frame.estimate;
  const cycle = Math.floor(state.phase ?? NaN);
  fillValues(byId("values"), [
    ["phase", `${number(state.phase === null ? null : state.phase - cycle, 2)} of cycle ${number(cycle, 0)}`],
    ["motor current", `${number(scaled(state.motor_current_a, 1e3), 0)} mA`],
    ["cam", `${number(scaled(state.motor_velocity_rad_s, 30 / Math.PI), 1)} rev/min`],
    ["voltage", `${number(state.bus_voltage_v, 2)} V`],
    ["temperature", `${number(state.motor_temperature_c, 0)} °C`],
    ["electrical power", `${number(scaled(estimate?.power_electrical_w, 1e3), 0)} mW`],
    ["holds because", state.hold_reason === "none" ? "–" : state.hold_reason],
    ["emergency stop", state.emergency_stop === null ? "none" : state.emergency_stop ? "PRESSED" : "released"],
  ]);
}

export function drawCells({ frame, worm }) {
  const estimate = frame.estimate;
  const positions = (estimate?.position_m ?? frame.state?.position_m ?? []).slice(0, worm.cells);
  fillRows(
    byId("cells").tBodies[0],
    positions,
    () => make("tr", "", make("th"), make("td"), make("td"), make("td"), make("td")),
    (row, x, cell) => {
      const [head, position, deformation, force, tip] = row.children;
      head.scope = "row";
      row.dataset.cell = cell + 1;
      setText(head, String(cell + 1));
      setText(position, number(scaled(x, 1e3), 2));
      setText(deformation, number(scaled(estimate?.deformation_m[cell], 1e3), 3));
      setText(force, number(estimate?.force_n[cell], 2));
      const state = tipState(estimate, cell);
      setText(tip, TIP_TEXT[state]);
      tip.className = `tip ${state}`;
    },
  );
}

export function drawAlarms(store, acknowledge) {
  const { frame } = store;
  const { state, estimate } = frame;
  const nowNs = store.nowNs();
  const faultElement = byId("fault");
  const fault = state?.fault && state.fault !== "none" ? state.fault : null;
  show(faultElement, fault !== null);
  if (fault) {
    const cause = state.fault_alarm ? ` (${state.fault_alarm})` : "";
    const remedy = fault === "alarm" ? store.remedies[state.fault_alarm] : store.faultRemedies[fault];
    setText(faultElement, `Fault ${fault}${cause}. Do: ${remedy ?? "see docs/alarms.md"}`);
  }
  const raised = frame.raised.map((alarm, index) => ({ alarm, text: frame.raised_text[index] ?? alarm.kind }));
  const list = byId("alarms");
  list.classList.toggle("none", raised.length === 0);
  fillRows(
    list,
    raised.length > 0 ? raised : [null],
    () => make("li", "", make("strong"), make("span", "note"), make("p", "remedy"), make("button", "plain")),
    (row, item) => {
      const [what, about, remedy, button] = row.children;
      row.className = item ? `alarm ${item.alarm.severity}` : "";
      setText(what, item ? item.text : "no alarm is raised");
      const isSeen = item && hasBit(state?.acknowledged_mask, ALARMS.indexOf(item.alarm.kind));
      const by = isSeen && state.acknowledged_by !== null ? `, acknowledged (user ${state.acknowledged_by})` : "";
      const since = item ? duration((nowNs - item.alarm.since_ns) / 1e9) : "";
      setText(about, item ? ` ${item.alarm.severity}, for ${since}${by}` : "");
      setText(remedy, item ? `Do: ${store.remedies[item.alarm.kind] ?? ""}` : "");
      show(button, Boolean(item) && !isSeen);
      setText(button, item ? `Acknowledge ${item.alarm.kind}` : "");
      row.classList.toggle("seen", Boolean(isSeen));
      button.type = "button";
      button.onclick = () => acknowledge(item.alarm.kind);
    },
  );
  const armed = ALARMS.filter((_, code) => hasBit(estimate?.armed_mask, code));
  const waiting = ALARMS.filter((_, code) => !hasBit(estimate?.armed_mask, code));
  setText(byId("armed"), `${armed.length} of ${ALARMS.length} armed${waiting.length > 0 ? `; not armed: ${waiting.join(", ")}` : ""}`);
  const open = unacknowledged(store);
  const banner = byId("alarm-banner");
  show(banner, open.length > 0);
  setText(banner, open.map(({ text, alarm }) => `${text}. Do: ${store.remedies[alarm.kind] ?? ""}`).join(" — "));
  fillRows(
    byId("alarm-changes"),
    store.alarms.slice(-SHOWN_EVENTS).reverse(),
    () => make("li"),
    (row, alarm) => setText(row, `${ago(nowNs, alarm.time_ns)} ${alarm.kind} ${alarm.raised ? "raised" : "cleared"}`),
  );
}

export function drawCycles(store) {
  const body = byId("cycles").tBodies[0];
  fillRows(
    body,
    store.cycles.slice(-SHOWN_CYCLES).reverse(),
    () => {
      const cells = Array.from({ length: 6 }, () => make("td"));
      const bar = make("div", "bar", ...PARTS.map((part) => make("span", part)));
      bar.setAttribute("aria-hidden", "true");
      return make("tr", "", make("th"), ...cells, make("td", "bar-column", bar));
    },
    (row, { cycle, energy }) => {
      const [head, ...cells] = row.children;
      head.scope = "row";
      row.classList.toggle("unsettled", !cycle.settled);
      const values = [energy.electrical_j, ...PARTS.map((part) => energy[`${part}_j`])];
      const texts = [number(scaled(cycle.advance_m, 1e3), 2), ...values.map((joules) => number(scaled(joules, 1e3), 1))];
      setText(head, String(cycle.index));
      texts.forEach((text, index) => setText(cells[index], text));
      const bar = cells[6].firstElementChild;
      PARTS.forEach((part, index) => {
        const share = Math.max(0, Math.min(1, (energy[`${part}_j`] ?? 0) / energy.electrical_j));
        const width = `${Number.isFinite(share) ? (share * 100).toFixed(1) : 0}%`;
        if (bar.children[index].style.width !== width) bar.children[index].style.width = width;
      });
    },
  );
}

export function drawRange({ frame }) {
  const { range, estimate } = frame;
  if (!range) {
    const hasBattery = estimate && estimate.battery_fraction !== null;
    const text = hasBattery ? "after the first gait cycle" : "no [battery] is configured";
    fillValues(byId("range"), [["range", text]]);
    return;
  }
  const between = (low, high, digits) => `${number(low, digits)} to ${number(high, digits)}`;
  fillValues(byId("range"), [
    ["range", `${number(range.range_m, 1)} m (${between(range.range_low_m, range.range_high_m, 1)})`],
    ["time left", `${duration(range.time_s)} (${duration(range.time_low_s)} to ${duration(range.time_high_s)})`],
    ["charge", `${number(range.charge_share * 100, 0)} ± ${number(range.charge_sigma_share * 100, 0)} %`],
    ["a cycle takes", `${number(range.energy_per_cycle_j, 2)} J from the battery`],
  ]);
}

/** A trip under way, or how the last one ended; its buttons for who is logged in. */
export function drawTrip({ frame }, driver) {
  const { trip } = frame;
  show(byId("trip-panel"), Boolean(trip));
  if (!trip) return;
  const isOver = trip.phase === "done" || trip.phase === "aborted";
  const question = !isOver && trip.needs_operator ? "; it waits for you" : "";
  setText(byId("trip"), `${frame.trip_text}${question}`);
  setText(byId("trip-energy"), frame.trip_energy_text ?? "");
  show(byId("trip-drive"), driver.isLoggedIn && !isOver);
  show(byId("trip_pause"), trip.phase !== "holding");
  show(byId("trip_resume"), trip.phase === "holding");
}

/** What the motor's current alone says, each with its standard error. */
export function drawInferred({ frame }) {
  const { inferred } = frame;
  if (!inferred || inferred.advance_m === null) {
    fillValues(byId("inferred"), [["state", inferred ? "warming up: after three gait cycles" : "self-sensing is off"]]);
    return;
  }
  const degrees = (...angles_rad) => `${angles_rad.map((angle_rad) => number((angle_rad * 180) / Math.PI, 1)).join(" ± ")}°`;
  const known = (value, sigma, digits, unit) => `~${number(value, digits)} ± ${number(sigma, digits)} ${unit}`;
  fillValues(byId("inferred"), [
    ["state", inferred.standing],
    ["advance", known(inferred.advance_m * 1e3, inferred.advance_sigma_m * 1e3, 2, "mm a cycle")],
    ["losses", known(inferred.energy_loss_j * 1e3, inferred.energy_loss_sigma_j * 1e3, 1, "mJ a cycle")],
    ["pull", known(inferred.pull_n, inferred.pull_sigma_n, 2, "N")],
    ...(inferred.slope_is_measured ? [["slope, measured", degrees(inferred.slope_rad, inferred.slope_sigma_rad)]] : []),
    ["position", known(scaled(positionM(frame), 1e3), inferred.position_sigma_m * 1e3, inferred.position_sigma_m < 1e-3 ? 1 : 0, "mm")],
    ...(inferred.contradicting_marks > 0
      ? [["marks", `${inferred.contradicting_marks} of ${inferred.marks} contradict the position; the last ${known(inferred.mark_off_m * 1e3, inferred.mark_off_sigma_m * 1e3, 0, "mm ahead")}`]]
      : []),
    ...inferred.friction_n.map((friction, cell) => [
      `friction ${cell + 1}`,
      known(friction, inferred.friction_sigma_n[cell], 2, "N"),
    ]),
  ]);
}

export function drawTiming({ frame, worm }) {
  const { timing, statistics, state } = frame;
  if (timing) {
    fillValues(byId("loop"), [
      ["rate", `${number(timing.period_ns > 0 ? 1e9 / timing.period_ns : worm.rate_hz, 0)} Hz`],
      ["ticks", String((state?.sequence ?? -1) + 1)],
      ["overruns", String(timing.overruns)],
      ["link failures", String(state?.link_failures ?? 0)],
      ["host pauses", statistics ? `${statistics.host_pauses}, ${number(statistics.host_paused_s, 2)} s` : "–"],
    ]);
  }
  const rows = statistics ? [["wake", statistics.wake_us], ["bus", statistics.bus_us], ["compute", statistics.compute_us]] : [];
  fillRows(
    byId("timing").tBodies[0],
    rows,
    () => make("tr", "", make("th"), make("td"), make("td"), make("td")),
    (row, [name, us]) => {
      row.firstElementChild.scope = "row";
      [name, number(us.p50, 0), number(us.p99, 0), number(us.max, 0)].forEach((text, index) => setText(row.children[index], text));
    },
  );
}

export function drawRecording({ frame }) {
  const element = byId("recording");
  setText(element, frame.recording_text ?? "no recording of everything: `wormd record` makes one; what the black box keeps is listed below");
  element.classList.toggle("refused", frame.recording?.state === "stopped");
}

export function drawEvents(store) {
  const nowNs = store.nowNs();
  fillRows(
    byId("events"),
    store.events.slice(-SHOWN_EVENTS).reverse(),
    () => make("li"),
    (row, event) => setText(row, `${ago(nowNs, event.time_ns)} ${event.text}`),
  );
}

function ago(nowNs, thenNs) {
  return nowNs > 0 ? `${duration(Math.max(0, Math.round((nowNs - thenNs) / 1e9)))} ago:` : "";
}
