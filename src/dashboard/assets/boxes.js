// Boxes of the black box: what happened, and the log of it to download. The browser takes up a broken download where it ended.

import { byId, duration, setText } from "./dom.js";
import { loadListing, localTime } from "./listing.js";

/** How long after something has happened the black box has begun its box, ms. */
const BEGUN_MS = 2000;
/** How often the list is loaded again while a box is still being written, ms. */
const AGAIN_MS = 15000;

/** The list of the boxes: it is loaded again by itself when there is something new. */
export class Boxes {
  #loadedMs = null;
  #timer = 0;
  #newest = null;

  async load() {
    clearTimeout(this.#timer);
    const answer = await loadListing("boxes", "/api/boxes", {
      entries: ({ boxes }) => boxes?.toReversed(),
      describe,
      none: ({ folder }) => `${folder} has no box: nothing has happened, or no black box runs (wormd record --black-box).`,
      download: true,
    });
    if (answer) this.#loadedMs = performance.now();
    if (answer?.boxes?.some((box) => box.under_way)) this.#loadLater(AGAIN_MS);
    this.drawAge();
  }

  /** Looks for a new box after each change of what boxes are made of. */
  note({ frame, alarms }) {
    const { fault, hold_reason: reason } = frame?.state ?? {};
    const newest = `${alarms.at(-1)?.time_ns} ${fault} ${reason}`;
    const isNews = this.#newest !== null && this.#newest !== newest;
    this.#newest = newest;
    if (isNews) this.#loadLater(BEGUN_MS);
  }

  drawAge() {
    const ageMs = this.#loadedMs === null ? null : performance.now() - this.#loadedMs;
    setText(byId("boxes-age"), ageMs === null ? "" : `${duration(ageMs / 1000)} old`);
  }

  #loadLater(ms) {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.load(), ms);
  }
}

function describe(box) {
  const when = box.unix_ns === null ? "at an unknown time" : localTime(box.unix_ns / 1e9);
  const later = [...new Set(box.events.slice(1).map(({ event }) => event))].filter((event) => event !== box.reason);
  const then = later.length > 0 ? `, then ${later.join(", ")}` : "";
  const about = `${when}${then}, ${duration(box.duration_s)}, ${(box.bytes / 1e6).toFixed(1)} MB`;
  return {
    url: box.under_way ? null : `/boxes/${box.name}`,
    title: box.reason ?? box.name,
    note: box.under_way ? ` ${about}: still being written` : ` ${about}`,
  };
}
