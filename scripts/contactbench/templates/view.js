"use strict";
const byId = id => document.getElementById(id), DATA = JSON.parse(byId("data").textContent);
const START = new URLSearchParams(location.hash.slice(1));
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const words = { speed: [0.1, 0.25, 0.5, 1, 2, 5, 10] };
let scene, group, camera, controls, renderer, current, t = 0, playing = false, last = 0, stale = true, turned = false;

function bytes(text) { const s = atob(text), b = new Uint8Array(s.length); for (let i = 0; i < s.length; ++i) b[i] = s.charCodeAt(i); return b.buffer; }
function unpack(run) {
  if (run.ready) return;
  run.poses = new Float32Array(bytes(run.poses)); run.contacts.numbers = new Float32Array(bytes(run.contacts.numbers));
  run.contacts.modes = new Uint8Array(bytes(run.contacts.modes)); run.first = [0];
  for (const n of run.contacts.count) run.first.push(run.first[run.first.length - 1] + n);
  run.ready = true;
}
/// The last of rising numbers that is at most x.
function before(list, x) { let a = 0, b = list.length - 1; while (a < b) { const m = (a + b + 1) >> 1; if (list[m] <= x + 1e-12) a = m; else b = m - 1; } return a; }
const end = () => Math.max(...current.runs.map(run => run.t[run.t.length - 1]));

// Shapes.

function surface(shape, size) {
  if (shape.kind === "box") return new THREE.BoxBufferGeometry(2 * shape.hx, 2 * shape.hy, 2 * shape.hz);
  if (shape.kind === "sphere") return new THREE.SphereBufferGeometry(shape.radius, 32, 20);
  if (shape.kind === "capsule") {  // a profile turned about y
    const profile = []; for (let k = 0; k <= 24; ++k) { const a = Math.PI * (k / 24 - 0.5); profile.push(new THREE.Vector2(Math.max(0, shape.radius * Math.cos(a)), shape.radius * Math.sin(a) + (k <= 12 ? -shape.hy : shape.hy))); if (k === 12) profile.push(new THREE.Vector2(shape.radius, shape.hy)); }
    return new THREE.LatheBufferGeometry(profile, 32);
  }
  if (shape.kind === "hull") {
    const corners = []; for (const face of shape.faces) for (let k = 1; k + 1 < face.length; ++k) corners.push(...face[0], ...face[k], ...face[k + 1]);
    const geometry = new THREE.BufferGeometry(); geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3)); geometry.computeVertexNormals();
    return geometry;
  }
  if (shape.kind === "cylinder") return new THREE.CylinderBufferGeometry(shape.radius, shape.radius, Math.max(2 * shape.hy, 1e-3 * shape.radius), 40);
  return null;
}
const TONES = ["#4f86b0", "#c98a4b", "#6d9f6d", "#a87ba3", "#b0a14f", "#5f9ea0"];
function place(object, x, at) { object.position.set(x[at], x[at + 1], x[at + 2]); object.quaternion.set(x[at + 3], x[at + 4], x[at + 5], x[at + 6]); }
function build(run, number, size) {
  const root = new THREE.Group(); run.root = root; run.planes = []; run.nodes = run.bodies.map(() => { const g = new THREE.Group(); root.add(g); return g; });
  for (const shape of run.shapes) {
    const pose = [shape.px, shape.py, shape.pz, shape.qx, shape.qy, shape.qz, shape.qw], body = run.bodies.indexOf(shape.body);
    const geometry = surface(shape, size);
    if (!geometry) {  // a half-space: a grid in its plane
      const grid = new THREE.GridHelper(Math.max(8 * size, 2.5 * current.across), 40, css("--soft"), css("--line")); const holder = new THREE.Group();
      place(holder, pose, 0); holder.add(grid); root.add(holder); run.planes.push(holder); continue;
    }
    const over = number && mode() === "over";
    const colour = mode() === "over" ? css(number ? "--b" : "--a") : body < 0 ? "#9a9a96" : TONES[body % TONES.length];
    const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color: colour, transparent: over || body < 0, opacity: over ? 0.45 : body < 0 ? 0.55 : 1 }));
    place(mesh, pose, 0);
    mesh.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry, 30), new THREE.LineBasicMaterial({ color: "#20242a", transparent: true, opacity: 0.55 })));
    (body < 0 ? root : run.nodes[body]).add(mesh);
  }
  run.bodies.forEach((body, b) => {  // a link that collides with nothing: its centre of mass
    if (!run.shapes.some(shape => shape.body === body)) run.nodes[b].add(new THREE.Mesh(new THREE.SphereBufferGeometry(0.03 * size, 12, 8), new THREE.MeshLambertMaterial({ color: "#9a9a96" })));
  });
  const most = Math.max(1, ...run.contacts.count), shaft = new THREE.CylinderBufferGeometry(0.012, 0.012, 1, 8), head = new THREE.ConeBufferGeometry(0.035, 0.09, 12),
    dot = new THREE.SphereBufferGeometry(0.022, 10, 8);
  shaft.translate(0, 0.5, 0); head.translate(0, 0.045, 0);
  run.arrows = DATA.modes.map(name => [shaft, head, dot].map(form => {
    const many = new THREE.InstancedMesh(form, new THREE.MeshBasicMaterial({ color: css("--" + name), depthTest: false, transparent: true }), most);
    many.frustumCulled = false; many.renderOrder = 2; root.add(many); return many;
  }));
  scene.add(root);
}
function extent() {
  const box = new THREE.Box3(), v = new THREE.Vector3();
  for (const run of current.runs) {
    const n = run.bodies.length, reach = run.bodies.map(body => Math.max(0, ...run.shapes.filter(s => s.body === body).map(s => Math.hypot(s.px, s.py, s.pz) + Math.hypot(s.hx, s.hy, s.hz, s.kind === "sphere" || s.kind === "capsule" ? s.radius : 0))));
    for (let i = 0; i < run.t.length; ++i) for (let b = 0; b < n; ++b) {
      v.fromArray(run.poses, 7 * (i * n + b));
      if (reach[b] && isFinite(v.x)) { box.expandByPoint(v.clone().addScalar(reach[b])); box.expandByPoint(v.clone().addScalar(-reach[b])); }
    }
  }
  return box;
}

// What is shown at a time.

const A = typeof THREE === "undefined" ? null : { q: new THREE.Quaternion(), p: new THREE.Quaternion(), m: new THREE.Matrix4(), x: new THREE.Vector3(), d: new THREE.Vector3(), s: new THREE.Vector3(), up: new THREE.Vector3(0, 1, 0) };
function pose(run) {
  const i = before(run.t, t), j = Math.min(i + 1, run.t.length - 1), n = run.bodies.length;
  const f = j > i ? Math.min(1, Math.max(0, (t - run.t[i]) / (run.t[j] - run.t[i]))) : 0;
  run.nodes.forEach((node, b) => {
    const a = 7 * (i * n + b), c = 7 * (j * n + b);
    place(node, run.poses, a);
    node.position.lerp(A.x.fromArray(run.poses, c), f); node.quaternion.slerp(A.p.fromArray(run.poses, c + 3), f);
  });
  const at = f > 0.5 ? j : i, used = DATA.modes.map(() => 0), wanted = byId("arrows").checked;
  const long = current.size * 0.35 * Math.pow(10, +byId("length").value) / current.impulse, thick = current.size * 0.3;
  for (let k = run.first[at]; wanted && k < run.first[at + 1]; ++k) {
    const m = run.contacts.modes[k], [shaft, head, dot] = run.arrows[m], c = used[m]++;
    A.x.fromArray(run.contacts.numbers, 6 * k); A.d.fromArray(run.contacts.numbers, 6 * k + 3);
    const length = long * A.d.length(); A.q.setFromUnitVectors(A.up, A.d.length() > 0 ? A.d.normalize() : A.up);
    shaft.setMatrixAt(c, A.m.compose(A.x, A.q, A.s.set(thick, Math.max(length, 1e-9), thick)));
    dot.setMatrixAt(c, A.m.compose(A.x, A.q, A.s.set(thick, thick, thick)));
    const top = length > 0 ? Math.min(1, length / (0.09 * thick)) * thick : 1e-9;
    A.x.addScaledVector(A.d, length); head.setMatrixAt(c, A.m.compose(A.x, A.q, A.s.set(top, top, top)));
  }
  run.arrows.forEach((three, m) => three.forEach(many => { many.count = used[m]; many.visible = used[m] > 0; many.instanceMatrix.needsUpdate = true; }));
}
const mode = () => current.runs.length > 1 ? byId("mode").value : "one";
function draw() {
  const canvas = byId("canvas"), w = canvas.clientWidth, h = canvas.clientHeight;
  renderer.setSize(w, h, false); renderer.setScissorTest(true);
  const parts = mode() === "side" ? current.runs.length : 1, down = w < h;  // on a phone one above the other
  for (let p = 0; p < parts; ++p) {
    current.runs.forEach((run, i) => { run.root.visible = parts === 1 || i === p; });
    // From behind, a plane would stand before what it bounds; of runs laid over each other one has them.
    current.runs.forEach((run, i) => run.planes.forEach(plane => { plane.visible = (parts > 1 || i === 0) && A.d.copy(camera.position).sub(plane.position).dot(A.x.set(0, 1, 0).applyQuaternion(plane.quaternion)) > 0; }));
    const [x, y, pw, ph] = down ? [0, (parts - 1 - p) * h / parts, w, h / parts] : [p * w / parts, 0, w / parts, h];
    renderer.setViewport(x, y, pw, ph); renderer.setScissor(x, y, pw, ph);
    camera.aspect = pw / ph; camera.updateProjectionMatrix();
    renderer.render(scene, camera);
  }
  byId("names").innerHTML = "";
  current.runs.forEach((run, i) => {
    const span = document.createElement("span"), key = document.createElement("i"); key.className = "key"; key.style.background = css(i ? "--b" : "--a");
    span.append(key, run.label + (run.status && run.status !== "ok" ? ` (${run.status})` : "")); span.style.left = parts === 2 && !down ? `calc(${50 * i}% + .6rem)` : ".6rem";
    span.style.top = parts === 2 && down ? `calc(${50 * i}% + .4rem)` : parts === 1 ? `${0.4 + 1.9 * i}rem` : ".4rem"; byId("names").append(span);
  });
}

// Curves.

function chart() {
  const svg = byId("chart"), key = byId("curve").value, w = svg.clientWidth || 600, h = svg.clientHeight || 120, left = 62, under = 16;
  svg.setAttribute("viewBox", `0 0 ${w} ${h}`); svg.innerHTML = "";
  const said = current.curves[key]; if (!said) return;
  const log = said[2], value = v => log ? Math.log10(v) : v, all = [];
  const lines = current.runs.map(run => run.curves[key]).map(c => c ? c.t.map((t, i) => [t, c.v[i]]).filter(p => p[1] !== null && (!log || p[1] > 0)).map(p => [p[0], value(p[1])]) : []);
  lines.forEach(line => line.forEach(p => all.push(p[1])));
  let low = Math.min(...all), high = Math.max(...all);
  if (!all.length) { low = 0; high = 1; } if (high - low < 1e-12) { low -= 0.5; high += 0.5; }
  const X = t => left + (w - left - 8) * t / (end() || 1), Y = v => 6 + (h - under - 10) * (high - v) / (high - low);
  const text = (x, y, s, anchor) => `<text x="${x}" y="${y}" text-anchor="${anchor}">${s}</text>`, number = v => String(+(log ? Math.pow(10, v) : v).toPrecision(2));
  let out = `<line class="axis" x1="${left}" x2="${w - 8}" y1="${h - under}" y2="${h - under}"/>` + text(left - 4, Y(high) + 8, number(high), "end") + text(left - 4, Y(low), number(low), "end") +
    text(left, h - 3, "0", "start") + text(w - 8, h - 3, `${end().toPrecision(3)} s`, "end");
  if (!all.length) out += text(w / 2, h / 2, log && current.runs.some(run => run.curves[key] && run.curves[key].v.some(v => v !== null)) ? "zero throughout" : "nothing recorded", "middle");
  lines.forEach((line, i) => { out += `<path class="${i ? "b" : "a"}" d="${line.map((p, n) => (n ? "L" : "M") + X(p[0]).toFixed(1) + " " + Y(p[1]).toFixed(1)).join("")}"/>`; });
  svg.innerHTML = out + `<line class="cursor" id="cursor" y1="2" y2="${h - under}"/>`;
  chart.x = X; chart.back = x => Math.min(end(), Math.max(0, (x - left) / (w - left - 8) * end())); cursor();
}
function cursor() {
  const line = byId("cursor"), key = byId("curve").value, said = current.curves[key];
  if (line) { line.setAttribute("x1", chart.x(t)); line.setAttribute("x2", chart.x(t)); }
  byId("values").textContent = current.runs.map(run => { const c = run.curves[key], v = c && c.t.length ? c.v[before(c.t, t)] : null; return v === null ? "" : (current.runs.length > 1 && key !== "error" ? run.label + ": " : "") + v + " " + said[1]; }).filter(Boolean).join("   ");
}

// Controls.

function show() { stale = true; byId("time").value = t; byId("now").textContent = t.toFixed(3) + " s"; cursor(); }
function frame(now) {
  if (playing) {
    t += Math.min(0.1, (now - last) / 1000) * +byId("speed").value;
    if (t >= end()) { t = end(); play(false); }
    show();
  }
  last = now;
  if (controls.update() || stale) { if (stale) current.runs.forEach(pose); stale = false; draw(); }
  requestAnimationFrame(frame);
}
function play(on) { playing = on; if (on && t >= end()) t = 0; byId("play").textContent = on ? "pause" : "play"; }
function colours() { if (!current) return; rebuild(); chart(); }
function rebuild() {
  while (scene.children.length) scene.remove(scene.children[0]);
  scene.background = new THREE.Color(css("--page"));
  scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8a8a, 0.85)); const sun = new THREE.DirectionalLight(0xffffff, 0.45); sun.position.set(2, 5, 3); scene.add(sun);
  current.runs.forEach((run, i) => build(run, i, current.size)); stale = true;
}
function look() {
  const box = extent(), middle = box.getCenter(new THREE.Vector3()), across = Math.max(0.1, box.getSize(new THREE.Vector3()).length());
  const sizes = current.runs[0].shapes.filter(s => s.body).map(s => 2 * Math.max(s.hx, s.hy, s.hz, s.radius)).sort((a, b) => a - b);
  current.across = across; current.size = Math.min(across, 4 * (sizes[sizes.length >> 1] || across)); current.impulse = Math.max(...current.runs.map(run => run.impulse));
  camera = new THREE.PerspectiveCamera(40, 1, across / 500, across * 50);
  camera.position.copy(middle).add(new THREE.Vector3(0.55, 0.4, 1));
  controls = new THREE.OrbitControls(camera, byId("canvas")); controls.target.copy(middle); controls.enableDamping = false; controls.addEventListener("change", () => { stale = true; });
  controls.addEventListener("start", () => { turned = true; }); turned = false;
  current.box = box; fit();
}
function fit() {  // as near as all of the motion is still seen, from where one looks
  const stage = byId("stage"), wide = stage.clientWidth / stage.clientHeight, parts = mode() === "side" ? current.runs.length : 1;
  const middle = controls.target, back = camera.position.clone().sub(middle).normalize(), far = new THREE.Vector3();
  const right = new THREE.Vector3().crossVectors(camera.up, back).normalize(), up = new THREE.Vector3().crossVectors(back, right);
  const high = Math.tan(camera.fov * Math.PI / 360), across = high * (wide < 1 ? wide * parts : wide / parts);
  let distance = 0;
  for (let corner = 0; corner < 8; ++corner) {
    far.set(...["x", "y", "z"].map((axis, i) => (corner >> i & 1 ? current.box.max : current.box.min)[axis])).sub(middle);
    distance = Math.max(distance, far.dot(back) + Math.max(Math.abs(far.dot(up)) / high, Math.abs(far.dot(right)) / across));
  }
  if (distance > 0) camera.position.copy(middle).addScaledVector(back, 1.12 * distance);
  controls.update(); stale = true;
}
function choose(number) {
  current = DATA.scenes[number]; current.runs.forEach(unpack); t = 0; play(false);
  byId("title").textContent = current.name + (current.title ? ": " + current.title : ""); byId("laid").hidden = current.runs.length < 2;
  byId("curve").innerHTML = ""; for (const [key, said] of Object.entries(current.curves)) byId("curve").add(new Option(said[0] + (said[1] ? ", " + said[1] : ""), key));
  byId("time").max = end(); if (controls) controls.dispose(); look(); rebuild(); show(); chart();
}
function begin() {
  document.documentElement.dataset.theme = START.get("theme") || "";
  words.speed.forEach(s => byId("speed").add(new Option(s + " x", s, s === 1, s === 1)));
  byId("legend").innerHTML = DATA.modes.map(m => `<i class="key" style="background:var(--${m})"></i>${m}`).join("");
  DATA.scenes.forEach((s, i) => byId("scene").add(new Option(s.name, i))); byId("choice").hidden = DATA.scenes.length < 2;
  try { renderer = new THREE.WebGLRenderer({ canvas: byId("canvas"), antialias: true, preserveDrawingBuffer: false }); } catch (error) {
    byId("fault").hidden = false; byId("fault").textContent = "This browser draws no WebGL: " + error.message; return;
  }
  renderer.setPixelRatio(Math.min(2, window.devicePixelRatio)); scene = new THREE.Scene();
  if (START.get("mode")) byId("mode").value = START.get("mode");
  const wanted = DATA.scenes.findIndex(s => s.name === START.get("scene")); byId("scene").value = Math.max(0, wanted); choose(Math.max(0, wanted));
  if (START.get("t")) { t = Math.min(end(), +START.get("t")); show(); }
  byId("scene").onchange = event => choose(+event.target.value); byId("play").onclick = () => play(!playing);
  byId("time").oninput = event => { t = +event.target.value; show(); }; byId("curve").onchange = chart; byId("arrows").onchange = byId("length").oninput = () => { stale = true; };
  byId("mode").onchange = () => { fit(); rebuild(); }; window.onresize = () => { if (!turned) fit(); stale = true; chart(); };
  byId("theme").onclick = () => { const dark = css("--page") === "#17191c"; document.documentElement.dataset.theme = dark ? "light" : "dark"; colours(); };
  matchMedia("(prefers-color-scheme: dark)").addListener(colours);
  const drag = event => { if (event.buttons) { t = chart.back(event.clientX - byId("chart").getBoundingClientRect().left); show(); } };
  byId("chart").onpointerdown = byId("chart").onpointermove = drag;
  window.onkeydown = event => {
    if (/INPUT|SELECT|BUTTON/.test(event.target.tagName)) return;
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (by) { t = Math.min(end(), Math.max(0, t + by * end() / 200)); show(); } else if (event.key === " ") { play(!playing); event.preventDefault(); }
  };
  current.runs.forEach(pose); draw(); requestAnimationFrame(frame);
}
begin();
