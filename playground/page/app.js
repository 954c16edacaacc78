// Puts the parts together: what is chosen and changed goes to the planner, what it answers onto the page.
"use strict";

const $ = (id) => document.getElementById(id);
let catalogue = null;
/** Vehicles to choose from; the last may be one of a file. */
let vehicles = [];

/** A time in the unit that suits it. */
function duration(us) {
  if (us < 1000) return `${us < 10 ? us.toFixed(1) : Math.round(us)} µs`;
  return us < 1e6 ? `${(us / 1000).toFixed(us < 1e4 ? 1 : 0)} ms` : `${(us / 1e6).toFixed(1)} s`;
}

const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1);

const chosen = () => ({
  method: $("method").value,
  compare: $("compare").value,
  margin: Number($("margin").value),
  steering: $("steering").value,
});

/** What was wrong with a file or a link; said until something is changed. */
let notice = null;

function say(text, isError = true) {
  $("message").hidden = !text;
  $("message").textContent = sentence(text ?? "");
  $("message").classList.toggle("error", isError);
}

// Planning.

function request() {
  const { method, compare, margin, steering } = chosen();
  const still = !edit.dragging;
  return {
    plan: {
      scene: lot.scene,
      methods: compare ? [method, compare] : [method],
      wish: { margin, standstill_steering: steering, rounds: still ? 5 : 1, motion: still, explain: still && tour.open },
    },
  };
}

const REASONS = {
  "budget spent": "no path was found within 200,000 search steps",
  "no path at this resolution": "there is no way for a car of this size, as finely as was looked",
  "goal not reachable from the start": "the goal is walled off from the start",
  "not applicable": "this method is not made for such a spot",
};

const rate = { since: performance.now(), count: 0, total: 0, shown: 0 };

function show({ plans, error }, asked) {
  rate.count += 1;
  rate.total += 1;
  document.documentElement.dataset.plans = rate.total;
  if (error) {
    say(error.message);
    picture.show(null, wrongThings(error));
    numbers([]);
    play.take(null);
    tour.take(null);
    return;
  }
  const reason = plans[0].no_path;
  say(reason ? `No path by ${titleOf(plans[0].method)}: ${REASONS[reason] ?? reason}.` : notice);
  picture.show(plans, null);
  if (isNew) picture.fit();
  isNew = false;
  // Nobody reads sixty numbers a second.
  if (!edit.dragging || performance.now() - rate.shown > 90) {
    rate.shown = performance.now();
    numbers(plans);
  }
  tour.take(plans[0]);
  if (asked.plan.wish.motion) play.take(plans[0].motion ?? null);
  else play.take(null);
}

/** What an error is about, for the picture to mark: start or goal, and what it touches. */
function wrongThings({ field, touches }) {
  const things = [];
  const goal = /^goal(?:s\[(\d+)\])?$/.exec(field ?? "");
  if (goal) things.push({ what: "goal", index: Number(goal[1] ?? 0) });
  if (field === "start") things.push({ what: "start" });
  const obstacle = /^obstacles\[(\d+)\]$/.exec(touches ?? "");
  if (obstacle) things.push({ what: "obstacle", index: Number(obstacle[1]) });
  return things;
}

const titleOf = (name) => catalogue.methods.find((m) => m.name === name)?.title ?? name;

function numbers(plans) {
  const table = $("numbers");
  table.classList.toggle("two", $("compare").value !== "");
  [["a", plans[0], $("method").value], ["b", plans[1], $("compare").value]].forEach(([column, plan, method]) => {
    const put = (row, text) => {
      const cell = $(`${row}-${column}`);
      const words = String(text ?? "–");
      if (cell.textContent !== words) cell.textContent = words;
    };
    put("name", method ? titleOf(method) : "");
    const has = plan?.path;
    put("time", plan && duration(plan.plan_us));
    put("length", has && `${plan.length_m.toFixed(2)} m`);
    put("changes", has && plan.direction_changes);
    put("clearance", has && (plan.clearance_m === null ? "none there" : plan.clearance_m < 1 ? `${(plan.clearance_m * 100).toFixed(0)} cm` : `${plan.clearance_m.toFixed(1)} m`));
    put("steps", plan && plan.expansions.toLocaleString("en"));
    // Not told while something is dragged.
    if (!has || plan.motion) put("drive", has && `${plan.motion.duration_s.toFixed(1)} s`);
    put("route", plan && (has ? plan.spot?.explanation ?? "a search" : REASONS[plan.no_path] ?? plan.no_path));
  });
}

const follower = new Follower(request, show);

/** While cars are dragged: how many plans a second. */
function tell() {
  const now = performance.now();
  const perSecond = rate.count * 1000 / (now - rate.since);
  if (edit.dragging) $("about").textContent = `Planned ${Math.round(perSecond)} times a second, ${planner.where}.`;
  rate.since = now;
  rate.count = 0;
}

function follow() {
  $("undo").disabled = !lot.past.length;
  $("redo").disabled = !lot.future.length;
  follower.follow();
}

// Choosing.

function legend() {
  const two = $("compare").value !== "";
  const entries = two
    ? [["a", titleOf($("method").value)], ["b", titleOf($("compare").value)], ["dashed", "backward"]]
    : [["forward", "forward"], ["backward", "backward"], ["prepared", "preparatory pose"]];
  $("legend").replaceChildren(...entries.map(([kind, words]) => {
    const span = document.createElement("span");
    span.className = kind;
    span.textContent = words;
    return span;
  }));
}

function chosenWords() {
  const { margin } = chosen();
  $("margin-shown").textContent = margin < 0.01 ? "½ cm" : `${Math.round(margin * 100)} cm`;
  $("method-words").textContent = catalogue.methods.find((m) => m.name === $("method").value)?.words ?? "";
  legend();
}

function chose() {
  notice = null;
  chosenWords();
  follow();
}

function options(select, entries) {
  select.replaceChildren(...entries.map(([value, words]) => new Option(words, value)));
}

/** Whether the scene was put on the page just now: its plan is fitted into the picture. */
let isNew = false;

/** Puts a scene on the page. */
function put(scene, name = "") {
  notice = null;
  lot.replace(scene);
  edit.select(null);
  showVehicle();
  $("example").value = name;
  picture.show([], null);
  picture.fit();
  isNew = true;
  picture.drawScene();
  follow();
}

let shownVehicle = null;

function showVehicle() {
  const { vehicle } = lot.scene;
  if (vehicle === shownVehicle) return;
  shownVehicle = vehicle;
  const sizes = (v) => [v.length, v.width, v.wheelbase, v.rear_overhang, v.max_steer].map((n) => n.toFixed(3)).join();
  let at = vehicles.findIndex((v) => sizes(v.vehicle) === sizes(vehicle));
  if (at < 0) {
    vehicles = [...vehicles.filter((v) => v.name !== "Of the file"), { name: "Of the file", vehicle }];
    at = vehicles.length - 1;
  }
  options($("vehicle"), vehicles.map((v, i) => [i, `${v.name}, ${v.vehicle.length.toFixed(2)} × ${v.vehicle.width.toFixed(2)} m`]));
  $("vehicle").value = at;
}

/** Loads a map; of several files those that are images belong to the other. */
async function load(given) {
  const isImage = (file) => /\.(pgm|png)$/i.test(file.name);
  const list = [...given].sort((a, b) => isImage(a) - isImage(b));
  try {
    const held = await Promise.all(list.map(async (f) => ({ name: f.name, bytes: new Uint8Array(await f.arrayBuffer()) })));
    const [{ name, bytes }, ...others] = held;
    put(await files.read(name, bytes, others, lot.scene.vehicle));
  } catch (e) {
    say(notice = e.message);
  }
}

async function showLink() {
  try {
    const shown = await files.fromLink(location.hash);
    if (!shown) return false;
    for (const id of ["method", "compare", "margin", "steering"]) {
      const before = $(id).value;
      $(id).value = shown[id] ?? before;
      // What is not to be chosen stays as it was.
      if ($(id).value === "") $(id).value = before;
    }
    put(shown.scene);
    chose();
    return true;
  } catch (e) {
    say(notice = e.message);
    return false;
  }
}

async function copyLink() {
  try {
    const hash = await files.linked({ scene: lot.scene, ...chosen() });
    history.replaceState(null, "", hash);
    const link = location.href;
    const copied = await navigator.clipboard?.writeText(link).then(() => true, () => false);
    say(copied ? "The link is on the clipboard." : "The link is in the address bar.", false);
    setTimeout(() => { if (!$("message").classList.contains("error")) say(null); }, 4000);
  } catch (e) {
    say(e.message);
  }
}

async function savePath() {
  const asked = request();
  asked.plan.methods.length = 1;
  asked.plan.wish = { ...asked.plan.wish, explain: false, motion: false, file: true };
  const { plans, error } = await planner.ask(asked);
  if (error || !plans[0].path) return say(error?.message ?? "There is no path to save.");
  files.offer(`${lot.scene.name || "scene"}.${plans[0].method}.json`, `${JSON.stringify(plans[0].path)}\n`);
}

function listen() {
  const on = (id, event, does) => $(id).addEventListener(event, does);
  on("add-car", "click", edit.addCar);
  on("add-bounds", "click", edit.nextBound);
  on("add-wall", "click", () => edit.draw(!edit.drawing));
  on("turn-left", "click", () => edit.turn(Math.PI / 36));
  on("turn-right", "click", () => edit.turn(-Math.PI / 36));
  on("remove", "click", edit.remove);
  on("undo", "click", edit.undo);
  on("redo", "click", edit.redo);
  on("zoom-in", "click", () => picture.zoom(1.25));
  on("zoom-out", "click", () => picture.zoom(0.8));
  on("fit", "click", picture.fit);
  for (const id of ["method", "compare", "steering"]) on(id, "change", chose);
  on("margin", "input", chose);
  on("vehicle", "change", () => edit.commit(withVehicle(lot.scene, vehicles[$("vehicle").value].vehicle)));
  on("example", "change", () => {
    const example = catalogue.examples[$("example").value];
    if (example) put(example.scene, $("example").value);
  });
  on("load", "click", () => $("file").click());
  on("file", "change", () => {
    if ($("file").files[0]) load($("file").files);
    $("file").value = "";
  });
  on("save", "click", () => files.offer(`${lot.scene.name || "scene"}.json`, `${JSON.stringify(lot.scene)}\n`));
  on("save-path", "click", savePath);
  on("link", "click", copyLink);
  on("clear", "click", () => put(emptied(lot.scene)));
  window.addEventListener("dragover", (event) => event.preventDefault());
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    if (event.dataTransfer.files[0]) load(event.dataTransfer.files);
  });
  window.addEventListener("hashchange", showLink);
  document.addEventListener("keydown", keys);
  edit.whenChanged(() => {
    notice = null;
    $("example").value = "";
    showVehicle();
    picture.drawScene();
    follow();
  });
  tour.whenOpened(follow);
  tour.whenComparing(() => {
    $("compare").value = "ha";
    chose();
  });
}

/** Keys that mean the same wherever the focus is, but not where text or a choice is made. */
function keys(event) {
  if (event.target.closest("input, select, textarea, summary, a")) return;
  const key = event.key.toLowerCase();
  if (event.ctrlKey || event.metaKey) {
    if (key === "z" && !event.shiftKey) edit.undo();
    else if (key === "y" || (key === "z" && event.shiftKey)) edit.redo();
    else return;
  } else if (key === " " && !event.target.closest("button")) {
    play.toggle();
  } else if (key === "s" || key === "g") {
    (key === "s" ? $("start") : $("goals").firstChild).focus({ preventScroll: true });
  } else if (key === "c") {
    edit.addCar();
  } else if (key === "b") {
    edit.nextBound();
  } else if (key === "w") {
    edit.draw(true);
  } else if (key === "+" || key === "=") {
    picture.zoom(1.25);
  } else if (key === "-") {
    picture.zoom(0.8);
  } else if (key === "0") {
    picture.fit();
  } else {
    return;
  }
  event.preventDefault();
}

async function begin() {
  say("Getting the planner ready…", false);
  const answer = await planner.ask({ catalogue: {} });
  if (answer.error) return say(answer.error.message);
  catalogue = answer;
  vehicles = catalogue.vehicles;
  const methods = catalogue.methods.map((m) => [m.name, m.title]);
  options($("method"), methods);
  options($("compare"), [["", "nothing"], ...methods]);
  options($("example"), [["", "your own"], ...catalogue.examples.map((e, i) => [i, e.title])]);
  $("margin").value = 0.1;
  listen();
  say(null);
  chosenWords();
  if (!await showLink()) {
    const told = notice;
    put(catalogue.examples[0].scene, "0");
    notice = told;
  }
  $("about").textContent = `N3P ${catalogue.version}, planned ${planner.where}. Times are of this machine, one thread.`;
  setInterval(tell, 500);
  document.documentElement.dataset.ready = "";
}

begin();
