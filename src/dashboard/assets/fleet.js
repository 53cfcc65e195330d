// All worms on one page. It asks the server twice a second, and commands nothing but what the one button says.
//
// Old looks old: each worm says how old its state is, counted on by this page's clock alone while nothing comes.

import { byId, duration, fillRows, fillValues, make, number, setText, show } from "./dom.js";

const ASK_MS = 500;
/** After so long values count as old, ms. */
const STALE_MS = 1500;
/** How long a request may take, ms. */
const PATIENCE_MS = 6000;

let worms = [];
let heardMs = null;
let problem = "";

/** How old a worm's state is now, ms. */
function ageMs(worm, nowMs) {
  return worm.age_ms === null ? Infinity : worm.age_ms + (nowMs - heardMs);
}

async function ask() {
  try {
    const answer = await fetch("/api/fleet", { signal: AbortSignal.timeout(PATIENCE_MS) });
    if (!answer.ok) throw new Error(`the server answers ${answer.status}`);
    worms = (await answer.json()).worms;
    heardMs = performance.now();
    problem = "";
  } catch (error) {
    problem = String(error.message ?? error);
  }
  setTimeout(ask, ASK_MS);
}

async function hold() {
  const message = byId("message");
  message.classList.remove("refused");
  setText(message, "holding all …");
  try {
    const answer = await fetch("/api/fleet/hold", { method: "POST", signal: AbortSignal.timeout(PATIENCE_MS) });
    const held = (await answer.json()).worms ?? [];
    const refused = held.filter((it) => it.verdict !== "accepted");
    const silent = held.filter((it) => it.verdict === "no-answer" || it.verdict === "busy");
    // Why nobody could be told stands on the card of each: here their names, so that the button keeps its place.
    const unreached = refused.filter((it) => it.robot !== null);
    const words = refused.filter((it) => it.robot === null).map((it) => `${it.name}: ${it.refusal ?? it.verdict}`);
    if (unreached.length > 0) {
      const names = unreached.map((it) => (it.name === it.robot ? it.name : `${it.name} on ${it.robot}`));
      words.unshift(`NOT held, not reached from here: ${names.join(", ")}`);
    }
    const count = held.length - refused.length;
    setText(message, [`hold accepted by ${count} of ${held.length}`, ...words].join("; "));
    message.classList.toggle("refused", silent.length > 0 || !answer.ok);
  } catch (error) {
    message.classList.add("refused");
    setText(message, `NOT held: ${error.message ?? error}`);
  }
}

function createCard() {
  const name = make("h2");
  const mode = make("p", "mode value");
  const age = make("p", "age");
  const alarms = make("p", "alarms value");
  const values = make("dl", "values value");
  const trouble = make("p", "problem");
  const card = make("article", "panel card", make("header", "", name, mode), age, alarms, values, trouble);
  return card;
}

function fillCard(card, worm, nowMs) {
  const [head, age, alarms, values, trouble] = card.children;
  const [name, mode] = head.children;
  const old = ageMs(worm, nowMs);
  const isStale = old > STALE_MS;
  card.classList.toggle("stale", isStale);
  card.dataset.worm = worm.name;
  card.setAttribute("aria-label", worm.name);
  // A robot of which no worm is known stands in the place of its worms.
  const isWorm = worm.network || worm.name !== worm.robot;
  setText(name, worm.robot && isWorm ? `${worm.name} on ${worm.robot}` : worm.name);
  const isFault = worm.fault !== null && worm.fault !== "none";
  setText(mode, isFault ? `fault: ${worm.fault}` : (worm.mode ?? "unknown"));
  mode.dataset.mode = isFault ? "fault" : (worm.mode ?? "");
  setText(age, old === Infinity ? "nothing heard yet" : `${isStale ? "no state for" : "state"} ${duration(old / 1000)}${isStale ? "" : " old"}`);
  age.classList.toggle("old", isStale);
  const raised = worm.raised ?? [];
  const mark = (it) => (it.is_acknowledged ? `${it.name} (seen)` : it.name);
  setText(alarms, worm.raised === null ? "alarms not known" : raised.length === 0 ? "no alarm" : `alarm: ${raised.map(mark).join(", ")}`);
  alarms.classList.toggle("none", worm.raised !== null && raised.length === 0);
  card.classList.toggle("alarmed", raised.length > 0);
  card.classList.toggle("critical", isFault || raised.some((it) => it.is_critical));
  // Who drives is the relay's to say, as the alarms are: without its word nobody knows that nobody does.
  const pairs = worm.raised === null ? [] : [["driver", worm.driver ?? "nobody"]];
  if (worm.range) {
    pairs.push(["battery", `${number(worm.range.charge_share * 100, 0)} %`]);
    pairs.push(["range", `${number(worm.range.range_m, 2)} m, ${duration(worm.range.time_s)}`]);
  }
  if (worm.network) {
    pairs.push(["round trip", worm.network.round_trip_ms === null ? "–" : `${worm.network.round_trip_ms} ms`]);
    pairs.push(["frames lost", String(worm.network.frames_lost)]);
    pairs.push(["may drive", worm.network.may_drive ? "yes" : "no: watch and hold"]);
    const { synchronised } = worm.network;
    pairs.push(["robot's clock", synchronised === null ? "not known" : synchronised ? "synchronised" : "not synchronised"]);
  }
  fillValues(values, pairs);
  setText(trouble, worm.problem ?? "");
  show(trouble, Boolean(worm.problem));
}

function paint() {
  const nowMs = performance.now();
  const silentMs = heardMs === null ? Infinity : nowMs - heardMs;
  const isStale = silentMs > STALE_MS;
  document.body.classList.toggle("stale", isStale);
  const banner = byId("banner");
  show(banner, isStale);
  if (isStale) {
    const since = silentMs === Infinity ? "" : ` for ${duration(silentMs / 1000)}`;
    setText(banner, `nothing heard of the dashboard server${since}${problem ? `: ${problem}` : ""}`);
  }
  fillRows(byId("fleet"), worms, createCard, (card, worm) => fillCard(card, worm, nowMs));
  const silent = worms.filter((worm) => ageMs(worm, nowMs) > STALE_MS).length;
  const alarmed = worms.filter((worm) => (worm.raised ?? []).length > 0 || (worm.fault ?? "none") !== "none").length;
  const parts = [`${worms.length} ${worms.length === 1 ? "worm" : "worms"}`];
  if (alarmed > 0) parts.push(`${alarmed} with alarms or faults`);
  if (silent > 0) parts.push(`${silent} silent`);
  setText(byId("summary"), heardMs === null ? "waiting" : parts.join(", "));
  document.title = alarmed > 0 || silent > 0 ? `(!) ${parts.join(", ")}` : parts[0];
}

byId("hold").addEventListener("click", hold);
addEventListener("keydown", (event) => {
  if (event.key === "h" && !event.ctrlKey && !event.metaKey && !event.altKey && !event.repeat) hold();
});
setInterval(paint, 200);
ask();
