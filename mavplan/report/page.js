"use strict";
// The map: moved and zoomed by its viewBox, signs kept at their size by the variable --u, metres a pixel.
const map = document.getElementById("map");
const whole = map.viewBox.baseVal, all = { x: whole.x, y: whole.y, width: whole.width, height: whole.height };
let view = { ...all };
const panel = document.getElementById("panel"), resting = [...panel.childNodes];
const bar = document.getElementById("bar");

function show(paper) {
  map.setAttribute("viewBox", `${view.x} ${view.y} ${view.width} ${view.height}`);
  const box = paper || map.getBoundingClientRect();
  const u = Math.max(view.width / box.width, view.height / box.height) || 1;
  map.style.setProperty("--u", u);
  for (const home of map.querySelectorAll(".home")) home.setAttribute("transform", `translate(${home.dataset.at}) scale(${u})`);
  const power = 10 ** Math.floor(Math.log10(120 * u));
  const metres = [5, 2, 1].map(step => step * power).find(step => step <= 120 * u) || power;
  document.getElementById("bar-line").style.width = `${metres / u}px`;
  document.getElementById("bar-text").textContent = metres >= 1000 ? `${metres / 1000} km` : `${metres} m`;
}
function zoom(factor, at) {
  const width = Math.min(Math.max(view.width * factor, all.width / 400), all.width * 3);
  const by = width / view.width;
  const [x, y] = at || [view.x + view.width / 2, view.y + view.height / 2];
  view = { x: x - (x - view.x) * by, y: y - (y - view.y) * by, width, height: view.height * by };
  show();
}
function pan(dx, dy) { view.x += dx * view.width; view.y += dy * view.height; show(); }
function place(event) {
  const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(map.getScreenCTM().inverse());
  return [point.x, point.y];
}
map.addEventListener("wheel", event => { event.preventDefault(); zoom(event.deltaY > 0 ? 1.2 : 1 / 1.2, place(event)); }, { passive: false });
let held = null;
map.addEventListener("pointerdown", event => { held = { at: place(event), id: event.pointerId }; });
map.addEventListener("pointermove", event => {
  if (!held || held.id !== event.pointerId || !event.buttons) return;
  if (!map.classList.contains("moving")) { map.classList.add("moving"); map.setPointerCapture(event.pointerId); }
  const [x, y] = place(event);
  view.x += held.at[0] - x; view.y += held.at[1] - y;
  show();
});
map.addEventListener("pointerup", () => { held = null; map.classList.remove("moving"); });
map.addEventListener("pointercancel", () => { held = null; map.classList.remove("moving"); });
const steps = { ArrowLeft: [-.15, 0], ArrowRight: [.15, 0], ArrowUp: [0, -.15], ArrowDown: [0, .15] };
map.addEventListener("keydown", event => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (steps[event.key]) pan(...steps[event.key]);
  else if (event.key === "+" || event.key === "=") zoom(1 / 1.3);
  else if (event.key === "-") zoom(1.3);
  else if (event.key === "0") { view = { ...all }; show(); }
  else return;
  event.preventDefault();
});
for (const button of document.querySelectorAll("[data-zoom]")) button.addEventListener("click", () => {
  if (button.dataset.zoom === "all") { view = { ...all }; show(); } else zoom(button.dataset.zoom === "in" ? 1 / 1.4 : 1.4);
});
for (const box of document.querySelectorAll("[data-layer]")) box.addEventListener("change", () => {
  map.classList.toggle(`hide-${box.dataset.layer}`, !box.checked);
});

// One stop or user at a time is shown wherever it stands: on the map, over time, in the tables.
const stopRows = new Map([...document.querySelectorAll("#stops tbody tr")].map(row => [row.dataset.stop, row]));
const userRows = [...document.querySelectorAll("#users tbody tr")];
const byUser = new Map(userRows.map(row => [row.dataset.user, row]));
const ofStop = new Map();
for (const part of document.querySelectorAll("[data-of]")) {
  if (!ofStop.has(part.dataset.of)) ofStop.set(part.dataset.of, []);
  ofStop.get(part.dataset.of).push(part);
}
let lit = [], kept = null;
function clear() { for (const part of lit) part.classList.remove("on"); lit = []; panel.replaceChildren(...resting); }
function light(parts) { for (const part of parts) if (part) { part.classList.add("on"); lit.push(part); } }
function say(title, lines, names) {
  const heading = document.createElement("h3");
  heading.textContent = title;
  const parts = [heading, ...lines.map(line => { const p = document.createElement("p"); p.textContent = line; return p; })];
  if (names.length) {
    const list = document.createElement("ul");
    for (const name of names) { const entry = document.createElement("li"); entry.textContent = name; list.append(entry); }
    parts.push(list);
  }
  panel.replaceChildren(...parts, bar);
}
function text(row, column) { return row.cells[column].textContent; }
function lightStop(number) {
  clear();
  const row = stopRows.get(number), parts = ofStop.get(number) || [];
  light([row, map.querySelector(`.stop[data-stop="${number}"]`), ...parts]);
  const served = parts.filter(part => part.tagName === "TR" && part.dataset.user);
  const names = served.slice(0, 200).map(user => `${text(user, 0)}: ${text(user, 1)} Mbit${text(user, 3).startsWith("through") ? ", " + text(user, 3) : ""}`);
  if (served.length > names.length) names.push(`and ${served.length - names.length} more`);
  const pinned = row.cells[8] && text(row, 8);
  say(pinned ? `Stop ${number} (${pinned})` : `Stop ${number}`, [`Hold ${text(row, 5)} s from ${text(row, 4)}, mission item ${text(row, 7)}`, `${served.length} users`], names);
}
function lightUser(index) {
  clear();
  const row = byUser.get(index), stop = row.dataset.of;
  light([row, map.querySelector(`.user[data-user="${index}"]`), map.querySelector(`.stop[data-stop="${stop}"]`),
    map.querySelector(`.coverage[data-of="${stop}"]`), stopRows.get(stop)]);
  say(text(row, 0), [`needs ${text(row, 1)} Mbit, gets ${text(row, 5)} Mbit`, `served ${text(row, 3)} at stop ${stop}, ${text(row, 4)} Mbit/s`,
    `mission item ${text(stopRows.get(stop), 7)}`], []);
}
function subject(target) {
  const part = target.closest && target.closest("[data-stop], [data-user], rect[data-of]");
  if (!part) return null;
  if (part.dataset.user !== undefined) return () => lightUser(part.dataset.user);
  return () => lightStop(part.dataset.stop || part.dataset.of);
}
const main = document.querySelector("main");
main.addEventListener("pointerover", event => { if (!kept && !held) { const shown = subject(event.target); if (shown) shown(); } });
main.addEventListener("focusin", event => { const shown = subject(event.target); if (shown) { kept = null; shown(); } });
main.addEventListener("click", event => { const shown = subject(event.target); if (shown) { kept = shown; shown(); } else if (event.target === map) { kept = null; clear(); } });
main.addEventListener("keydown", event => {
  if (event.key === "Escape") { kept = null; clear(); }
  if (event.key === "Enter" || event.key === " ") { const shown = subject(event.target); if (shown && event.target.closest(".stop")) { kept = shown; shown(); event.preventDefault(); } }
});

// Tables sort by a click on their heading, or Enter.
function worth(cell, numeric) {
  const value = cell.dataset.value ?? cell.textContent;
  if (!numeric) return value;
  const number = parseFloat(value.replaceAll(",", ""));
  return Number.isNaN(number) ? -Infinity : number;
}
for (const table of document.querySelectorAll("table.sortable")) {
  const headings = [...table.tHead.rows[0].cells];
  headings.forEach((heading, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...heading.childNodes);
    heading.append(button);
    button.addEventListener("click", () => {
      const up = heading.getAttribute("aria-sort") !== "ascending", numeric = heading.dataset.kind === "number";
      for (const other of headings) other.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", up ? "ascending" : "descending");
      const keyed = [...table.tBodies[0].rows].map(row => [worth(row.cells[column], numeric), row]);
      const compare = numeric ? (a, b) => a - b : new Intl.Collator(undefined, { numeric: true }).compare;
      keyed.sort((a, b) => (up ? 1 : -1) * compare(a[0], b[0]));
      table.tBodies[0].append(...keyed.map(([, row]) => row));
    });
  });
}
const filter = document.getElementById("filter"), filtered = document.getElementById("filtered");
filter.addEventListener("input", () => {
  const wanted = filter.value.trim().toLocaleLowerCase();
  let left = 0;
  for (const row of userRows) { row.hidden = !row.cells[0].textContent.toLocaleLowerCase().includes(wanted); left += !row.hidden; }
  filtered.textContent = wanted ? `${left} of ${userRows.length}` : "";
});
// On paper the map is as large as the style sheet says, and its signs and scale are made for that.
const paper = { width: 180 / 25.4 * 96, height: 150 / 25.4 * 96 };
const items = [...document.querySelectorAll("details")];
let opened = [], looked = view;
addEventListener("beforeprint", () => {
  opened = items.map(part => part.open); looked = view;
  for (const part of items) part.open = true;
  view = { ...all }; show(paper);
});
addEventListener("afterprint", () => { items.forEach((part, number) => { part.open = opened[number]; }); view = looked; show(); });
addEventListener("resize", () => show());
show();
