// A list of links that the server has, loaded when the page is and when somebody asks for it again.

import { byId, fillRows, make, setText } from "./dom.js";

/**
 * Fills the list `id` with what `url` answers: `entries(answer)` are its entries, `describe(entry)` is an entry's link as
 * `{ url, title, note }`, and `none(answer)` says why there are no entries. Returns the answer, or null where there was none.
 */
export async function loadListing(id, url, { entries, describe, none, download = false }) {
  let rows = [];
  let text = "";
  let answer = null;
  try {
    const response = await fetch(url, { cache: "no-store" });
    answer = await response.json();
    rows = (entries(answer) ?? []).map(describe);
    text = answer.error ?? (rows.length === 0 ? none(answer) : "");
  } catch {
    text = "The server does not answer.";
  }
  fillRows(
    byId(id),
    text ? [{ note: text }] : rows,
    () => make("li", "", make("a"), make("span", "note")),
    (row, entry) => {
      const [link, note] = row.children;
      link.hidden = !entry.url;
      if (entry.url) {
        link.href = entry.url;
        link.toggleAttribute("download", download);
        if (!download) {
          link.target = "_blank";
          link.rel = "noopener";
        }
      }
      setText(link, entry.title ?? "");
      setText(note, entry.note);
    },
  );
  return answer;
}

/** A wall-clock time of the server, s since 1970, as people read it here. */
export const localTime = (seconds) => new Date(seconds * 1000).toLocaleString();
