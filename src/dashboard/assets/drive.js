// Commands. The page sends one when a button is pressed, and never by itself.
//
// While this page drives it says five times a second that it is there, as long as it is visible and what it shows is fresh: who cannot
// see the worm does not drive it. When it ceases to, for whatever reason, the worm holds within a second.
//
// Each request says when the button was pressed, so that none is done late: a line that was down brings what was pressed meanwhile when it
// is back. A hold is the last word: what this page asked for before it, and has no answer yet, is given up, and the server takes
// nothing any more that was pressed before it.
//
// The token stays in sessionStorage: it survives a reload and a switch of apps, ends with the tab, and no other page can make the browser
// send it, as it could a cookie. A page has a key of its own in memory, so that two tabs are two drivers.

import { STALE_MS } from "./stream.js";

const TOKEN = "wormd-token";
const NAME = "wormd-name";
/** How often the page says that it is there, ms, and how many of these requests may be on their way. */
const ALIVE_MS = 200;
const MAX_ALIVE = 2;
/** How long a request may take, ms. */
const PATIENCE_MS = 8000;
/** How long after a command of this page the relay may not yet name it as the driver, ms. */
const SETTLE_MS = 600;

export class Driver {
  #store;
  #key = newKey();
  #watcher = null;
  #commandedMs = -Infinity;
  #aliveOnWay = 0;
  #changed;
  #asked;
  /** What gives up the commands that have no answer yet. */
  #onWay = new Set();

  /** `changed` is called when somebody has logged in or out; `asked` says when something is asked for, in the server's time. */
  constructor(store, changed, asked) {
    this.#store = store;
    this.#changed = changed;
    this.#asked = asked;
    takeTokenOfAddress();
    setInterval(() => this.#sayAlive(), ALIVE_MS);
  }

  get isLoggedIn() {
    return sessionStorage.getItem(TOKEN) !== null;
  }

  get name() {
    return localStorage.getItem(NAME) ?? "";
  }

  /** Whether this page drives. */
  get drives() {
    return this.#watcher !== null && this.#store.frame?.driver?.watcher === this.#watcher;
  }

  /** Whether the worm crawls for as long as this page is heard. */
  get attends() {
    return this.drives && this.#store.frame.driver.attends;
  }

  /** Tries a token, and keeps it if it is right; otherwise says why not. */
  async logIn(token, name) {
    localStorage.setItem(NAME, name.trim());
    const answer = await this.#request("GET", "/api/login", null, token);
    if (!answer.ok) return answer.text;
    sessionStorage.setItem(TOKEN, token);
    this.#changed();
    return null;
  }

  logOut() {
    sessionStorage.removeItem(TOKEN);
    this.#watcher = null;
    this.#changed();
  }

  /** Gives a command; returns what came of it, in words. */
  async command(name, details = null) {
    const isAnyones = name === "hold";
    const token = isAnyones ? null : sessionStorage.getItem(TOKEN);
    const givenUp = new AbortController();
    if (isAnyones) this.#onWay.forEach((earlier) => earlier.abort(new Error("a hold came after it")));
    else this.#onWay.add(givenUp);
    const answer = await this.#request("POST", `/api/command/${name}`, details, token, givenUp);
    this.#onWay.delete(givenUp);
    const { watcher } = answer.body;
    if (!isAnyones && name !== "acknowledge" && watcher !== undefined && answer.ok) {
      this.#watcher = watcher;
      this.#commandedMs = performance.now();
    }
    if (answer.status === 401) this.logOut();
    return answer;
  }

  async #request(method, path, details, token, givenUp = new AbortController()) {
    const headers = { "X-Wormd-Client": this.#key, "X-Wormd-Name": encodeURIComponent(this.name) };
    const asked = this.#asked();
    if (asked) headers["X-Wormd-Asked"] = asked;
    if (token) headers.Authorization = `Bearer ${token}`;
    if (details) headers["Content-Type"] = "application/json";
    const patience = setTimeout(() => givenUp.abort(new Error(`no answer for ${PATIENCE_MS / 1000} s`)), PATIENCE_MS);
    try {
      const response = await fetch(path, {
        method,
        headers,
        body: details && JSON.stringify(details),
        cache: "no-store",
        priority: "high",
        signal: givenUp.signal,
      });
      const text = await response.text();
      const body = text.startsWith("{") ? JSON.parse(text) : {};
      return { ok: response.ok, status: response.status, body, text: body.refusal ?? body.error ?? body.verdict ?? text };
    } catch (error) {
      return { ok: false, status: 0, body: {}, text: `not sent: the server does not answer (${error.message})` };
    } finally {
      clearTimeout(patience);
    }
  }

  #sayAlive() {
    const isSettling = performance.now() - this.#commandedMs < SETTLE_MS;
    if (!this.drives && !(this.#watcher !== null && isSettling)) return;
    const isHidden = document.hidden || document.visibilityState === "hidden";
    const isOld = !((this.#store.ageMs("state") ?? Infinity) < STALE_MS);
    if (isHidden || isOld || !this.isLoggedIn || this.#aliveOnWay >= MAX_ALIVE) return;
    this.#aliveOnWay += 1;
    this.#request("POST", "/api/alive", null, sessionStorage.getItem(TOKEN)).finally(() => {
      this.#aliveOnWay -= 1;
    });
  }
}

/** A token behind the address (…/#token=…) is kept, and taken out of the address and the browser's history. */
function takeTokenOfAddress() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (!token) return;
  sessionStorage.setItem(TOKEN, token);
  history.replaceState(null, "", location.pathname);
}

function newKey() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}
