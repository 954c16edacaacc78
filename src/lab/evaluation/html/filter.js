// One world, type or level alone: hides whatever is about other scenes.
//
// Elements say by data-world, data-type and data-level which scenes they are about. Numbers over all scenes are there
// once for each choice, data-slice says for which (filter.rs).
"use strict";

const filter = (() => {
  const NAMES = ["world", "type", "level"];
  const form = document.getElementById("filter");
  const selects = NAMES.map((name) => document.getElementById(`filter-${name}`));
  const slices = new Set([...document.querySelectorAll("dl[data-slice]")].map((e) => e.dataset.slice));
  const listeners = [];

  const chosen = () => selects.map((select) => select?.value ?? "");

  /** Whether something about such scenes is shown; what it does not say it is about all of. */
  const holds = (setting) => chosen().every((value, i) => !value || (setting[NAMES[i]] ?? value) === value);

  function show() {
    const values = chosen();
    for (const e of document.querySelectorAll("[data-world], [data-type], [data-level]")) e.hidden = !holds(e.dataset);
    const key = JSON.stringify(values);
    for (const e of document.querySelectorAll("[data-slice]")) e.hidden = e.dataset.slice !== key;
    // What would leave no scene cannot be chosen.
    selects.forEach((select, i) => {
      for (const option of select?.options ?? []) option.disabled = !slices.has(JSON.stringify(values.with(i, option.value)));
    });
    document.documentElement.dataset.filter = NAMES.filter((_, i) => values[i]).join(" ");
    document.getElementById("filter-none").hidden = !values.some(Boolean);
    document.getElementById("away-types")?.toggleAttribute("open", Boolean(values[1]));
    for (const listener of listeners) listener();
  }

  function clear() {
    for (const select of selects) if (select) select.value = "";
    show();
  }

  if (form) {
    form.hidden = false;
    form.addEventListener("change", show);
    form.addEventListener("submit", (event) => event.preventDefault());
    document.getElementById("filter-none").addEventListener("click", () => {
      clear();
      selects.find(Boolean).focus();
    });
    // Browsers keep what was chosen when a page is loaded again.
    if (chosen().some(Boolean)) show();
  }

  return { holds, clear, whenChanged: (listener) => listeners.push(listener) };
})();
