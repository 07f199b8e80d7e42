// What pictures of planar and spatial mechanisms share; `project`, `survey`, `view` and `drawScene` are flat.js's or space.js's.
// ---- geometry -----------------------------------------------------------------------------------------------
let path = null; // where the mechanism is over time: what the camera follows and fits
const placeOf = (k, p) => run.points[k].at.map((axis) => mix(axis, p));
const pointAt = (k, p) => project(placeOf(k, p));
function smooth(values) { // a straight line with the mean over a window, so that the camera does not rock with each step
  const half = Math.max(1, Math.round(time.length * Math.min(0.25, 0.6 / span))), n = values.length, sums = [0];
  for (let i = 0; i < n; i++) sums.push(sums[i] + values[i]);
  return Float64Array.from(values, (_, i) => {
    const reach = Math.min(half, i, n - 1 - i), a = i - reach, b = i + reach;
    return (sums[b + 1] - sums[a]) / (b - a + 1);
  });
}
const unitOf = (x) => { const size = Math.hypot(...x); return x.map((c) => c / size); };

// ---- parts of pictures --------------------------------------------------------------------------------------
let shown = []; // pixels of the points
const order = run.segments.map((s, k) => [{ left: 0, "": 1, right: 2 }[s.side], k]).sort((a, b) => a[0] - b[0] || a[1] - b[1]).map((x) => x[1]);
const fixed = run.points.map((point) => point.at.every((axis) => axis.every((x) => x === axis[0])));

const inFigure = new Set(run.segments.flatMap((segment) => segment.points));
function drawMarkers(g, v, p, at, unit) { // small dots with their names, a name only where no other stands
  const taken = [], width = g.canvas.clientWidth;
  g.textBaseline = "middle";
  for (const k of run.markers || []) {
    const [x, y] = at[k], text = run.points[k].name, size = g.measureText(text).width;
    if (!inFigure.has(k)) disc(g, at[k], unit * 0.45, colors.ink, colors.paper);
    if (state.hover === k || !el("names").checked) continue;
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
function caption(g, [x, y], text) {
  const width = g.measureText(text).width;
  g.fillStyle = colors.panel; g.strokeStyle = colors.line; g.lineWidth = 1;
  g.beginPath(); g.roundRect(x + 10, y - 26, width + 14, 20, 5); g.fill(); g.stroke();
  g.fillStyle = colors.ink; g.textAlign = "left"; g.textBaseline = "middle"; g.fillText(text, x + 17, y - 15.5);
}
// The usual largest force is as long as a third of the mechanism; short peaks are cut at half of it.
const usual = (() => {
  const sizes = run.pushes.flatMap((push) => Array.from(time, (_, i) => Math.hypot(...push.force.map((axis) => axis[i])))).filter((x) => x > 0).sort((a, b) => a - b);
  return sizes.length ? sizes[Math.floor(0.95 * (sizes.length - 1))] : 0;
})();
function drawScale(g, w, h, v) {
  if (run.grounds.length && !run.spatial) return;
  const size = nice(w / v.scale, 7), px = size * v.scale;
  g.strokeStyle = colors.muted; g.lineWidth = 1.2; g.beginPath();
  g.moveTo(14, h - 20); g.lineTo(14, h - 14); g.lineTo(14 + px, h - 14); g.lineTo(14 + px, h - 20); g.stroke();
  g.fillStyle = colors.muted; g.textAlign = "center"; g.textBaseline = "bottom";
  g.fillText(label(size, size) + " m", 14 + px / 2, h - 17);
}
