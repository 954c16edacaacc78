// Draws as SVG, in metres, y up: the same for the playground and for the gallery of report.html.
"use strict";

const drawing = (() => {
  const { namespaceURI } = document.querySelector("svg");
  const element = (name, attributes = {}, parent = null) => {
    const made = document.createElementNS(namespaceURI, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    parent?.append(made);
    return made;
  };

  /** Sets what is not so already: the browser draws anew whatever is set. */
  const set = (node, attributes) => {
    for (const [key, value] of Object.entries(attributes)) {
      if (node.getAttribute(key) !== String(value)) node.setAttribute(key, value);
    }
  };

  /** Points for a polygon or polyline. */
  const text = (points) => points.map(([x, y]) => `${+x.toFixed(4)},${+y.toFixed(4)}`).join(" ");
  /** A way through poses or points, as a path. */
  const line = (poses) => `M${poses.map(([x, y]) => `${+x.toFixed(3)} ${+y.toFixed(3)}`).join("L")}`;
  /** Chains of points as one path, each closed or not. */
  const chains = (lists, end = "") => lists.map((list) => `M${list.map(([x, y]) => `${x} ${y}`).join("L")}${end}`).join("");
  const dots = (points) => points.map(([x, y]) => `M${x} ${y}h0`).join("");
  const transform = ([x, y, turn]) => `translate(${x} ${y}) rotate(${turn * 180 / Math.PI})`;

  /** What stands in a scene besides its obstacles, as paths: walls, what only wheels keep off, the border of the
      drivable area, points. */
  function surroundings(scene) {
    const { obstacles: solids = [], polylines = [], points = [] } = scene.low ?? {};
    const area = scene.drivable_area;
    return {
      walls: chains(scene.polylines ?? []),
      low: chains(solids, "Z") + chains(polylines) + dots(points),
      area: area ? chains([area.outer, ...(area.holes ?? [])], "Z") : "",
      points: dots(scene.points ?? []),
    };
  }

  /** A car in its own frame: body, windscreen, lamps, wheels that can be steered, its name. */
  function drawCar(parent, vehicle, kind, name = "") {
    const { length, width, wheelbase, rear_overhang: back } = vehicle;
    parent.replaceChildren();
    parent.setAttribute("class", `car ${kind}`);
    const wheel = { width: length * 0.13, height: width * 0.14, class: "wheel" };
    for (const side of [-1, 1]) {
      for (const [axle, steered] of [[0, false], [wheelbase, true]]) {
        const at = element("g", { transform: `translate(${axle} ${side * width * 0.45})` }, parent);
        const turning = element("g", steered ? { class: "steered" } : {}, at);
        element("rect", { ...wheel, x: -wheel.width / 2, y: -wheel.height / 2 }, turning);
      }
    }
    element("rect", { class: "body", x: -back, y: -width / 2, width: length, height: width, rx: width * 0.16 }, parent);
    const [a, b] = [length * 0.62 - back, length * 0.74 - back];
    element("polygon", { class: "glass", points: text([[a, -width * 0.36], [b, -width * 0.42], [b, width * 0.42], [a, width * 0.36]]) }, parent);
    const lamp = { width: length * 0.035, height: width * 0.2 };
    for (const side of [-1, 1]) {
      const y = side * width * 0.34 - lamp.height / 2;
      element("rect", { ...lamp, class: "lamp tail", x: -back, y }, parent);
      element("rect", { ...lamp, class: "lamp head", x: length - back - lamp.width, y }, parent);
    }
    if (name) {
      const label = element("text", { class: "name", "font-size": Math.min(width * 0.36, length * 0.16) }, parent);
      label.textContent = name;
    }
  }

  /** Turns the front wheels of a drawn car; radians. */
  function steer(car, angle) {
    for (const wheel of car.querySelectorAll(".steered")) set(wheel, { transform: `rotate(${angle * 180 / Math.PI})` });
  }

  return { element, set, text, line, chains, dots, transform, surroundings, drawCar, steer };
})();
