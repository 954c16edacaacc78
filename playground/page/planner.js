// Asks the planner: in this browser where the page has it inside, else the server that the page is from.
"use strict";

const planner = (() => {
  const inside = document.getElementById("planner-inside");
  let send;
  if (inside) {
    const code = document.getElementById("worker-inside").textContent;
    const worker = new Worker(URL.createObjectURL(new Blob([code], { type: "text/javascript" })));
    const waiting = new Map();
    let last = 0;
    let broken = null;
    worker.onmessage = ({ data }) => {
      if (data.failed) {
        broken = data.failed;
        for (const done of waiting.values()) done(failure(broken));
        return;
      }
      if (data.ready) return;
      waiting.get(data.id)?.(data.answer);
      waiting.delete(data.id);
    };
    worker.postMessage({ planner: inside.textContent.trim() });
    inside.remove();
    send = (request) => new Promise((done) => {
      if (broken) return done(failure(broken));
      last += 1;
      waiting.set(last, done);
      worker.postMessage({ id: last, request });
    });
  } else {
    const post = (request) => fetch("/answer", {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: request,
    });
    send = async (request) => {
      try {
        // A connection that was idle for long is closed; a second try opens another.
        const answer = await post(request).catch(() => post(request));
        const text = await answer.text();
        return answer.ok ? text : failure(text.trim());
      } catch {
        return failure("the server does not answer; is n3p-play still running?");
      }
    };
  }
  const failure = (message) => JSON.stringify({ error: { message } });

  return {
    where: inside ? "in this browser" : "by n3p-play",
    /** The answer to a request; what fails is an answer with `error`. */
    ask: async (request) => JSON.parse(await send(JSON.stringify(request))),
  };
})();

/** Keeps asking while something changes, one request at a time and always for the latest. */
class Follower {
  #asks;
  #shows;
  #running = false;
  #wanted = false;

  /** `asks` makes the request of the moment, or null; `shows` gets each answer and its request. */
  constructor(asks, shows) {
    this.#asks = asks;
    this.#shows = shows;
  }

  /** Whether an answer is still to come. */
  get busy() { return this.#running; }

  async follow() {
    this.#wanted = true;
    if (this.#running) return;
    this.#running = true;
    while (this.#wanted) {
      this.#wanted = false;
      const request = this.#asks();
      if (request) this.#shows(await planner.ask(request), request);
    }
    this.#running = false;
  }
}
