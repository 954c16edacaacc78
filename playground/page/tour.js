// How N3P works, in five steps, on the scene that is there.
"use strict";

const tour = (() => {
  const box = document.getElementById("tour");
  const attempts = document.getElementById("attempts");
  const title = document.getElementById("tour-title");
  const words = document.getElementById("tour-text");
  let step = 0;
  let timer = 0;
  let plan = null;
  let whenOpened = () => {};
  let compares = () => {};

  const m = (value) => `${value.toFixed(2)} m`;
  const drawLine = (poses, kind) => picture.element("path", { d: picture.line(poses), class: kind }, attempts);

  const STEPS = [
    {
      title: "The task",
      show: () => "Bring the car from Start to Goal without touching anything. It cannot move sideways, so the last metres are hard. "
        + "The usual planner, Hybrid A*, searches through thousands of small moves. N3P remembers instead. Drag anything while you read.",
    },
    {
      title: "See only what matters",
      show() {
        const spot = plan?.spot;
        if (!spot?.lane_and_spot) return "Here nothing looks like a spot beside a free lane, so N3P plans by search. Try one of the examples.";
        const { obstacles, points } = lot.scene;
        const corners = obstacles.flat().length + (points?.length ?? 0);
        return `${corners} corners and points become three numbers: how wide the lane is (yellow, ${m(spot.lane_width_m)}), how wide the spot is `
          + `(green, ${spot.spot_width_m === null ? "open" : m(spot.spot_width_m)}), and how far the lane goes on past it (${m(spot.dead_end_m)}). `
          + "Rounded down they name a cell. Both rectangles are free of obstacles, so whatever fits into the cell fits here.";
      },
    },
    {
      title: "Know where to begin",
      show() {
        if (!plan?.spot?.preparatory) return "For this scene N3P needs no preparatory pose: a curve leads straight to the goal, or a search was better.";
        return "For each cell N3P learned, offline, where to stand before the car parks: the preparatory pose (violet). "
          + "From there a known manoeuvre leads into the spot. What is left is easy: to drive to that pose.";
      },
    },
    { title: "Try what is known", show: tryAll },
    {
      title: "The path",
      show() {
        if (!plan?.path) return "There is no path here. Move something.";
        return `${sentence(plan.spot?.explanation ?? "a search")}: ${m(plan.length_m)} in ${duration(plan.plan_us)}. `
          + "Every path is checked exactly along the whole motion before it leaves the planner. Compare it with Hybrid A* on the same scene:";
      },
    },
  ];

  /** Plays the attempts, one after the other. */
  function tryAll() {
    const tried = plan?.tried ?? [];
    if (!tried.length) return "Nothing was tried here: no manoeuvres are known for this spot, or the car is already there.";
    const count = plan.tried_in_all;
    let i = 0;
    const next = () => {
      attempts.replaceChildren();
      for (const one of tried.slice(0, i)) drawLine(one.manoeuvre, "before");
      const one = tried[i];
      const kind = one.fate.replace(" ", "-");
      drawLine(one.manoeuvre, kind);
      if (one.curve) drawLine(one.curve, `${kind} curve`);
      const fate = { touches: "touches something", "not joined": "free, but no short free curve leads to it", joined: "free, and a free curve leads to it" }[one.fate];
      words.textContent = `The manoeuvres it knows, the most promising first. Each is checked exactly. Number ${i + 1} of ${count} tried: ${fate}. `
        + "The cheapest that is joined wins; only if none is, N3P searches.";
      i += 1;
      if (i < tried.length) timer = setTimeout(next, Math.max(40, Math.min(900, 8000 / tried.length)));
    };
    next();
    return words.textContent;
  }

  function render() {
    clearTimeout(timer);
    attempts.replaceChildren();
    picture.svg.dataset.tour = box.hidden ? "" : step;
    if (box.hidden) return;
    title.textContent = STEPS[step].title;
    words.textContent = STEPS[step].show();
    document.getElementById("tour-count").textContent = `${step + 1} of ${STEPS.length}`;
    document.getElementById("tour-back").disabled = step === 0;
    const last = step === STEPS.length - 1;
    document.getElementById("tour-next").textContent = last ? "Compare" : "Next";
  }

  function open() {
    box.hidden = false;
    step = 0;
    whenOpened();
    render();
    title.focus({ preventScroll: true });
  }

  function close() {
    box.hidden = true;
    render();
    document.getElementById("tour-open").focus({ preventScroll: true });
  }

  document.getElementById("tour-open").addEventListener("click", () => (box.hidden ? open() : close()));
  document.getElementById("tour-close").addEventListener("click", close);
  document.getElementById("tour-back").addEventListener("click", () => { step -= 1; render(); });
  document.getElementById("tour-next").addEventListener("click", () => {
    if (step < STEPS.length - 1) {
      step += 1;
      render();
    } else {
      close();
      compares();
    }
  });
  box.addEventListener("keydown", (event) => { if (event.key === "Escape") close(); });

  return {
    get open() { return !box.hidden; },
    /** Another plan of the scene; the step on show is told anew. */
    take(next) {
      plan = next;
      if (!box.hidden && (step !== 3 || next?.tried)) render();
    },
    whenOpened(listener) { whenOpened = listener; },
    whenComparing(listener) { compares = listener; },
  };
})();
