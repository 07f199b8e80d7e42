// A planar mechanism on its canvas, and the grounds, wheels and blades around it.
// ---- camera -------------------------------------------------------------------------------------------------
const project = ([x, y]) => [x, y];
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
      if (soleOf(wheel)) continue;
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
const travels = () => path.width > 0 && path.all[2] - path.all[0] > 2.2 * path.width; // whether it moves on
function dragged(dx, dy) { camera.dx += dx; camera.dy += dy; }
function resetCamera() { Object.assign(camera, { zoom: 1, dx: 0, dy: 0 }); state.dirty = true; }
const cameraHint = " \u00B7 wheel: zoom \u00B7 drag: shift \u00B7 0: fit";
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
function drawPivot(g, [x, y], unit) {
  const s = unit * 2.1;
  g.fillStyle = colors.soil; g.strokeStyle = colors.ground; g.lineWidth = 1.3;
  g.beginPath(); g.moveTo(x, y); g.lineTo(x - s, y + 1.5 * s); g.lineTo(x + s, y + 1.5 * s); g.closePath(); g.fill(); g.stroke();
  g.beginPath(); g.moveTo(x - 1.5 * s, y + 1.5 * s); g.lineTo(x + 1.5 * s, y + 1.5 * s); g.stroke();
}
function drawGround(g, w, h, v, ground) {
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
    const legend = usual && y2 > h - 50 && x2 > w - 190; // where the arrow of a force is explained
    if (x2 > 22 && x2 < w - 22 && !legend) g.fillText(label(s, tick) + " m", x2, y2);
  }
}
function solid(ground) { // whether nothing of the mechanism is ever below it; a step that is walked off is drawn as a line
  if (ground.solid === undefined) {
    const [nx, ny] = ground.normal, least = ground.offset - 0.05 * extent();
    ground.solid = run.points.every((point) => point.at[0].every((x, i) => nx * x + ny * point.at[1][i] > least));
  }
  return ground.solid;
}
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
  g.textAlign = "center"; g.textBaseline = "bottom"; g.lineWidth = 4; g.strokeStyle = colors.paper; g.fillStyle = colors.muted;
  g.strokeText(label(round, round) + " N", x + px / 2, y - 5); g.fillText(label(round, round) + " N", x + px / 2, y - 5);
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

// Grounds that move, height functions, wheels and blades.
function drawSheet(g, w, h, v, sheet) { // ground of a given height: a curve with soil below it
  const p = locate(state.t, sheet.times);
  for (const line of sheet.lines) {
    const a = line.at[p.i], b = line.at[p.j], q = [];
    for (let k = 0; k < line.count; k++) q.push(v.to(project(a.map((axis, n) => axis[k] + p.w * (b[n][k] - axis[k])))));
    const deep = w + h; // pixels, straight down
    g.fillStyle = colors.soil; g.beginPath(); g.moveTo(q[0][0], q[0][1] + deep);
    for (const x of q) g.lineTo(...x);
    g.lineTo(q[q.length - 1][0], q[q.length - 1][1] + deep); g.closePath(); g.fill();
    g.strokeStyle = colors.ground; g.lineWidth = 1.6;
    g.beginPath(); q.forEach((x, k) => (k ? g.lineTo(...x) : g.moveTo(...x))); g.stroke();
  }
}
function drawDeck(g, w, h, v, p, deck) { // a plane that moves; its marks move along with it
  const [at, normal, along] = [deck.at, deck.normal, deck.along].map((part) => part.map((axis) => mix(axis, p)));
  const reach = (w + h) / v.scale, tick = nice(w / v.scale, 14), depth = 9 / v.scale;
  const s0 = (v.center[0] - at[0]) * along[0] + (v.center[1] - at[1]) * along[1];
  const spot = (s, deep) => v.to([0, 1].map((k) => at[k] + s * along[k] - deep * normal[k]));
  g.strokeStyle = colors.ground; g.lineWidth = 1.6;
  g.beginPath(); g.moveTo(...spot(s0 - reach, 0)); g.lineTo(...spot(s0 + reach, 0)); g.stroke();
  g.lineWidth = 1; g.beginPath();
  for (let s = Math.ceil((s0 - reach) / tick) * tick; s <= s0 + reach; s += tick) { g.moveTo(...spot(s, 0)); g.lineTo(...spot(s - depth, depth)); }
  g.stroke();
}
// The part of a rim that faces the ground in this run, if the wheel never turns by half a turn: a curved foot.
function soleOf(wheel) { // [from, to] as angles of the rim; null for a wheel that rolls on
  if (wheel.sole === undefined) {
    const [nx, ny] = run.grounds.length ? run.grounds[0].normal : [0, 1], angles = [];
    for (let i = 0; i < time.length; i++) {
      const [sx, sy, dx, dy] = [wheel.spoke[0][i], wheel.spoke[1][i], wheel.down[0][i], wheel.down[1][i]];
      const angle = Math.atan2(-(nx * dx + ny * dy), -(nx * sx + ny * sy)), turn = 2 * Math.PI;
      angles.push(i ? angle + turn * Math.round((angles[i - 1] - angle) / turn) : angle);
    }
    const low = Math.min(...angles), high = Math.max(...angles);
    wheel.sole = high - low < Math.PI ? [low - 0.1, high + 0.1] : null;
  }
  return wheel.sole;
}
function drawWheel(g, v, p, wheel) { // its rim and a spoke that turns with it; of a curved foot its sole
  const [at, spoke, down] = [wheel.at, wheel.spoke, wheel.down].map((part) => part.map((axis) => mix(axis, p)));
  const r = mix(wheel.radius, p), rim = (angle) => v.to(project(at.map((x, k) => x + r * (Math.cos(angle) * spoke[k] + Math.sin(angle) * down[k]))));
  const color = sideColor(wheel.side), sole = soleOf(wheel), [from, to] = sole || [0, 2 * Math.PI];
  g.beginPath();
  for (let k = 0; k <= 64; k++) { const q = rim(from + ((to - from) * k) / 64); if (k) g.lineTo(...q); else g.moveTo(...q); }
  g.strokeStyle = g.fillStyle = color; g.lineWidth = sole ? 3.6 : 2.6; g.stroke();
  if (sole) { g.lineTo(...v.to(project(at))); g.closePath(); } // a wedge whose tip is the center of the curvature
  g.globalAlpha = 0.12; g.fill(); g.globalAlpha = 1;
  if (sole) { g.lineWidth = 1.2; g.stroke(); return; }
  g.lineWidth = 2; g.beginPath(); g.moveTo(...v.to(project(at))); g.lineTo(...rim(0)); g.stroke();
}
function drawBlade(g, v, p, blade) { // a dark line along which it moves
  const [at, along] = [blade.at, blade.along].map((part) => part.map((axis) => mix(axis, p)));
  const length = Math.max(0.08 * extent(), 16 / v.scale);
  g.strokeStyle = colors.ink; g.lineWidth = 4;
  g.beginPath(); g.moveTo(...v.to(project(at.map((x, k) => x - length * along[k])))); g.lineTo(...v.to(project(at.map((x, k) => x + length * along[k])))); g.stroke();
}
