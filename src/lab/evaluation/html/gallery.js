// The gallery: scenes, and the paths in them, driven motion by motion.
//
// Data: see gallery.rs. World coordinates are metres, y up; the map's are metres from the
// view's upper left corner, y down.
"use strict";
{
  const data = JSON.parse(document.getElementById("data").textContent);
  const at = (id) => document.getElementById(id);
  const map = at("map");
  const FOOTPRINT_STEP = 0.8;
  const ZOOM = 15;

  // ---- Geometry -----------------------------------------------------------------------

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

  /** Where the driven car was after a share of its way. */
  function drivenAt({ poses, far }, share) {
    return (poses.find((p) => p.far >= share * far) ?? poses.at(-1)).pose;
  }

  const corner = ([x, y, heading], forward, left) => [
    x + forward * Math.cos(heading) - left * Math.sin(heading),
    y + forward * Math.sin(heading) + left * Math.cos(heading),
  ];

  function footprint(pose, v) {
    const [back, front, side] = [-v.rear_overhang, v.length - v.rear_overhang, v.width / 2];
    return [[back, -side], [front, -side], [front, side], [back, side]]
      .map(([f, l]) => corner(pose, f, l));
  }

  // ---- Drawing ------------------------------------------------------------------------

  function element(name, attributes, parent) {
    const e = document.createElementNS(map.namespaceURI, name);
    for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
    parent?.append(e);
    return e;
  }

  /** Map coordinates of a world point, to a tenth of a millimetre. */
  const local = (scene, [x, y]) => [x - scene.view[0], scene.view[3] - y].map((v) => +v.toFixed(4));
  const points = (scene, list) => list.map((p) => local(scene, p).join()).join(" ");

  /** The path data of one motion: an exact arc, in halves so that none exceeds a half turn. */
  function arc(scene, leg) {
    const halves = [0.5, 1].map((share) => drive(leg.pose, leg.curvature, leg.length * share));
    if (leg.curvature === 0) return `L${local(scene, halves[1])}`;
    const r = Math.abs(1 / leg.curvature);
    // Turning left on the map, whose y runs down, is against SVG's positive direction.
    const sweep = leg.curvature * leg.length > 0 ? 0 : 1;
    return halves.map((p) => `A${r} ${r} 0 0 ${sweep} ${local(scene, p)}`).join("");
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

  function drawWay(scene, way, layer, plain) {
    for (const run of strokes(way)) {
      const d = `M${local(scene, run[0].pose)}` + run.map((leg) => arc(scene, leg)).join("");
      element("path", { d, class: plain ? "other-way" : `way ${gearOf(run[0])}` }, layer);
    }
  }

  function drawChanges(scene, way, layer) {
    for (const run of strokes(way).slice(1)) {
      const [cx, cy] = local(scene, run[0].pose);
      element("circle", { cx, cy, r: 0.16, class: "change" }, layer);
    }
  }

  function drawFootprints(scene, way, vehicle, layer) {
    for (const leg of way.all) {
      const first = Math.ceil(leg.driven / FOOTPRINT_STEP) * FOOTPRINT_STEP - leg.driven;
      for (let s = first; s < Math.abs(leg.length); s += FOOTPRINT_STEP) {
        const pose = drive(leg.pose, leg.curvature, Math.sign(leg.length) * s);
        const shape = points(scene, footprint(pose, vehicle));
        element("polygon", { points: shape, class: `ghost ${gearOf(leg)}` }, layer);
      }
    }
  }

  /** An outline with an arrow along the heading. */
  function drawPose(scene, pose, vehicle, kind, layer) {
    element("polygon", { points: points(scene, footprint(pose, vehicle)), class: kind }, layer);
    const tip = vehicle.length - vehicle.rear_overhang - 0.4;
    const arrow = [corner(pose, tip - 0.7, 0.4), corner(pose, tip, 0), corner(pose, tip - 0.7, -0.4)];
    element("polyline", { points: points(scene, arrow), class: `${kind} arrow` }, layer);
  }

  /** The car in its own frame (rear axle at the origin, front to the right). */
  function drawCar(vehicle, layer) {
    const v = vehicle;
    const [back, front, side] = [-v.rear_overhang, v.length - v.rear_overhang, v.width / 2];
    const car = element("g", { class: "car" }, layer);
    const box = (x, y, width, height, rx, kind, parent = car) =>
      element("rect", { x, y, width, height, rx, class: kind }, parent);
    box(back, -side, v.length, v.width, 0.12, "body");
    const cabin = v.wheelbase * 0.62;
    element("path", { class: "glass", d: `M${cabin} ${-side * 0.8}L${cabin + 0.55} ${-side * 0.9}V${side * 0.9}L${cabin} ${side * 0.8}z` }, car);
    element("path", { class: "glass", d: `M${back + 0.95} ${-side * 0.78}L${back + 0.5} ${-side * 0.86}V${side * 0.86}L${back + 0.95} ${side * 0.78}z` }, car);
    for (const end of [-1, 1]) {
      box(back, end * side * 0.72 - 0.17, 0.16, 0.34, 0.05, "lamp tail");
      box(front - 0.16, end * side * 0.72 - 0.17, 0.16, 0.34, 0.05, "lamp head");
    }
    const wheel = [-0.32, -0.11, 0.64, 0.22, 0.06, "wheel"];
    car.front = [];
    for (const end of [-1, 1]) {
      box(...wheel, element("g", { transform: `translate(0 ${end * side * 0.8})` }, car));
      const holder = element("g", { transform: `translate(${v.wheelbase} ${end * side * 0.8})` }, car);
      car.front.push(element("g", {}, holder));
      box(...wheel, car.front.at(-1));
    }
    return car;
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
    map.replaceChildren(at("map-title"), at("map-text"));
    const layer = (name, ...kinds) => element("g", { "data-layer": name, class: kinds.join(" ") }, map);
    const ground = layer("ground");
    if (s.bounds) {
      const [x0, y0, x1, y1] = s.bounds;
      element("polygon", { points: points(s, [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]), class: "bounds" }, ground);
    }
    const regions = layer("regions");
    run?.regions?.forEach((r, i) => element("polygon", { points: points(s, r), class: i ? "spot" : "lane" }, regions));
    const obstacles = layer("obstacles");
    for (const o of s.obstacles) element("polygon", { points: points(s, o), class: "obstacle" }, obstacles);
    for (const o of s.lines) element("polyline", { points: points(s, o), class: "wall" }, obstacles);
    for (const o of s.borders) element("polygon", { points: points(s, o), class: "wall" }, obstacles);
    for (const p of s.points) {
      const [cx, cy] = local(s, p);
      element("circle", { cx, cy, r: 0.06, class: "point" }, obstacles);
    }
    const others = layer("others");
    for (const other of s.runs) {
      if (other !== run && other.start) drawWay(s, legs(other, vehicle), others, true);
    }
    const footprints = layer("footprints");
    drawPose(s, s.goal, vehicle, "goal", layer("goal"));
    const preparatory = layer("preparatory");
    if (run?.preparatory) drawPose(s, run.preparatory, vehicle, "preparatory", preparatory);
    const path = layer("path");
    const way = run?.start ? legs(run, vehicle) : null;
    if (way) {
      drawFootprints(s, way, vehicle, footprints);
      drawWay(s, way, path, false);
    }
    const driven = run ? drivenWay(run) : { poses: [] };
    const ghost = driven.poses.length ? element("polygon", { class: "driven" }, layer("path")) : null;
    if (ghost) {
      const track = points(s, driven.poses.map((p) => p.pose));
      element("polyline", { points: track, class: "driven" }, path);
    }
    const car = drawCar(vehicle, layer("car"));
    if (way) drawChanges(s, way, layer("path"));
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
      const [cx, cy] = local(shown.scene, shown.scene.goal);
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
    const [x, y] = local(s, pose);
    car.setAttribute("transform", `translate(${x} ${y}) rotate(${(-pose[2] * 180) / Math.PI})`);
    if (ghost) {
      const there = drivenAt(driven, (leg.driven + Math.abs(leg.length) * share) / way.driven);
      ghost.setAttribute("points", points(s, footprint(there, vehicle)));
    }
    const steer = leg ? Math.atan(vehicle.wheelbase * leg.curvature) : 0;
    for (const wheel of car.front) wheel.setAttribute("transform", `rotate(${(-steer * 180) / Math.PI})`);
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

  const unique = (list) => [...new Set(list)];
  const fill = (select, items) => select.replaceChildren(...items.map(([value, text]) => new Option(text, value)));
  const failures = (s) => s.runs.filter((r) => !r.ok && r.applies).length;

  /** The lists around the scene that is chosen. */
  function fillLists() {
    const s = scene();
    fill(at("kind"), unique(data.scenes.map((c) => c.type)).map((k) => [k, k]));
    at("kind").value = s.type;
    const levels = unique(data.scenes.filter((c) => c.type === s.type).map((c) => c.level));
    fill(at("level"), levels.map((l) => [l, l]));
    at("level").value = s.level;
    const scenes = [...data.scenes.entries()].filter(([, c]) => c.type === s.type && c.level === s.level);
    fill(at("scene"), scenes.map(([i, c]) => [i, failures(c) ? `${c.name} (${failures(c)} failed)` : c.name]));
    at("scene").value = state.scene;
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
        [run.length.toFixed(1), run.changes, run.clearance?.toFixed(3) ?? "–"].forEach((text) => cell(text));
      }
      const remark = cell(verdict(run), run.length !== null ? 1 : run.applies ? 4 : 6);
      remark.className = run.ok ? "text" : run.applies ? "text bad" : "text soft";
      tr.addEventListener("click", () => choose(state.scene, run.method));
      radio.addEventListener("change", () => choose(state.scene, run.method));
      return tr;
    };
    at("runs").tBodies[0].replaceChildren(...scene().runs.map(row));
  }

  function choose(sceneIndex, method) {
    const same = sceneIndex === state.scene && method === state.method && shown;
    if (same) return;
    play(false);
    const other = sceneIndex !== state.scene || !shown;
    Object.assign(state, { scene: sceneIndex, method });
    if (other) {
      fillLists();
      fillRuns();
    }
    draw();
    try {
      history.replaceState(null, "", `#play-${state.scene}-${state.method}`);
    } catch { /* some viewers of local files forbid it */ }
  }

  /** The first scene of a type and level, or of the type alone. */
  function jump(kind, level) {
    const of = (f) => data.scenes.findIndex(f);
    const exact = of((c) => c.type === kind && c.level === level);
    choose(exact >= 0 ? exact : of((c) => c.type === kind), state.method);
  }

  const step = (by) => choose((state.scene + by + data.scenes.length) % data.scenes.length, state.method);

  function zoom() {
    state.zoomed = !state.zoomed;
    showView();
  }

  /** Follows `#play-SCENE-METHOD` or `#play-SCENE-METHOD-SECONDS`. */
  function follow() {
    const [, s, m, t] = /^#play-(\d+)-(\d+)(?:-([\d.]+))?$/.exec(location.hash) ?? [];
    if (s === undefined || !data.scenes[s] || !data.methods[m]) return false;
    choose(Number(s), Number(m));
    seek(Number(t ?? 0));
    return true;
  }

  function listen() {
    at("kind").addEventListener("change", () => jump(at("kind").value, scene().level));
    at("level").addEventListener("change", () => jump(scene().type, at("level").value));
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
      if (follow()) at("gallery").scrollIntoView();
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

  // ---- Start --------------------------------------------------------------------------

  if (data.scenes.length) {
    document.querySelector(".viewer").hidden = false;
    listen();
    if (follow()) {
      at("gallery").scrollIntoView({ behavior: "instant" });
    } else {
      // At first a scene of the last, hardest setting, and our own method if it takes part.
      const last = data.scenes.at(-1);
      state.scene = data.scenes.findIndex((s) => s.type === last.type && s.level === last.level);
      const ours = data.methods.indexOf("n3p");
      state.method = ours >= 0 ? ours : data.methods.length - 1;
      fillLists();
      fillRuns();
      draw();
    }
  }
  document.documentElement.dataset.ready = data.scenes.length;
}
