// The run, what the reader chose, and a few helpers for drawing; first of the files that are joined into one function.
const run = JSON.parse(document.getElementById("data").textContent);
const el = (id) => document.getElementById(id);
const time = run.time, first = time[0], last = time[time.length - 1], span = last - first || 1;
const still = matchMedia("(prefers-reduced-motion: reduce)").matches;

// ---- data ---------------------------------------------------------------------------------------------------
// A series is stored as differences of whole steps; a constant as one number.
function unpack({ step, d }, count = time.length) {
  const values = new Float64Array(count);
  let sum = 0;
  for (let i = 0; i < values.length; i++) { if (i < d.length) sum += d[i]; values[i] = sum * step; }
  return values;
}
for (const point of run.points) point.at = point.at.map((axis) => unpack(axis));
for (const push of run.pushes) { push.at = push.at.map((axis) => unpack(axis)); push.force = push.force.map((axis) => unpack(axis)); }
for (const deck of run.decks) for (const part of ["at", "normal", "along"]) deck[part] = deck[part].map((axis) => unpack(axis));
for (const wheel of run.wheels) { for (const part of ["at", "spoke", "down"]) wheel[part] = wheel[part].map((axis) => unpack(axis)); wheel.radius = unpack(wheel.radius); }
for (const ball of run.balls) { ball.at = ball.at.map((axis) => unpack(axis)); ball.radius = unpack(ball.radius); }
for (const blade of run.blades) for (const part of ["at", "along"]) blade[part] = blade[part].map((axis) => unpack(axis));
for (const sheet of run.sheets) for (const line of sheet.lines || []) line.at = line.at.map((axes) => axes.map((axis) => unpack(axis, line.count)));
for (const chart of run.charts) for (const line of chart.series) line.values = unpack(line.values);

const instants = []; // events that happen at one time belong together
for (const event of run.events) {
  const group = instants[instants.length - 1];
  if (group && event.time - group.time < 1e-9 * span) group.events.push(event); else instants.push({ time: event.time, events: [event] });
}

for (const group of instants) group.events.sort((a, b) => (a.kind > b.kind) - (a.kind < b.kind)); // closed, event, opened

const state = { t: first, playing: false, speed: 1, chart: 0, over: -1, traced: new Set(), hover: -1, stamp: 0, dirty: true };
const camera = { zoom: 1, dx: 0, dy: 0 };

function locate(t, times = time) { // the interval that holds t: at a switch, the one after it
  let low = 0, high = times.length - 1;
  while (high - low > 1) { const mid = (low + high) >> 1; if (times[mid] <= t) low = mid; else high = mid; }
  const step = times[high] - times[low];
  return { i: low, j: high, w: step > 0 ? Math.min(Math.max((t - times[low]) / step, 0), 1) : 1 };
}
const mix = (values, p) => values[p.i] + p.w * (values[p.j] - values[p.i]);

// ---- colors -------------------------------------------------------------------------------------------------
let colors = {};
function readColors() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["paper", "panel", "ink", "muted", "line", "ground", "left", "right", "body", "soil", "force"])
    colors[name] = style.getPropertyValue("--" + name).trim();
}
const sideColor = (side) => colors[side] || colors.body;
const lineColor = (color) => (color === "ink" ? colors.ink : color);

// ---- canvas -------------------------------------------------------------------------------------------------
function prepare(canvas) {
  const ratio = devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
    canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio);
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, w, h);
  g.lineCap = g.lineJoin = "round";
  g.font = "12px system-ui, sans-serif";
  return { g, w, h };
}
function nice(range, count) { // a round tick distance
  const raw = range / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(raw)), f = raw / power;
  return (f < 1.5 ? 1 : f < 3.5 ? 2 : f < 7.5 ? 5 : 10) * power;
}
function roundDown(x) { const power = 10 ** Math.floor(Math.log10(x)), f = x / power; return (f >= 5 ? 5 : f >= 2 ? 2 : 1) * power; }
const label = (value, tick) => (Math.abs(value) < tick / 2 ? 0 : value).toFixed(Math.min(Math.max(0, -Math.floor(Math.log10(tick) + 1e-9)), 9));
