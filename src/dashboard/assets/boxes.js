// Boxes of the black box: what happened, and the log of it to download. The browser takes up a broken download where it ended.

import { duration } from "./dom.js";
import { loadListing, localTime } from "./listing.js";

export const loadBoxes = () =>
  loadListing("boxes", "/api/boxes", {
    entries: (answer) => answer.boxes?.toReversed(),
    describe,
    none: ({ folder }) => `${folder} has no box: nothing has happened, or no black box runs (wormd record --black-box).`,
    download: true,
  });

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
