// The gallery: scenes, and the paths in them, driven motion by motion.
//
// Data: see gallery.rs. All is drawn in the scene's own frame, metres, y up. geometry.js and drawing.js are the
// playground's, too.
"use strict";

const gallery = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  // What is usual is left out of the data.
  const USUAL = { ok: true, applies: true, why: "", nodes: 0, length: null, changes: null, over: null, clearance: null, route: "", start: null, segments: [] };
  for (const s of data.scenes) s.runs = s.runs.map((run) => ({ ...USUAL, ...run }));
  const at = (id) => document.getElementById(id);
  const map = at("map");
  const { element } = drawing;
  const FOOTPRINT_STEP = 0.8;
  const ZOOM = 15;

  // ---- Motions ------------------------------------------------------------------------

  /** The pose after the signed length s of a motion: Segment::at of the planner. */
  function drive([x, y, heading], curvature, s) {
    const turn = curvature * s;
    const [forward, left] = Math.abs(turn) > 1e-6
      ? [Math.sin(turn) / curvature, (1 - Math.cos(turn)) / curvature]
      : [s * (1 - turn * turn / 6), s * turn / 2];
    const [sin, cos] = [Math.sin(heading), Math.cos(heading)];
    return [x + forward * cos - left * sin, y + forward * sin + left * cos, heading + turn];
  }

  /** The motions of a run, each with where and when it begins. */
  function legs(run, vehicle) {
    const all = [];
    let [pose, time, driven] = [run.start, 0, 0];
    for (const [curvature, length] of run.segments) {
      const speed = length < 0 ? vehicle.backward_speed : vehicle.forward_speed;
      const duration = Math.abs(length) / speed;
      all.push({ pose, curvature, length, time, duration, driven, speed });
      pose = drive(pose, curvature, length);
      time += duration;
      driven += Math.abs(length);
    }
    return { all, end: pose, time, driven };
  }

  /** Where the car is at `time`, and the motion it is in. */
  function poseAt(way, time) {
    const leg = way.all.findLast((l) => l.time <= time) ?? way.all[0];
    const share = leg.duration > 0 ? Math.min(1, (time - leg.time) / leg.duration) : 1;
    return { leg, share, pose: drive(leg.pose, leg.curvature, leg.length * share) };
  }

  /** What was driven: its poses, each with how far the car had come. */
  function drivenWay(run) {
    let far = 0;
    const poses = (run.driven ?? []).map((pose, i, all) => {
      if (i) far += Math.hypot(pose[0] - all[i - 1][0], pose[1] - all[i - 1][1]);
      return { pose, far };
    });
    return { poses, far };
  }

  /** Where the driven car was after a share of its way: between two poses, of which only few are kept. */
  function drivenAt({ poses, far }, share) {
    const next = Math.max(1, poses.findIndex((p) => p.far >= share * far));
    const [a, b] = [poses[next - 1], poses[next] ?? poses[next - 1]];
    const part = b.far > a.far ? Math.min(1, (share * far - a.far) / (b.far - a.far)) : 1;
    return [lerp(a.pose[0], b.pose[0], part), lerp(a.pose[1], b.pose[1], part), lerpAngle(a.pose[2], b.pose[2], part)];
  }

  // ---- Drawing ------------------------------------------------------------------------

  /** The path data of one motion: an exact arc, in halves so that none exceeds a half turn. */
  function arc(leg) {
    const halves = [0.5, 1].map((share) => drive(leg.pose, leg.curvature, leg.length * share));
    const to = ([x, y]) => `${+x.toFixed(4)} ${+y.toFixed(4)}`;
    if (leg.curvature === 0) return `L${to(halves[1])}`;
    const r = +Math.abs(1 / leg.curvature).toFixed(6);
    const sweep = leg.curvature * leg.length > 0 ? 1 : 0;
    return halves.map((p) => `A${r} ${r} 0 0 ${sweep} ${to(p)}`).join("");
  }

  const gearOf = (leg) => (leg.length < 0 ? "backward" : "forward");

  /** Runs of motions in one gear. */
  function strokes(way) {
    const runs = [];
    for (const leg of way.all) {
      if (runs.length && gearOf(runs.at(-1)[0]) === gearOf(leg)) runs.at(-1).push(leg);
      else runs.push([leg]);
    }
    return runs;
  }

  function drawWay(way, layer, plain) {
    for (const run of strokes(way)) {
      const d = drawing.line([run[0].pose]) + run.map(arc).join("");
      element("path", { d, class: plain ? "other-way" : `way ${gearOf(run[0])}` }, layer);
    }
  }

  function drawChanges(way, layer) {
    for (const run of strokes(way).slice(1)) {
      const [cx, cy] = run[0].pose;
      element("circle", { cx, cy, r: 0.16, class: "change" }, layer);
    }
  }

  function drawFootprints(way, vehicle, layer) {
    for (const leg of way.all) {
      const first = Math.ceil(leg.driven / FOOTPRINT_STEP) * FOOTPRINT_STEP - leg.driven;
      for (let s = first; s < Math.abs(leg.length); s += FOOTPRINT_STEP) {
        const pose = drive(leg.pose, leg.curvature, Math.sign(leg.length) * s);
        const shape = drawing.text(footprint(vehicle, pose));
        element("polygon", { points: shape, class: `ghost ${gearOf(leg)}` }, layer);
      }
    }
  }

  /** An outline with an arrow along the heading. */
  function drawPose(pose, vehicle, kind, layer) {
    element("polygon", { points: drawing.text(footprint(vehicle, pose)), class: kind }, layer);
    const tip = vehicle.length - vehicle.rear_overhang - 0.4;
    const arrow = [[tip - 0.7, 0.4], [tip, 0], [tip - 0.7, -0.4]].map((p) => outOf(pose, p));
    element("polyline", { points: drawing.text(arrow), class: `${kind} arrow` }, layer);
  }

  // ---- State --------------------------------------------------------------------------

  const state = { scene: 0, method: 0, time: 0, playing: false, zoomed: false };
  let shown = null; // { scene, run, vehicle, way, car, layers }

  const scene = () => data.scenes[state.scene];
  const figures = (v) => (v >= 100 ? v.toFixed(0) : v.toPrecision(3));
  const time = (s) => (s < 1e-3 ? `${figures(s * 1e6)} µs` : s < 1 ? `${figures(s * 1e3)} ms` : `${figures(s)} s`);
  const verdict = (run) => (!run.applies ? "not applicable" : run.ok ? run.route || "–" : `✕ ${run.why}`);

  function draw() {
    const s = scene();
    const vehicle = data.vehicles[s.vehicle];
    const run = s.runs.find((r) => r.method === state.method) ?? s.runs[0];
    // The map's own y runs down from the view's upper left corner.
    const [left, , , top] = s.view;
    const world = at("world");
    world.setAttribute("transform", `scale(1 -1) translate(${-left} ${-top})`);
    world.replaceChildren();
    const layer = (name) => element("g", { "data-layer": name }, world);
    const ground = layer("ground");
    if (s.bounds) {
      const [x, y, right, upper] = s.bounds;
      element("rect", { x, y, width: right - x, height: upper - y, class: "bounds" }, ground);
    }
    const regions = layer("regions");
    run?.regions?.forEach((r, i) => element("polygon", { points: drawing.text(r), class: i ? "spot" : "lane" }, regions));
    const obstacles = layer("obstacles");
    for (const o of s.obstacles ?? []) element("polygon", { points: drawing.text(o), class: "obstacle" }, obstacles);
    for (const [kind, d] of Object.entries(drawing.surroundings(s))) {
      if (d) element("path", { d, class: kind }, obstacles);
    }
    const others = layer("others");
    for (const other of s.runs) {
      if (other !== run && other.start) drawWay(legs(other, vehicle), others, true);
    }
    const footprints = layer("footprints");
    drawPose(s.goal, vehicle, "goal", layer("goal"));
    const preparatory = layer("preparatory");
    if (run?.preparatory) drawPose(run.preparatory, vehicle, "preparatory", preparatory);
    const path = layer("path");
    const way = run?.start ? legs(run, vehicle) : null;
    if (way) {
      drawFootprints(way, vehicle, footprints);
      drawWay(way, path, false);
    }
    const driven = run ? drivenWay(run) : { poses: [] };
    const ghost = driven.poses.length ? element("polygon", { class: "driven" }, layer("path")) : null;
    if (ghost) {
      const track = drawing.text(driven.poses.map((p) => p.pose));
      element("polyline", { points: track, class: "driven" }, path);
    }
    const car = layer("car");
    drawing.drawCar(car, vehicle, "moving");
    if (way) drawChanges(way, layer("path"));
    shown = { scene: s, run, vehicle, way, car, driven, ghost };
    showLayers();
    showView();
    showRun();
    seek(0);
  }

  function showLayers() {
    for (const name of ["path", "footprints", "regions", "preparatory", "others"]) {
      for (const g of map.querySelectorAll(`[data-layer="${name}"]`)) {
        g.classList.toggle("off", !at(`show-${name}`).checked);
      }
    }
  }

  function showView() {
    const [x0, y0, x1, y1] = shown.scene.view;
    let [x, y, w, h] = [0, 0, x1 - x0, y1 - y0];
    map.style.aspectRatio = `${w} / ${h}`;
    if (state.zoomed) {
      const scale = Math.min(1, ZOOM / w, ZOOM / h * 1.6);
      const { goal } = shown.scene;
      const [cx, cy] = [goal[0] - x0, y1 - goal[1]];
      const inside = (v, size, limit) => Math.max(0, Math.min(limit - size, v - size / 2));
      [x, y, w, h] = [inside(cx, w * scale, w), inside(cy, h * scale, h), w * scale, h * scale];
    }
    map.setAttribute("viewBox", [x, y, w, h].map((v) => v.toFixed(3)).join(" "));
    at("zoom").setAttribute("aria-pressed", state.zoomed);
  }

  /** What does not change while the car drives. */
  function showRun() {
    const { run, way, scene: s } = shown;
    const name = run ? data.methods[run.method] : "no method";
    at("map-title").textContent = `${s.name}, ${name}`;
    at("map-text").textContent = way
      ? `${way.driven.toFixed(1)} m, ${run.changes} direction changes${run.ok ? "" : `, ${verdict(run)}`}`
      : `No path: ${run ? verdict(run) : "no rows"}`;
    const problem = !run?.ok;
    at("verdict").hidden = !problem;
    at("verdict").textContent = problem ? at("map-text").textContent.replace(/^.*✕ /, "") : "";
    const ready = way !== null && way.time > 0;
    for (const id of ["play", "time"]) at(id).disabled = !ready;
    at("time").max = ready ? way.time : 1;
    const stops = !ready ? [] : way.all.map((leg) => {
      const share = (t) => `${((100 * t) / way.time).toFixed(2)}%`;
      return `var(--${gearOf(leg)}) ${share(leg.time)} ${share(leg.time + leg.duration)}`;
    });
    at("gears").style.background = ready ? `linear-gradient(90deg, ${stops})` : "";
    for (const row of at("runs").tBodies[0].rows) {
      const chosen = Number(row.dataset.method) === run?.method;
      row.classList.toggle("chosen", chosen);
      row.querySelector("input").checked = chosen;
    }
  }

  /** Puts the car where it is at `t` seconds. */
  function seek(t) {
    const { way, vehicle, car, scene: s, driven, ghost } = shown;
    state.time = way ? Math.max(0, Math.min(way.time, t)) : 0;
    const { pose, leg, share } = way?.all.length
      ? poseAt(way, state.time)
      : { pose: s.start, leg: null, share: 0 };
    car.setAttribute("transform", drawing.transform(pose));
    if (ghost) {
      const there = drivenAt(driven, (leg.driven + Math.abs(leg.length) * share) / way.driven);
      ghost.setAttribute("points", drawing.text(footprint(vehicle, there)));
    }
    const steer = leg ? Math.atan(vehicle.wheelbase * leg.curvature) : 0;
    drawing.steer(car, steer);
    const moving = state.playing || state.time > 0;
    car.classList.toggle("reversing", Boolean(leg) && moving && leg.length < 0);
    car.classList.toggle("advancing", Boolean(leg) && moving && leg.length > 0);
    at("gear").textContent = leg ? gearOf(leg) : "";
    at("driven").textContent = leg ? `${(leg.driven + Math.abs(leg.length) * share).toFixed(1)} m` : "";
    at("steering").textContent = leg ? `steer ${((steer * 180) / Math.PI).toFixed(1)}°`.replace("-", "−") : "";
    at("time").value = state.time;
    at("time").setAttribute("aria-valuetext", leg ? `${state.time.toFixed(1)} seconds, ${gearOf(leg)}` : "no path");
    at("clock").textContent = way ? `${state.time.toFixed(1)} / ${way.time.toFixed(1)} s` : "–";
  }

  // ---- Playing ------------------------------------------------------------------------

  let last = 0;
  function frame(now) {
    if (!state.playing) return;
    const t = state.time + ((now - last) / 1000) * Number(at("rate").value);
    last = now;
    seek(t);
    if (state.time >= shown.way.time) play(false);
    else requestAnimationFrame(frame);
  }

  function play(on) {
    if (on === state.playing || (on && !shown.way?.time)) return;
    state.playing = on;
    at("play").setAttribute("aria-label", on ? "Pause" : "Play");
    at("play").querySelector("path").setAttribute("d", on ? "M6 4h4v16H6zM14 4h4v16h-4z" : "M7 4v16l13-8z");
    if (!on) return;
    if (state.time >= shown.way.time) seek(0);
    last = performance.now();
    requestAnimationFrame(frame);
  }

  // ---- Choosing -----------------------------------------------------------------------

  const failures = (s) => s.runs.filter((r) => !r.ok && r.applies).length;
  const count = (n, what) => `${n} ${what}${n === 1 ? "" : "s"}`;
  const ratio = (over) => `${over.toFixed(over < 1.1 ? 3 : 2)} ×`;

  /** In what order scenes are listed: by the chosen method, those with the greatest value first, and what is said of
      them. Where the value is null they come last. */
  const ORDERS = {
    run: { title: "as they were run", by: () => 0, say: (r, s) => (failures(s) ? `${failures(s)} failed` : "") },
    quality: { title: "worst quality first", by: (r) => r?.over, say: (r) => ratio(r.over) },
    slowest: { title: "slowest first", by: (r) => r?.applies ? r.time : null, say: (r) => time(r.time) },
    changes: { title: "most changes first", by: (r) => r?.changes, say: (r) => count(r.changes, "change") },
    clearance: {
      title: "least clearance first",
      by: (r) => (r?.clearance == null ? null : -r.clearance),
      say: (r) => `${r.clearance.toFixed(3)} m`,
    },
    // Those of the chosen method before those of others.
    failures: {
      title: "failures first",
      by: (r, s) => (r && !r.ok && r.applies ? data.methods.length : 0) + failures(s),
      say: (r, s) => (failures(s) ? `${failures(s)} failed` : ""),
    },
  };

  const runOf = (s, method) => s.runs.find((r) => r.method === method);

  /** The scenes that the filter leaves, in order. */
  function listed() {
    const { by } = ORDERS[at("order").value];
    const left = [...data.scenes.keys()].filter((i) => filter.holds(data.scenes[i]));
    const value = new Map(left.map((i) => [i, by(runOf(data.scenes[i], state.method), data.scenes[i]) ?? -Infinity]));
    return left.sort((a, b) => (value.get(b) > value.get(a)) - (value.get(b) < value.get(a)) || a - b);
  }

  let list = [];

  /** Lists the scenes anew, after another method, order or filter was chosen. */
  function fillList() {
    const { by, say } = ORDERS[at("order").value];
    list = listed();
    const option = (i) => {
      const s = data.scenes[i];
      const run = runOf(s, state.method);
      const words = by(run, s) == null ? "" : say(run, s);
      return new Option(words ? `${s.name} · ${words}` : s.name, i);
    };
    at("scene").replaceChildren(...list.map(option));
    at("scene").value = state.scene;
    at("scene-label").textContent = `Scene (${list.length})`;
  }

  function fillRuns() {
    const row = (run) => {
      const tr = document.createElement("tr");
      tr.dataset.method = run.method;
      const head = document.createElement("th");
      head.scope = "row";
      const label = document.createElement("label");
      const radio = Object.assign(document.createElement("input"), { type: "radio", name: "run", value: run.method });
      label.append(radio, data.methods[run.method]);
      head.append(label);
      tr.append(head);
      const cell = (text, span = 1) => Object.assign(tr.insertCell(), { textContent: text, colSpan: span });
      if (run.applies) [time(run.time), run.nodes].forEach((text) => cell(text));
      if (run.length !== null) {
        const over = run.over === null ? "–" : run.over.toFixed(3);
        [run.length.toFixed(1), run.changes, over, run.clearance?.toFixed(3) ?? "–"].forEach((text) => cell(text));
      }
      const remark = cell(verdict(run), run.length !== null ? 1 : run.applies ? 5 : 7);
      remark.className = run.ok ? "text" : run.applies ? "text bad" : "text soft";
      tr.addEventListener("click", () => choose(state.scene, run.method));
      radio.addEventListener("change", () => choose(state.scene, run.method));
      return tr;
    };
    at("runs").tBodies[0].replaceChildren(...scene().runs.map(row));
  }

  function choose(sceneIndex, method, silent = false) {
    const same = sceneIndex === state.scene && method === state.method && shown;
    if (same) return;
    play(false);
    const isOther = sceneIndex !== state.scene || !shown;
    const isOtherMethod = method !== state.method || !shown;
    Object.assign(state, { scene: sceneIndex, method });
    if (isOtherMethod) fillList();
    at("scene").value = sceneIndex;
    if (isOther) fillRuns();
    draw();
    if (silent) return;
    try {
      history.replaceState(null, "", link());
    } catch { /* some viewers of local files forbid it */ }
  }

  const link = () => `#play-${state.scene}-${state.method}`;

  /** The next scene of the list. */
  function step(by) {
    const place = list.indexOf(state.scene);
    choose(list[(place + by + list.length) % list.length], state.method);
  }

  /** Another list, and its first scene unless the one that is shown is to stay. */
  function relist(staysIfListed) {
    fillList();
    if (!list.length || (staysIfListed && list.includes(state.scene))) return;
    choose(list[0], state.method);
  }

  /** Shows a scene and a method, whatever the filter is, and leads there. */
  function open(sceneIndex, method) {
    try {
      // A page of its own in the history: going back leads back to the plot.
      history.pushState(null, "", `#play-${sceneIndex}-${method}`);
    } catch { /* see above */ }
    show(sceneIndex, method);
    goThere();
  }

  function goThere() {
    at("gallery").scrollIntoView();
    at("scene").focus({ preventScroll: true });
  }

  async function copy() {
    try {
      history.replaceState(null, "", link());
    } catch { /* see above */ }
    const copied = await navigator.clipboard?.writeText(new URL(link(), location.href).href).then(() => true, () => false);
    at("copy").textContent = copied ? "Copied" : "It is in the address bar";
    setTimeout(() => { at("copy").textContent = "Copy link"; }, 2500);
  }

  function zoom() {
    state.zoomed = !state.zoomed;
    showView();
  }

  /** Shows a scene, also one that the filter hides. */
  function show(sceneIndex, method) {
    if (!filter.holds(data.scenes[sceneIndex])) filter.clear();
    choose(sceneIndex, method);
  }

  /** Follows `#play-SCENE-METHOD` or `#play-SCENE-METHOD-SECONDS`. */
  function follow() {
    const [, s, m, t] = /^#play-(\d+)-(\d+)(?:-([\d.]+))?$/.exec(location.hash) ?? [];
    if (s === undefined || !data.scenes[s] || !data.methods[m]) return false;
    show(Number(s), Number(m));
    seek(Number(t ?? 0));
    return true;
  }

  function listen() {
    at("order").addEventListener("change", () => relist(false));
    filter.whenChanged(() => relist(true));
    at("copy").addEventListener("click", copy);
    at("scene").addEventListener("change", () => choose(Number(at("scene").value), state.method));
    at("previous").addEventListener("click", () => step(-1));
    at("next").addEventListener("click", () => step(1));
    at("play").addEventListener("click", () => play(!state.playing));
    at("time").addEventListener("input", () => {
      play(false);
      seek(Number(at("time").value));
    });
    at("zoom").addEventListener("click", zoom);
    document.querySelector(".layers").addEventListener("change", showLayers);
    addEventListener("hashchange", () => {
      if (follow()) goThere();
    });
    at("gallery").addEventListener("keydown", (event) => {
      const target = event.target;
      const typing = target.matches("select, input[type=radio], input[type=checkbox], summary");
      if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
      const keys = {
        " ": () => play(!state.playing),
        ArrowLeft: () => { play(false); seek(state.time - 0.25); },
        ArrowRight: () => { play(false); seek(state.time + 0.25); },
        n: () => step(1),
        p: () => step(-1),
        z: zoom,
      };
      if (!keys[event.key] || (event.key === " " && target.matches("button"))) return;
      event.preventDefault();
      keys[event.key]();
    });
  }

  /** A scene and what a method did there, in a line. */
  function describe(sceneIndex, method) {
    const s = data.scenes[sceneIndex];
    const run = runOf(s, method);
    const facts = [s.name, data.methods[method], time(run.time)];
    if (run.ok) facts.push(`cost ${ratio(run.over ?? 1)}`, count(run.changes, "change"));
    else facts.push(verdict(run));
    if (run.clearance !== null) facts.push(`${run.clearance.toFixed(3)} m clear`);
    return facts.join(" · ");
  }

  // ---- Start --------------------------------------------------------------------------

  at("order").replaceChildren(...Object.entries(ORDERS).map(([name, { title }]) => new Option(title, name)));
  if (data.scenes.length) {
    document.querySelector(".viewer").hidden = false;
    listen();
    if (follow()) {
      at("gallery").scrollIntoView({ behavior: "instant" });
    } else {
      // At first a scene of the last, hardest setting, and our own method if it takes part.
      const last = data.scenes.at(-1);
      const ours = data.methods.indexOf("n3p");
      const first = data.scenes.findIndex((s) => s.world === last.world && s.type === last.type && s.level === last.level);
      choose(filter.holds(data.scenes[first]) ? first : listed()[0], ours >= 0 ? ours : data.methods.length - 1, true);
    }
  }
  document.documentElement.dataset.ready = data.scenes.length;

  return { methods: data.scenes.length ? data.methods : [], open, describe };
})();
