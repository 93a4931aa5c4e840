"use strict";
// Everything here is on top of a page that says what was found without script.
const number = cell => { const m = /^[-+]?(\d[\d.]*(e[-+]?\d+)?|\.\d+)/i.exec(cell.textContent.trim().replace(/^<\s*/, "")); return m ? parseFloat(m[0]) : null; };

// Tables that sort and filter.
for (const table of document.querySelectorAll("table.sorts")) {
  const body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    if (!head.textContent.trim()) return;
    head.classList.add("sorts"); head.tabIndex = 0;
    const sort = () => {
      const down = head.getAttribute("aria-sort") === "ascending"; heads.forEach(h => h.removeAttribute("aria-sort")); head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const rows = [...body.rows], of = row => row.cells[column] || document.createElement("td"), numeric = rows.filter(r => number(of(r)) !== null).length > rows.length / 2;
      const compare = (a, b) => { const x = number(of(a)), y = number(of(b)); if (numeric) return (x === null) - (y === null) || (down ? y - x : x - y); return (down ? -1 : 1) * of(a).textContent.localeCompare(of(b).textContent); };
      body.append(...rows.sort(compare));
    };
    head.onclick = sort; head.onkeydown = event => { if (event.key === "Enter") sort(); };
  });
  if (body.rows.length < 9) continue;
  const input = document.createElement("input"), label = document.createElement("p"); label.className = "filter"; input.placeholder = "filter the rows"; input.type = "search";
  input.oninput = () => { const words = input.value.toLowerCase().split(/\s+/); for (const row of body.rows) row.hidden = !words.every(w => row.textContent.toLowerCase().includes(w)); };
  label.append(input); table.parentElement.before(label);
}

// Light and dark, and where in the contents the reader is.
document.getElementById("theme").onclick = () => {
  const root = document.documentElement, dark = getComputedStyle(root).getPropertyValue("--page").trim() === "#17191c"; root.dataset.theme = dark ? "light" : "dark";
};
const theme = new URLSearchParams(location.hash.slice(1)).get("theme"); if (theme) document.documentElement.dataset.theme = theme;
const links = new Map([...document.querySelectorAll("nav a")].map(a => [a.hash.slice(1), a]));
const watch = new IntersectionObserver(found => found.forEach(f => links.get(f.target.id).classList.toggle("here", f.isIntersecting)), { rootMargin: "-20% 0px -70% 0px" });
links.forEach((_, id) => watch.observe(document.getElementById(id)));

// Error against run time.
const points = document.getElementById("points"), DATA = points && JSON.parse(document.getElementById("points_data").textContent);
if (points && Object.keys(DATA.scenes).length) {
  const NS = "http://www.w3.org/2000/svg", get = q => points.querySelector(q);
  points.hidden = false; document.querySelectorAll(".unscripted").forEach(e => { e.hidden = true; });
  Object.keys(DATA.scenes).forEach(name => get("select").add(new Option(name)));
  const escape = s => s.replace(/[&<>"]/g, c => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c]), short = x => +x.toPrecision(3);
  const say = p => `<b>${escape(p.label)}</b>: error ${short(p.error)} m${p.few < p.error * 0.999 ? ` (largest of the ensemble, the least ${short(p.few)})` : ""}${p.worst > p.error * 1.001 ? " (not all of the ensemble ended ok)" : ""}, ${short(p.time)} s a simulated second${p.repeats > 1 ? ` (${short(p.least)} to ${short(p.most)})` : ", one run"}${p.status === "ok" ? "" : ", " + escape(p.status)}` +
    `<br><code>${escape(p.command)}</code><br><small>run ${escape(p.run)}</small>`;
  const draw = () => {
    const some = DATA.scenes[get("select").value], wanted = Math.pow(10, +get("input").value), svg = get("svg"), w = svg.clientWidth || 800, h = svg.clientHeight || 400, left = 56, under = 34, log = Math.log10;
    const floor = 1e-16, xs = some.map(p => log(p.time)), ys = [...some.map(p => log(Math.max(p.error, floor))), log(wanted)];
    const [x0, x1, y0, y1] = [Math.floor(Math.min(...xs)), Math.ceil(Math.max(...xs) + 1e-9), Math.floor(Math.min(...ys) - 0.3), Math.ceil(Math.max(...ys))];
    const X = v => left + (w - left - 12) * (v - x0) / (x1 - x0 || 1), Y = v => 8 + (h - under - 12) * (y1 - v) / (y1 - y0 || 1);
    let out = "";
    for (let i = x0; i <= x1; ++i) out += `<line x1="${X(i)}" x2="${X(i)}" y1="8" y2="${h - under}"/><text x="${X(i)}" y="${h - under + 14}" text-anchor="middle">1e${i}</text>`;
    for (let i = y0; i <= y1; i += Math.max(1, Math.ceil((y1 - y0) / 9))) out += `<line x1="${left}" x2="${w - 12}" y1="${Y(i)}" y2="${Y(i)}"/><text x="${left - 5}" y="${Y(i) + 4}" text-anchor="end">1e${i}</text>`;
    out += `<text x="${w - 12}" y="${h - 4}" text-anchor="end">processing time, s a simulated second</text><text x="${left + 4}" y="20">error, m</text><line class="wanted" x1="${left}" x2="${w - 12}" y1="${Y(log(wanted))}" y2="${Y(log(wanted))}"/>`;
    svg.setAttribute("viewBox", `0 0 ${w} ${h}`); svg.innerHTML = out;
    const good = some.filter(p => p.good && p.worst + p.uncertainty <= wanted).sort((a, b) => a.time - b.time), best = good[0], near = some.filter(p => p.good).sort((a, b) => a.worst - b.worst || a.time - b.time)[0];
    for (const p of some) {
      const c = document.createElementNS(NS, "circle"); c.setAttribute("cx", X(log(p.time))); c.setAttribute("cy", Y(log(Math.max(p.error, floor)))); c.setAttribute("r", p === best ? 8 : 5.5);
      c.setAttribute("fill", DATA.colours[p.key]); c.setAttribute("class", (p === best ? "best" : "") + (good.includes(p) ? "" : " dim")); c.tabIndex = 0;
      c.onpointerenter = c.onfocus = c.onclick = () => { get(".said").innerHTML = say(p); }; svg.append(c);
    }
    get("output").textContent = wanted.toPrecision(2) + " m";
    get(".answer").innerHTML = best ? "Cheapest that meets it: " + say(best) : "No setting of the sweep meets it. " + (near ? "Nearest: " + say(near) : "");
    get(".legend").innerHTML = [...new Set(some.map(p => p.key))].map(k => `<span><i class="key" style="background:${DATA.colours[k]}"></i>${escape(k)}</span>`).join(" ");
  };
  get("select").onchange = get("input").oninput = draw; window.addEventListener("resize", draw); draw();
}

// Stiff cases: a cell says its reason and command.
const heat = document.querySelector(".heat");
if (heat) {
  const panel = document.getElementById("heat_cell"), show = cell => {
    const row = document.getElementById(cell.hash.slice(1)), heads = [...row.closest("table").tHead.rows[0].cells].map(c => c.textContent);
    panel.innerHTML = ""; [...row.cells].forEach((c, i) => { if (c.textContent) { const p = document.createElement(heads[i] === "command" ? "pre" : "span"); p.textContent = heads[i] === "command" ? c.textContent : `${heads[i]}: ${c.textContent};  `; panel.append(p); } });
  };
  heat.onclick = event => { const cell = event.target.closest("a"); if (cell) { event.preventDefault(); show(cell); } };
  heat.onpointerover = event => { const cell = event.target.closest("a"); if (cell && event.pointerType === "mouse") show(cell); };
}
