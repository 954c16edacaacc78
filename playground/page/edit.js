// Moving, turning, adding and deleting, by pointer and by key.
"use strict";

const edit = (() => {
  const { svg } = picture;
  /** Called after every change; `still` where nothing is being dragged any more. */
  let changed = () => {};
  let drawing = false;
  /** Pointers that are down, by their number: where in the window they are. */
  const pointers = new Map();
  /** What one pointer is doing: a function for its moves, and whether it changes the scene. */
  let doing = null;

  function commit(scene) {
    if (scene === lot.scene) return;
    lot.replace(scene);
    picture.drawScene();
    changed(true);
  }

  function select(thing, focus = false) {
    picture.select(thing);
    document.getElementById("remove").disabled = !canRemove();
    const turns = thing && thing.what !== "bound";
    for (const id of ["turn-left", "turn-right"]) document.getElementById(id).disabled = !turns;
    if (thing && focus) nodeOf(thing)?.focus({ preventScroll: true });
  }

  const nodeOf = (thing) => svg.querySelector(
    thing.what === "start" ? "#start" : `#${thing.what}s > :nth-child(${thing.index + 1})`);

  function thingOf(node) {
    const { what, index } = node.dataset;
    return what === "start" ? { what } : { what, index: Number(index) };
  }

  const canRemove = () => {
    const thing = picture.selected;
    return thing?.what === "obstacle" || thing?.what === "bound" || (thing?.what === "goal" && lot.scene.goals?.length > 1);
  };

  function remove() {
    if (!canRemove()) return;
    const scene = without(lot.scene, picture.selected);
    select(null);
    commit(scene);
    svg.focus({ preventScroll: true });
  }

  function addCar() {
    const { x, y } = picture.view;
    // A usual car, the size of the one that is planned for, along the picture's longer side.
    const { length, width } = lot.scene.vehicle;
    const [l, w] = [length * 0.46, width * 0.48];
    const points = [[-l, -w], [l, -w], [l, w], [-l, w]].map(([a, b]) => [x + a, y + b]);
    add(points);
  }

  function add(points) {
    const scene = { ...lot.scene, obstacles: [...lot.scene.obstacles, points] };
    lot.replace(scene);
    select({ what: "obstacle", index: scene.obstacles.length - 1 });
    picture.drawScene();
    changed(true);
    nodeOf(picture.selected).focus({ preventScroll: true });
  }

  /** Selects the next side of the bounds; where there are none they are added first. */
  function nextBound() {
    const { selected } = picture;
    const index = selected?.what === "bound" ? (selected.index + 1) % 4 : 0;
    if (!lot.scene.bounds) commit(withBounds(lot.scene));
    select({ what: "bound", index }, true);
  }

  function turn(angle) {
    if (picture.selected) commit(turned(lot.scene, picture.selected, angle));
  }

  function draw(on) {
    drawing = on;
    svg.classList.toggle("drawing", on);
    document.getElementById("add-wall").setAttribute("aria-pressed", on);
  }

  // What a press on the picture begins. Each gives a function for the moves that follow.

  function beginMove(thing, from) {
    const before = lot.scene;
    return (to) => moved(before, thing, [to[0] - from[0], to[1] - from[1]]);
  }

  function beginTurn(thing, from) {
    const before = lot.scene;
    const { centre } = picture.turningHandle(before, thing, 0);
    const angleTo = (p) => Math.atan2(p[1] - centre[1], p[0] - centre[0]);
    const first = angleTo(from);
    const heading = poseOf(before, thing)?.[2];
    return (to) => {
      const angle = angleTo(to) - first;
      // Cars come to rest in line with the axes.
      return turned(before, thing, heading === undefined ? angle : snapped(heading + angle, 0) - heading);
    };
  }

  function beginCorner(thing, corner) {
    const before = lot.scene;
    // Of the bounds two sides meet there.
    if (thing.what === "bound") {
      return (to) => withBound(withBound(before, thing.index, to[thing.index % 2]), corner, to[corner % 2]);
    }
    return (to) => withObstacle(before, thing.index, before.obstacles[thing.index].with(corner, to));
  }

  svg.addEventListener("pointerdown", (event) => {
    if (event.button > 0) return;
    picture.measure();
    pointers.set(event.pointerId, event);
    svg.setPointerCapture(event.pointerId);
    if (pointers.size > 1) {
      doing = null;
      return;
    }
    const from = picture.at(event);
    const handle = event.target.closest(".handle");
    const node = event.target.closest(".thing");
    if (drawing) {
      doing = { wall: from };
    } else if (handle) {
      const thing = picture.selected;
      const { handle: name, corner } = handle.dataset;
      doing = { change: name === "turn" ? beginTurn(thing, from) : beginCorner(thing, Number(corner)), before: lot.scene };
    } else if (node) {
      const thing = thingOf(node);
      select(thing, true);
      doing = { change: beginMove(thing, from), before: lot.scene };
    } else {
      doing = { pan: from, still: true };
    }
    event.preventDefault();
  });

  svg.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    if (pointers.size === 2) pinch(event);
    pointers.set(event.pointerId, event);
    if (!doing || pointers.size > 1) return;
    const to = picture.at(event);
    if (doing.wall) {
      picture.layer("new-wall").setAttribute("d", picture.line([doing.wall, to]));
    } else if (doing.change) {
      if (!doing.begun && Math.hypot(event.movementX, event.movementY) === 0) return;
      if (!doing.begun) lot.replace(doing.before);
      doing.begun = true;
      lot.adjust(doing.change(to));
      picture.drawScene();
      changed(false);
    } else if (doing.pan) {
      doing.still = false;
      picture.view.x += doing.pan[0] - to[0];
      picture.view.y += doing.pan[1] - to[1];
      picture.look();
    }
  });

  function end(event) {
    if (!pointers.delete(event.pointerId) || !doing) return;
    const done = doing;
    doing = null;
    if (done.wall) {
      picture.layer("new-wall").setAttribute("d", "");
      const to = picture.at(event);
      if (distance(done.wall, to) > 0.3) add([done.wall, to]);
      draw(false);
    } else if (done.begun) {
      changed(true);
    } else if (done.still) {
      select(null);
    }
  }
  svg.addEventListener("pointerup", end);
  svg.addEventListener("pointercancel", end);

  /** Two fingers: their middle stays on what it is on, their distance zooms. */
  function pinch(event) {
    const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
    const before = pointers.get(event.pointerId);
    const apart = (e) => Math.hypot(e.clientX - other.clientX, e.clientY - other.clientY);
    const middle = (e) => ({ clientX: (e.clientX + other.clientX) / 2, clientY: (e.clientY + other.clientY) / 2 });
    const held = picture.at(middle(before));
    const now = picture.at(middle(event));
    picture.view.x += held[0] - now[0];
    picture.view.y += held[1] - now[1];
    picture.zoom(apart(event) / Math.max(1, apart(before)), held);
  }

  svg.addEventListener("wheel", (event) => {
    event.preventDefault();
    picture.measure();
    picture.zoom(Math.exp(-event.deltaY * 0.0015), picture.at(event));
  }, { passive: false });

  svg.addEventListener("focusin", (event) => {
    const node = event.target.closest(".thing");
    if (node && !same(thingOf(node), picture.selected)) select(thingOf(node));
  });

  const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

  svg.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = ARROWS[event.key];
    const step = event.shiftKey ? 1 : 0.1;
    const angle = (event.shiftKey ? 15 : 2) * Math.PI / 180;
    if (arrow && picture.selected) {
      commit(moved(lot.scene, picture.selected, arrow.map((v) => v * step)));
    } else if ("qQ[{".includes(event.key)) {
      turn(angle);
    } else if ("eE]}".includes(event.key)) {
      turn(-angle);
    } else if (event.key === "Delete" || event.key === "Backspace") {
      remove();
    } else if (event.key === "Escape") {
      draw(false);
      select(null);
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  });

  return {
    addCar, nextBound, draw, remove, turn, select,
    get drawing() { return drawing; },
    get dragging() { return doing?.begun === true; },
    undo: () => { if (lot.undo()) { select(null); changed(true); } },
    redo: () => { if (lot.redo()) { select(null); changed(true); } },
    commit,
    whenChanged(listener) { changed = listener; },
  };
})();
