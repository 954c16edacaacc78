// Colours: as the system says, or as chosen. And the switch of the paper's numbers.
"use strict";
window.addEventListener("error", (event) => {
  document.documentElement.dataset.error = event.message;
});

{
  const root = document.documentElement;
  const button = document.getElementById("theme");
  const themes = ["auto", "light", "dark"];
  const signs = { auto: "◐", light: "☀", dark: "☾" };
  // A page opened from a file may have no storage; then the choice lasts as long as the page.
  const storage = {
    get() { try { return localStorage.getItem("n3p-theme"); } catch { return null; } },
    set(v) { try { localStorage.setItem("n3p-theme", v); } catch { /* see above */ } },
  };
  const show = (theme) => {
    root.dataset.theme = theme;
    button.textContent = signs[theme];
    button.setAttribute("aria-label", `Colours: ${theme}. Change`);
  };
  const wanted = new URLSearchParams(location.search).get("theme") ?? storage.get();
  show(themes.includes(wanted) ? wanted : "auto");
  button.addEventListener("click", () => {
    const next = themes[(themes.indexOf(root.dataset.theme) + 1) % themes.length];
    storage.set(next);
    show(next);
  });

  const paper = document.getElementById("show-paper");
  const showPaper = () => { root.dataset.paper = paper.checked ? "on" : "off"; };
  paper.addEventListener("change", showPaper);
  showPaper();
}
