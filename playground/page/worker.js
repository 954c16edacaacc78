// Plans in a browser, away from the page: the planner as WebAssembly. `browser.rs` is the other side.
"use strict";

let compiled = null;
let planner = null;

/** Base64 of a gzipped module, made ready. */
async function start(base64) {
  const packed = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  compiled = await WebAssembly.compile(await new Response(stream).arrayBuffer());
  await restart();
}

async function restart() {
  const page = { now: () => performance.now() };
  planner = (await WebAssembly.instantiate(compiled, { page })).exports;
}

function ask(request) {
  const bytes = new TextEncoder().encode(request);
  const room = planner.take(bytes.length);
  if (room === 0) throw new Error("no memory");
  new Uint8Array(planner.memory.buffer, room, bytes.length).set(bytes);
  const answer = planner.ask(room, bytes.length);
  planner.give_back(room, bytes.length);
  const size = new DataView(planner.memory.buffer).getUint32(answer, true);
  const text = new TextDecoder().decode(new Uint8Array(planner.memory.buffer, answer + 4, size));
  planner.give_back(answer, size + 4);
  return text;
}

let ready = null;
onmessage = async ({ data }) => {
  if (data.planner) {
    ready = start(data.planner);
    ready.then(() => postMessage({ ready: true }), (e) => postMessage({ failed: String(e) }));
    return;
  }
  await ready;
  let answer;
  try {
    answer = ask(data.request);
  } catch (e) {
    // A planner that stopped halfway is not asked again.
    await restart();
    answer = JSON.stringify({ error: { message: `the planner failed on this scene; that is a bug of ours (${e.message})` } });
  }
  postMessage({ id: data.id, answer });
};
