// The page: listens, draws, and gives commands when somebody presses a button. Loading it, or its connecting again, sends nothing.

import { Boxes } from "./boxes.js";
import { Charts } from "./charts.js";
import { byId, setText, show } from "./dom.js";
import { Driver } from "./drive.js";
import * as panels from "./panels.js";
import { loadReports } from "./reports.js";
import { Store } from "./store.js";
import { STALE_MS, Stream } from "./stream.js";
import { WormPicture } from "./worm.js";

/** How often what grows old is looked at, ms. */
const AGE_MS = 200;
/** How often tables and charts are drawn, ms; the worm is drawn with every frame. */
const SLOW_MS = 200;
/** How long a message stands, ms. */
const MESSAGE_MS = 8000;
/** What nobody can press while the server is silent: it would come too late, and be refused. */
const MOVING = ["arm", "crawl", "reset", "take_over", "trip_resume", "trip_return"];

const store = new Store();
const driver = new Driver(store, drawControls, () => stream.asked());
const picture = new WormPicture();
const charts = new Charts(store);
const boxes = new Boxes();
const stream = new Stream({
  hello: (hello) => {
    store.takeHello(hello);
    requestDrawing();
  },
  frame: (frame) => {
    store.takeFrame(frame);
    requestDrawing();
  },
  status: (status) => {
    store.takeStatus(status);
    drawOld();
  },
});

let isDrawingDue = false;
let hasDrawn = false;
let slowMs = -Infinity;

/** Draws with the next picture of the screen, once for all that came. */
function requestDrawing() {
  if (isDrawingDue) return;
  isDrawingDue = true;
  requestAnimationFrame(() => {
    isDrawingDue = false;
    draw();
  });
}

function draw() {
  if (!store.worm) return;
  panels.drawHead(store, driver);
  if (store.frame) picture.draw(store.worm, store.frame);
  if (store.frame && !hasDrawn) {
    hasDrawn = true;
    // For whoever measures how long the first picture takes.
    performance.mark("first-picture");
  }
  const nowMs = performance.now();
  if (store.frame && nowMs - slowMs >= SLOW_MS) {
    slowMs = nowMs;
    panels.drawValues(store);
    panels.drawCells(store);
    panels.drawAlarms(store, (alarm) => command("acknowledge", { alarms: [alarm] }));
    panels.drawCycles(store);
    panels.drawRange(store);
    panels.drawTrip(store, driver);
    panels.drawInferred(store);
    panels.drawTiming(store);
    panels.drawRecording(store);
    panels.drawEvents(store);
    boxes.note(store);
    charts.draw();
  }
  drawOld();
}

function drawOld() {
  const why = panels.staleness(store, stream);
  panels.drawAges(store, why);
  panels.drawTitle(store, why);
  for (const name of MOVING) byId(name).disabled = stream.silentMs() >= STALE_MS;
  boxes.drawAge();
}

function drawControls() {
  show(byId("drive"), driver.isLoggedIn);
  show(byId("log-in"), !driver.isLoggedIn);
}

let messageTimer = 0;

/** Says it where the buttons are; those of the log-in lie over the others. */
function say(text, isRefusal) {
  const messages = [byId("message"), byId("login-message")];
  for (const message of messages) {
    setText(message, text);
    message.classList.toggle("refused", isRefusal);
  }
  clearTimeout(messageTimer);
  messageTimer = setTimeout(() => messages.forEach((message) => setText(message, "")), MESSAGE_MS);
}

async function command(name, details = null) {
  if (name !== "hold" && !driver.isLoggedIn) {
    openLogin();
    return;
  }
  const answer = await driver.command(name, details);
  const what = name.replaceAll("_", " ");
  if (answer.ok) say(`${what}: ${answer.body.verdict}`, false);
  else say(`${what}: ${answer.text}`, true);
}

function openLogin() {
  setText(byId("login-error"), "");
  byId("who").value = driver.name;
  byId("login").showModal();
}

async function logIn(event) {
  event.preventDefault();
  const refusal = await driver.logIn(byId("token").value.trim(), byId("who").value);
  if (refusal) {
    setText(byId("login-error"), refusal);
    return;
  }
  byId("token").value = "";
  byId("login").close();
  say("logged in: nothing has moved yet", false);
}

for (const name of ["hold", "stop", "trip_pause", ...MOVING]) {
  byId(name).addEventListener("click", () => command(name));
}
// An open dialogue covers the page's own.
byId("login-hold").addEventListener("click", () => command("hold"));
byId("log-in").addEventListener("click", openLogin);
byId("log-out").addEventListener("click", () => driver.logOut());
byId("login-form").addEventListener("submit", logIn);
byId("login-cancel").addEventListener("click", () => byId("login").close());
byId("reports-again").addEventListener("click", loadReports);
byId("boxes-again").addEventListener("click", () => boxes.load());
document.addEventListener("keydown", (event) => {
  const isTyping = event.target instanceof HTMLInputElement || event.ctrlKey || event.metaKey || event.altKey;
  if (event.key === "h" && !isTyping && !event.repeat) command("hold");
});
// What is shown may be from before the page was hidden: its age says so at once.
document.addEventListener("visibilitychange", drawOld);

drawControls();
drawOld();
setInterval(drawOld, AGE_MS);
loadReports();
boxes.load();
