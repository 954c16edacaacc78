// From a point of a plot to its scene: by pointer, or by keys.
//
// The points of a path are where its parts begin; data-scenes says which scene of the gallery each is (marks.rs).
"use strict";
{
  const told = document.getElementById("point");
  const NEAR = 12;
  const NEAR_FINGER = 24;
  /** The plot that a point is told of, and that point. */
  let current = null;

  /** The method of a group, by its index in the gallery. */
  const methodOf = (group) => gallery.methods.indexOf(group.dataset.name);

  /** The points of a plot: where they are, and which scene and method. */
  function pointsOf(svg) {
    const points = [];
    for (const path of svg.querySelectorAll("[data-scenes]")) {
      const group = path.parentNode;
      const scenes = path.dataset.scenes.split(",");
      const starts = path.getAttribute("d").matchAll(/M([\d.-]+) ([\d.-]+)/g);
      let i = 0;
      for (const [, x, y] of starts) {
        const scene = scenes[i++];
        if (scene !== "") points.push({ x: Number(x), y: Number(y), scene: Number(scene), method: methodOf(group), group });
      }
    }
    return points;
  }

  const isShown = (point) => !point.group.classList.contains("faint");

  /** The point of a plot that is nearest to a point of the window, within some pixels. */
  function nearest(plot, event) {
    const matrix = plot.svg.getScreenCTM();
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
    let best = null;
    let least = (event.pointerType === "touch" ? NEAR_FINGER : NEAR) / matrix.a;
    for (const point of plot.points) {
      const far = Math.hypot(point.x - at.x, point.y - at.y);
      // Of two at the same place the one on top.
      if (far <= least && isShown(point)) [best, least] = [point, far];
    }
    return best;
  }

  function tell(plot, point) {
    current?.plot.ring.remove();
    current = point && { plot, point };
    plot.last = point ?? plot.last;
    told.hidden = !point;
    if (!point) return;
    plot.ring.setAttribute("cx", point.x);
    plot.ring.setAttribute("cy", point.y);
    plot.svg.append(plot.ring);
    const words = gallery.describe(point.scene, point.method);
    if (told.textContent !== words) told.textContent = words;
    const matrix = plot.svg.getScreenCTM();
    const { x, y } = new DOMPoint(point.x, point.y).matrixTransform(matrix);
    const [width, height] = [told.offsetWidth, told.offsetHeight];
    const left = Math.max(8, Math.min(document.documentElement.clientWidth - width - 8, x - width / 2));
    const top = y - height - 14 > 60 ? y - height - 14 : y + 14;
    told.style.translate = `${left}px ${top}px`;
  }

  const open = ({ scene, method }) => gallery.open(scene, method);

  /** Where a key leads from a point. */
  function step(plot, point, key) {
    const shown = plot.points.filter(isShown);
    const byX = (list) => list.sort((a, b) => a.x - b.x || a.scene - b.scene);
    const own = byX(shown.filter((p) => p.method === point.method));
    const last = own.length - 1;
    const place = own.indexOf(point);
    if (key === "ArrowLeft") return own[Math.max(0, place - 1)];
    if (key === "ArrowRight") return own[Math.min(last, place + 1)];
    if (key === "Home") return own[0];
    if (key === "End") return own[last];
    // Up and down: the same scene by another method.
    const methods = [...new Set(plot.points.filter(isShown).map((p) => p.method))];
    const other = methods[methods.indexOf(point.method) + (key === "ArrowUp" ? -1 : 1)];
    const theirs = shown.filter((p) => p.method === other);
    if (!theirs.length) return point;
    return theirs.find((p) => p.scene === point.scene)
      ?? theirs.reduce((a, b) => (Math.abs(b.x - point.x) < Math.abs(a.x - point.x) ? b : a));
  }

  function listen(svg) {
    const ring = drawing.element("circle", { class: "ring", r: 7 });
    const plot = { svg, ring, points: null, last: null };
    const ready = () => { plot.points ??= pointsOf(svg); };
    const title = svg.getAttribute("aria-label") ?? svg.querySelector("title").textContent;
    svg.setAttribute("tabindex", 0);
    svg.setAttribute("role", "application");
    svg.setAttribute("aria-label", `${title}. Arrows go from point to point, Enter shows the scene.`);
    svg.classList.add("pickable");
    svg.addEventListener("pointermove", (event) => {
      ready();
      const point = nearest(plot, event);
      if (point !== current?.point) tell(plot, point);
      svg.classList.toggle("on-point", Boolean(point));
    });
    svg.addEventListener("pointerleave", () => {
      if (current?.plot === plot) tell(plot, null);
    });
    svg.addEventListener("click", (event) => {
      ready();
      const point = nearest(plot, event);
      if (point) open(point);
    });
    /** Where keys begin: at the last point, or the first. */
    const begin = () => {
      ready();
      if (plot.last && isShown(plot.last)) return plot.last;
      const first = plot.points.find(isShown);
      return first && step(plot, first, "Home");
    };
    svg.addEventListener("focus", () => {
      // Whoever points has a point already.
      if (current?.plot !== plot) tell(plot, begin() ?? null);
    });
    svg.addEventListener("blur", () => {
      if (current?.plot === plot) tell(plot, null);
    });
    svg.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const point = current?.plot === plot ? current.point : begin();
      if (!point) return;
      if (["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End"].includes(event.key)) {
        tell(plot, current?.plot === plot ? step(plot, point, event.key) : point);
      } else if (event.key === "Enter" || event.key === " ") {
        open(point);
      } else if (event.key === "Escape") {
        tell(plot, null);
      } else {
        return;
      }
      event.preventDefault();
    });
  }

  /** One method alone, or all again. */
  function isolate(button) {
    const isOn = button.getAttribute("aria-pressed") === "true";
    for (const other of document.querySelectorAll("#point-methods button")) other.setAttribute("aria-pressed", !isOn && other === button);
    for (const group of document.querySelectorAll("#plot-points g[data-method]")) {
      group.classList.toggle("faint", !isOn && group.dataset.method !== button.value);
    }
  }

  if (gallery.methods.length) {
    for (const svg of document.querySelectorAll(".plot svg:has([data-scenes])")) listen(svg);
    for (const button of document.querySelectorAll("#point-methods button")) button.addEventListener("click", () => isolate(button));
    addEventListener("scroll", () => { if (current) tell(current.plot, current.point); }, { passive: true });
  }
}
