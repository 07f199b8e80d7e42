// The moving mechanism on its canvas.
// ---- projection ---------------------------------------------------------------------------------------------
function project(p) { // to the picture plane, x right and y up [m]
  if (!run.spatial) return [p[0], p[1]];
  const cy = Math.cos(camera.yaw), sy = Math.sin(camera.yaw), cp = Math.cos(camera.pitch), sp = Math.sin(camera.pitch);
  const z = -sy * p[0] + cy * p[2];
  return [cy * p[0] + sy * p[2], cp * p[1] - sp * z];
}
const pointAt = (k, p) => project(run.points[k].at.map((axis) => mix(axis, p)));

// The center and the size of the mechanism over time: what the camera follows and fits.
let path = null;
function survey() {
  const n = time.length, center = [new Float64Array(n), new Float64Array(n)];
  const all = [Infinity, Infinity, -Infinity, -Infinity];
  let width = 0, height = 0;
  for (let i = 0; i < n; i++) {
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    for (const point of run.points) {
      const [x, y] = project(point.at.map((axis) => axis[i]));
      box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y); box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y);
    }
    for (const wheel of run.wheels) {
      const [x, y] = project(wheel.at.map((axis) => axis[i])), r = wheel.radius[i];
      box[0] = Math.min(box[0], x - r); box[1] = Math.min(box[1], y - r); box[2] = Math.max(box[2], x + r); box[3] = Math.max(box[3], y + r);
    }
    center[0][i] = (box[0] + box[2]) / 2; center[1][i] = (box[1] + box[3]) / 2;
    width = Math.max(width, box[2] - box[0]); height = Math.max(height, box[3] - box[1]);
    for (const k of [0, 1]) { all[k] = Math.min(all[k], box[k]); all[k + 2] = Math.max(all[k + 2], box[k + 2]); }
  }
  path = { center: center.map(smooth), width, height, all };
}
const extent = () => Math.max(path.width, path.height, 0.12 * (path.all[2] - path.all[0]), 0.12 * (path.all[3] - path.all[1]), 1e-12); // of the mechanism [m]
function smooth(values) { // a straight line with the mean over a window, so that the camera does not rock with each step
  const half = Math.max(1, Math.round(time.length * Math.min(0.25, 0.6 / span))), n = values.length, sums = [0];
  for (let i = 0; i < n; i++) sums.push(sums[i] + values[i]);
  return Float64Array.from(values, (_, i) => {
    const reach = Math.min(half, i, n - 1 - i), a = i - reach, b = i + reach;
    return (sums[b + 1] - sums[a]) / (b - a + 1);
  });
}
function view(w, h, p) { // meters to pixels
  const follow = el("follow").checked, [x0, y0, x1, y1] = path.all;
  const floor = 0.12 * Math.max(x1 - x0, y1 - y0); // a single point has no size of its own
  const size = follow ? [Math.max(path.width * 1.5, path.height * 0.8, floor), Math.max(path.height * 1.08, floor)] : [x1 - x0, y1 - y0];
  const margin = 46, least = 1e-9 + 0.02 * Math.max(...size);
  const scale = camera.zoom * Math.min((w - 2 * margin) / Math.max(size[0], least), (h - 2 * margin) / Math.max(size[1], least));
  const cx = follow ? mix(path.center[0], p) : (x0 + x1) / 2, cy = follow ? mix(path.center[1], p) : (y0 + y1) / 2;
  const ox = w / 2 + camera.dx, oy = h / 2 + camera.dy;
  return { scale, to: ([x, y]) => [ox + scale * (x - cx), oy - scale * (y - cy)], center: [cx - camera.dx / scale, cy + camera.dy / scale] };
}

// ---- the mechanism ------------------------------------------------------------------------------------------
let shown = [];
function drawScene() {
  const { g, w, h } = prepare(el("scene"));
  if (!run.points.length) { drawLines(g, w, h, run.charts[1] || run.charts[0], true); return; }
  const p = locate(state.t), v = view(w, h, p);
  for (const sheet of run.sheets) drawSheet(g, w, h, v, sheet);
  for (const ground of run.grounds) drawGround(g, w, h, v, ground);
  for (const deck of run.decks) drawDeck(g, w, h, v, p, deck);
  drawTouches(g, v);
  drawTraces(g, v, p);
  if (el("ghosts").checked) {
    const gap = Math.min(0.12, span / 12);
    for (let k = 9; k >= 1; k--) if (state.t - k * gap >= first) drawFigure(g, v, locate(state.t - k * gap), 0.05 + 0.16 * (1 - k / 10), true);
  }
  for (const wheel of run.wheels) drawWheel(g, v, p, wheel);
  drawFigure(g, v, p, 1, false);
  for (const blade of run.blades) drawBlade(g, v, p, blade);
  if (el("forces").checked) drawPushes(g, w, h, v, p);
  drawScale(g, w, h, v);
}
const order = run.segments.map((s, k) => [{ left: 0, "": 1, right: 2 }[s.side], k]).sort((a, b) => a[0] - b[0] || a[1] - b[1]).map((x) => x[1]);
const fixed = run.points.map((point) => point.at.every((axis) => axis.every((x) => x === axis[0])));

function drawFigure(g, v, p, alpha, ghost) {
  const at = run.points.map((_, k) => v.to(pointAt(k, p)));
  const unit = Math.min(Math.max(v.scale * Math.max(path.height, path.width) * 0.017, 3), 8);
  g.globalAlpha = alpha;
  if (!ghost) at.forEach((q, k) => { if (fixed[k] && inFigure.has(k)) drawPivot(g, q, unit); });
  for (const k of order) {
    const segment = run.segments[k], color = sideColor(segment.side), q = segment.points.map((n) => at[n]);
    g.strokeStyle = color; g.fillStyle = color;
    if (q.length > 1) {
      g.lineWidth = unit * 1.15;
      g.beginPath(); g.moveTo(...q[0]);
      for (const x of q.slice(1)) g.lineTo(...x);
      if (q.length > 2) { g.closePath(); g.globalAlpha = alpha * 0.18; g.fill(); g.globalAlpha = alpha; }
      g.stroke();
    } else if (!ghost) disc(g, q[0], unit * (1.1 + 1.5 * Math.cbrt(segment.mass)), color, null);
  }
  if (!ghost) {
    const done = new Set();
    for (const k of order) for (const n of run.segments[k].points) {
      if (run.segments[k].points.length < 2) continue;
      const key = at[n].map((x) => Math.round(x)).join();
      if (done.has(key)) continue;
      done.add(key);
      disc(g, at[n], unit * 0.62, colors.paper, state.hover === n || state.traced.has(n) ? colors.ink : sideColor(run.segments[k].side));
    }
    shown = at;
    drawMarkers(g, v, p, at, unit);
    if (state.hover >= 0) caption(g, at[state.hover], run.points[state.hover].name);
  }
  g.globalAlpha = 1;
}
const inFigure = new Set(run.segments.flatMap((segment) => segment.points));
function drawMarkers(g, v, p, at, unit) { // small dots with their names, a name only where no other stands
  const taken = [], width = g.canvas.clientWidth;
  g.textBaseline = "middle";
  for (const k of run.markers || []) {
    const [x, y] = at[k], text = run.points[k].name, size = g.measureText(text).width;
    if (!inFigure.has(k)) disc(g, at[k], unit * 0.45, colors.ink, colors.paper);
    if (state.hover === k) continue;
    const free = (left) => left > 0 && left + size < width && !taken.some((box) => left < box[0] + box[2] && box[0] < left + size && Math.abs(y - box[1]) < 15);
    const left = [x + 9, x - 9 - size].find(free);
    if (left === undefined) continue;
    taken.push([left, y, size]);
    g.lineWidth = 3.5; g.strokeStyle = colors.paper; g.fillStyle = colors.ink; g.textAlign = "left";
    g.strokeText(text, left, y); g.fillText(text, left, y);
  }
}
function disc(g, [x, y], r, fill, stroke) {
  g.beginPath(); g.arc(x, y, r, 0, 2 * Math.PI); g.fillStyle = fill; g.fill();
  if (stroke) { g.lineWidth = Math.max(1.4, r * 0.45); g.strokeStyle = stroke; g.stroke(); }
}
function drawPivot(g, [x, y], unit) {
  const s = unit * 2.1;
  g.fillStyle = colors.soil; g.strokeStyle = colors.ground; g.lineWidth = 1.3;
  g.beginPath(); g.moveTo(x, y); g.lineTo(x - s, y + 1.5 * s); g.lineTo(x + s, y + 1.5 * s); g.closePath(); g.fill(); g.stroke();
  g.beginPath(); g.moveTo(x - 1.5 * s, y + 1.5 * s); g.lineTo(x + 1.5 * s, y + 1.5 * s); g.stroke();
}
function caption(g, [x, y], text) {
  const width = g.measureText(text).width;
  g.fillStyle = colors.panel; g.strokeStyle = colors.line; g.lineWidth = 1;
  g.beginPath(); g.roundRect(x + 10, y - 26, width + 14, 20, 5); g.fill(); g.stroke();
  g.fillStyle = colors.ink; g.textAlign = "left"; g.textBaseline = "middle"; g.fillText(text, x + 17, y - 15.5);
}
function drawGround(g, w, h, v, ground) {
  if (run.spatial) { drawPlane(g, v, ground); return; }
  const [nx, ny] = ground.normal, d = ground.offset, tx = ny, ty = -nx; // along the line
  const s0 = v.center[0] * tx + v.center[1] * ty, reach = (w + h) / v.scale;
  const spot = (s, depth) => v.to([d * nx + s * tx - depth * nx, d * ny + s * ty - depth * ny]);
  const a = spot(s0 - reach, 0), b = spot(s0 + reach, 0), deep = (w + h) / v.scale;
  if (solid(ground)) {
    g.fillStyle = colors.soil;
    g.beginPath(); g.moveTo(...a); g.lineTo(...b); g.lineTo(...spot(s0 + reach, deep)); g.lineTo(...spot(s0 - reach, deep)); g.closePath(); g.fill();
  }
  g.strokeStyle = colors.ground; g.lineWidth = 1.6;
  g.beginPath(); g.moveTo(...a); g.lineTo(...b); g.stroke();
  const tick = nice(w / v.scale, Math.min(7, w / 95));
  g.lineWidth = 1; g.fillStyle = colors.muted; g.textAlign = "center"; g.textBaseline = "top";
  for (let s = Math.ceil((s0 - reach) / tick) * tick; s <= s0 + reach; s += tick) {
    const [x, y] = spot(s, 0), [x1, y1] = spot(s, 7 / v.scale), [x2, y2] = spot(s, 12 / v.scale);
    if (x < -60 || x > w + 60) continue;
    g.beginPath(); g.moveTo(x, y); g.lineTo(x1, y1); g.stroke();
    if (x2 > 22 && x2 < w - 22) g.fillText(label(s, tick) + " m", x2, y2);
  }
}
function solid(ground) { // whether nothing of the mechanism is ever below it; a step that is walked off is drawn as a line
  if (ground.solid === undefined) {
    const [nx, ny] = ground.normal, least = ground.offset - 0.05 * extent();
    ground.solid = run.points.every((point) => point.at[0].every((x, i) => nx * x + ny * point.at[1][i] > least));
  }
  return ground.solid;
}
function drawPlane(g, v, ground) { // a patch of a plane below the mechanism, as a grid
  const n = ground.normal, p = locate(state.t);
  const t1 = Math.abs(n[1]) > 0.5 ? unitOf([n[1], -n[0], 0]) : unitOf([-n[2], 0, n[0]]);
  const t2 = [n[1] * t1[2] - n[2] * t1[1], n[2] * t1[0] - n[0] * t1[2], n[0] * t1[1] - n[1] * t1[0]];
  const middle = [0, 1, 2].map((a) => run.points.reduce((sum, point) => sum + mix(point.at[a], p), 0) / run.points.length);
  const tick = nice(2.4 * Math.max(path.width, path.height), 8), along = (t) => Math.round((middle[0] * t[0] + middle[1] * t[1] + middle[2] * t[2]) / tick);
  const c1 = along(t1), c2 = along(t2);
  const spot = (a, b) => v.to(project([0, 1, 2].map((k) => ground.offset * n[k] + tick * (a * t1[k] + b * t2[k]))));
  g.strokeStyle = colors.line; g.lineWidth = 1;
  for (let k = -5; k <= 5; k++) {
    g.beginPath(); g.moveTo(...spot(c1 + k, c2 - 5)); g.lineTo(...spot(c1 + k, c2 + 5)); g.stroke();
    g.beginPath(); g.moveTo(...spot(c1 - 5, c2 + k)); g.lineTo(...spot(c1 + 5, c2 + k)); g.stroke();
  }
}
const unitOf = (x) => { const size = Math.hypot(...x); return x.map((c) => c / size); };

function drawTouches(g, v) { // footprints: filled while the contact is closed
  for (const touch of run.touches) {
    if (touch.begin > state.t) continue;
    const [x, y] = v.to(project(touch.where)), active = state.t <= touch.end;
    g.globalAlpha = active ? 0.9 : 0.35;
    g.strokeStyle = g.fillStyle = sideColor(touch.side);
    g.lineWidth = 1.6;
    g.beginPath(); g.ellipse(x, y, active ? 15 : 6, active ? 4.5 : 2, 0, 0, 2 * Math.PI);
    if (active) g.stroke(); else g.fill();
    g.globalAlpha = 1;
  }
}
// The usual largest force is as long as a third of the mechanism; short peaks are cut at half of it.
const usual = (() => {
  const sizes = run.pushes.flatMap((push) => Array.from(time, (_, i) => Math.hypot(...push.force.map((axis) => axis[i])))).filter((x) => x > 0).sort((a, b) => a - b);
  return sizes.length ? sizes[Math.floor(0.95 * (sizes.length - 1))] : 0;
})();
function drawPushes(g, w, h, v, p) { // forces of the ground on the feet
  if (!usual) return;
  const [x0, y0, x1, y1] = path.all, most = Math.max(extent(), el("follow").checked ? 0 : 0.4 * Math.max(x1 - x0, y1 - y0)) / 3, unit = most / usual;
  for (const push of run.pushes) {
    const force = push.force.map((axis) => mix(axis, p)), size = Math.hypot(...force);
    if (size < 0.005 * usual) continue;
    const at = push.at.map((axis) => mix(axis, p)), length = unit * Math.min(1, (1.5 * usual) / size);
    drawArrow(g, v.to(project(at)), v.to(project(at.map((x, k) => x + length * force[k]))));
  }
  const round = roundDown(usual), px = round * unit * v.scale, x = w - 16 - px, y = h - 18;
  drawArrow(g, [x, y], [x + px, y]);
  g.fillStyle = colors.muted; g.textAlign = "center"; g.textBaseline = "bottom"; g.fillText(label(round, round) + " N", x + px / 2, y - 5);
}
function drawArrow(g, [x0, y0], [x1, y1]) {
  const size = Math.hypot(x1 - x0, y1 - y0), head = Math.min(9, 0.45 * size), ux = (x1 - x0) / size, uy = (y1 - y0) / size;
  if (size < 2) return;
  g.strokeStyle = g.fillStyle = colors.force; g.lineWidth = 2.4;
  g.beginPath(); g.moveTo(x0, y0); g.lineTo(x1 - 0.7 * head * ux, y1 - 0.7 * head * uy); g.stroke();
  g.beginPath(); g.moveTo(x1, y1); g.lineTo(x1 - head * ux + 0.45 * head * uy, y1 - head * uy - 0.45 * head * ux);
  g.lineTo(x1 - head * ux - 0.45 * head * uy, y1 - head * uy + 0.45 * head * ux); g.closePath(); g.fill();
}
function drawTraces(g, v, p) {
  for (const k of state.traced) {
    const owner = run.segments.find((segment) => segment.points.includes(k));
    g.strokeStyle = sideColor(owner ? owner.side : ""); g.lineWidth = 1.5; g.globalAlpha = 0.7;
    g.beginPath();
    for (let i = 0; i <= p.i; i++) { const q = v.to(project(run.points[k].at.map((axis) => axis[i]))); if (i) g.lineTo(...q); else g.moveTo(...q); }
    g.lineTo(...v.to(pointAt(k, p))); g.stroke();
    g.globalAlpha = 1;
  }
}
function drawScale(g, w, h, v) {
  if (run.grounds.length && !run.spatial) return;
  const size = nice(w / v.scale, 7), px = size * v.scale;
  g.strokeStyle = colors.muted; g.lineWidth = 1.2; g.beginPath();
  g.moveTo(14, h - 20); g.lineTo(14, h - 14); g.lineTo(14 + px, h - 14); g.lineTo(14 + px, h - 20); g.stroke();
  g.fillStyle = colors.muted; g.textAlign = "center"; g.textBaseline = "bottom";
  g.fillText(label(size, size) + " m", 14 + px / 2, h - 17);
}
