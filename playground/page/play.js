// Plays a plan: the car drives it in time, with its wheels.
"use strict";

const play = (() => {
  const button = document.getElementById("play-button");
  const slider = document.getElementById("play-time");
  const state = document.getElementById("play-state");
  const wheel = document.getElementById("wheel");
  const car = document.getElementById("moving");
  /** Turns of a steering wheel for one of the front wheels. */
  const GEARING = 15;
  let motion = null;
  let playing = false;
  let time = 0;
  let last = 0;

  /** The moment of a motion, between two of its samples. */
  function momentAt(t) {
    const { time: times, pose, steer, speed, gear } = motion;
    let [low, high] = [0, times.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t) low = middle;
      else high = middle;
    }
    const gap = times[high] - times[low];
    const share = gap > 0 ? Math.min(1, Math.max(0, (t - times[low]) / gap)) : 0;
    const [a, b] = [pose[low], pose[high]];
    return {
      pose: [lerp(a[0], b[0], share), lerp(a[1], b[1], share), lerpAngle(a[2], b[2], share)],
      steer: lerp(steer[low], steer[high], share),
      speed: lerp(speed[low], speed[high], share),
      gear: gear[low],
    };
  }

  function draw() {
    const { vehicle } = lot.scene;
    const { pose, steer, speed, gear } = momentAt(time);
    picture.svg.classList.add("playing");
    const standing = Math.abs(speed) < 0.01;
    picture.drawVehicle(car, vehicle, pose, `moving ${gear > 0 ? "forward" : "backward"}`, "");
    drawing.steer(car, steer);
    // Toward the left is counter-clockwise for whoever sits behind it.
    wheel.style.rotate = `${-steer * GEARING}rad`;
    const ended = time >= motion.duration_s - 1e-6;
    const doing = ended ? "parked" : standing ? "turns the wheels" : gear > 0 ? "forward" : "backward";
    state.textContent = `${time.toFixed(1)} s, ${doing}${standing ? "" : ` ${Math.abs(speed).toFixed(1)} m/s`}`;
    slider.value = time;
    slider.setAttribute("aria-valuetext", state.textContent);
  }

  function tick(now) {
    if (!playing) return;
    time = Math.min(motion.duration_s, time + Math.min(0.1, (now - last) / 1000));
    last = now;
    draw();
    if (time >= motion.duration_s) pause();
    else requestAnimationFrame(tick);
  }

  function start() {
    if (!motion || motion.duration_s === 0) return;
    if (time >= motion.duration_s - 1e-6) time = 0;
    playing = true;
    button.textContent = "❚❚ Pause";
    last = performance.now();
    requestAnimationFrame(tick);
  }

  function pause() {
    playing = false;
    button.textContent = "▶ Play";
  }

  button.addEventListener("click", () => (playing ? pause() : start()));
  slider.addEventListener("input", () => {
    if (!motion) return;
    pause();
    time = Number(slider.value);
    draw();
  });

  return {
    toggle: () => button.click(),
    /** Another motion to play, or none. */
    take(next) {
      pause();
      motion = next;
      time = 0;
      car.replaceChildren();
      picture.svg.classList.remove("playing");
      delete car.dataset.key;
      wheel.style.rotate = "";
      state.textContent = motion ? `${motion.duration_s.toFixed(1)} s` : "";
      slider.max = motion?.duration_s ?? 1;
      slider.value = 0;
      button.disabled = slider.disabled = !motion || motion.duration_s === 0;
    },
  };
})();
