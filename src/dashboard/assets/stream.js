// The stream of events from the server, and how old what it brought is.
//
// Ages are by monotonic clocks alone. The worm's computer says how old a value was when its frame was made. To that comes how long the
// frame was on its way: the clocks of both computers do not compare, but the quickest frame of the last half minute shows how they
// differ, and what a frame took longer than that one it was late. And to that comes the time since it arrived here, which grows also
// when the server, the network or the relay is dead.

/** After this time a value counts as old, ms. */
export const STALE_MS = 1000;
/** How long a connection may be silent before it is made anew, ms. The server says something every half second. */
const SILENCE_MS = 4000;
/** Pause before a new attempt, ms. */
const RETRY_MS = 500;
/** How long the quickest frame counts, ms: clocks drift, and a computer may sleep. */
const WINDOW_MS = 30000;
/** A hidden page gives its connection back after this time, ms: a browser has six for all its pages, and commands need one. */
const HIDDEN_MS = 10000;

/** How late a frame is, by the quickest one of late. */
export class Lateness {
  #quickest = [];

  /** Takes when a frame was made and when it arrived, ms of two clocks; gives how much later it is than the quickest. */
  of(madeMs, arrivedMs) {
    const offset = arrivedMs - madeMs;
    // A queue of minima: each entry is the smallest of all after the one before.
    while (this.#quickest.length > 0 && this.#quickest.at(-1).offset >= offset) this.#quickest.pop();
    this.#quickest.push({ offset, arrivedMs });
    while (arrivedMs - this.#quickest[0].arrivedMs > WINDOW_MS) this.#quickest.shift();
    return offset - this.#quickest[0].offset;
  }

  /** The clocks are other ones now. */
  reset() {
    this.#quickest = [];
  }
}

/** Listens to the server for as long as the page is there, and connects again by itself. Sends nothing. */
export class Stream {
  #handlers;
  #source = null;
  #heardMs = -Infinity;
  #triedMs = -Infinity;
  #newestId = "";
  #hiddenSinceMs = null;

  /** `handlers` has a function for each kind of event: hello, frame, status. */
  constructor(handlers) {
    this.#handlers = handlers;
    this.#connect();
    setInterval(() => this.#watch(), 250);
    document.addEventListener("visibilitychange", () => {
      this.#hiddenSinceMs = document.hidden ? performance.now() : null;
      this.#watch();
    });
  }

  /** How long the server has been silent, ms. */
  silentMs() {
    return performance.now() - this.#heardMs;
  }

  /** When something is asked for now, in the server's time: the newest event's number, and for how long it has been here. */
  asked() {
    return this.#newestId && `${this.#newestId}+${Math.round(this.silentMs())}`;
  }

  #connect() {
    this.#triedMs = performance.now();
    this.#source?.close();
    const source = new EventSource("/api/events");
    this.#source = source;
    for (const [kind, take] of Object.entries(this.#handlers)) {
      source.addEventListener(kind, (event) => {
        if (source !== this.#source) return;
        this.#heardMs = performance.now();
        this.#newestId = event.lastEventId;
        take(JSON.parse(event.data));
      });
    }
  }

  #watch() {
    const nowMs = performance.now();
    if (this.#hiddenSinceMs !== null && nowMs - this.#hiddenSinceMs > HIDDEN_MS) {
      this.#source?.close();
      this.#source = null;
      return;
    }
    if (document.hidden) return;
    const isClosed = this.#source === null || this.#source.readyState === EventSource.CLOSED;
    const isSilent = nowMs - Math.max(this.#heardMs, this.#triedMs) > SILENCE_MS;
    if ((isClosed && nowMs - this.#triedMs > RETRY_MS) || isSilent) this.#connect();
  }
}
