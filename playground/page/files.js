// Scenes from files and links, and into them.
"use strict";

const files = (() => {
  const base64 = (bytes) => {
    let text = "";
    // A call takes only so many arguments.
    for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
    return btoa(text);
  };
  const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const through = async (bytes, stream) => {
    const parts = [];
    let size = 0;
    for await (const part of pieces(new Blob([bytes]).stream().pipeThrough(stream))) {
      parts.push(part);
      size += part.length;
      // A short link may hold very much of nothing.
      if (size > LARGEST) throw new Error("too large");
    }
    return new Uint8Array(await new Blob(parts).arrayBuffer());
  };
  async function* pieces(stream) {
    const reader = stream.getReader();
    for (let read = await reader.read(); !read.done; read = await reader.read()) yield read.value;
  }

  /** Largest file, bytes: what a request may hold, in base64. */
  const LARGEST = 14e6;
  /** Longest link that browsers and messengers are known to take, characters. */
  const LONGEST = 60000;

  /** The scene of a file, read by the planner, with the files that it may name; throws in plain words. */
  async function read(name, bytes, others = [], vehicle = null) {
    const size = others.reduce((sum, other) => sum + other.bytes.length, bytes.length);
    if (size > LARGEST) throw new Error(`${name} has ${(size / 1e6).toFixed(0)} MB; expected at most 14`);
    const packed = others.map((other) => ({ name: other.name, bytes: base64(other.bytes) }));
    const { scene, error } = await planner.ask({ load: { name, bytes: base64(bytes), others: packed, vehicle } });
    if (error) throw new Error(error.message);
    return scene;
  }

  function offer(name, text) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  /** What the page shows, as the part of a link after #. */
  async function linked(shown) {
    const bytes = new TextEncoder().encode(JSON.stringify(shown));
    const packed = await through(bytes, new CompressionStream("deflate-raw"));
    const text = base64(packed).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
    if (text.length > LONGEST) throw new Error("this scene is too large for a link; save it as a file");
    return `#lot=${text}`;
  }

  /** What a link shows, its scene read by the planner; null where there is none. */
  async function fromLink(hash) {
    const text = /^#lot=([\w-]+)$/.exec(hash)?.[1];
    if (!text) return null;
    let shown;
    try {
      const packed = bytesOf(text.replaceAll("-", "+").replaceAll("_", "/"));
      shown = JSON.parse(new TextDecoder().decode(await through(packed, new DecompressionStream("deflate-raw"))));
      if (!shown.scene) throw new Error("no scene");
    } catch {
      throw new Error("the link is not whole; ask for it again");
    }
    const bytes = new TextEncoder().encode(JSON.stringify(shown.scene));
    return { ...shown, scene: await read("link.json", bytes) };
  }

  return { read, offer, linked, fromLink };
})();
