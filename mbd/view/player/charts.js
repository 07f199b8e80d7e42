// Quantities and contacts over time, below the mechanism.
// ---- quantities and contacts over time ----------------------------------------------------------------------
const widest = (() => { const g = document.createElement("canvas").getContext("2d"); g.font = "12px system-ui, sans-serif"; return Math.max(52, ...run.contacts.map((c) => g.measureText(c.name).width + 12)); })();
const gutter = Math.min(widest, 170), pad = 10;
const toX = (t, w) => gutter + ((t - first) / span) * (w - gutter - pad);
const toTime = (x, w) => Math.min(Math.max(first + ((x - gutter) / (w - gutter - pad)) * span, first), last);

// Strides of a contact: from one touchdown to its next, as gait laboratories draw them, 0 to 100 %.
const strides = run.contacts.map((contact) => {
  const begins = contact.foot ? contact.closed.map((pair) => pair[0]).filter((t) => t > first) : [];
  return begins.slice(1).map((end, k) => [begins[k], end]);
});
function cycle() { // the strides chosen, and which of them is now or was last; none: over time
  const all = state.over < 0 ? [] : strides[state.over];
  return { all, now: all[Math.max(0, all.filter(([begin]) => begin <= state.t).length - 1)] };
}
const share = ([a, b], t) => Math.min(Math.max((t - a) / (b - a), 0), 1);
const onStride = (s, w) => gutter + s * (w - gutter - pad);

function drawCursor(g, w, y0, y1, x = toX(state.t, w)) {
  g.strokeStyle = colors.ink; g.lineWidth = 1.2; g.beginPath(); g.moveTo(x, y0); g.lineTo(x, y1); g.stroke();
}
function drawLines(g, w, h, chart, large) {
  let low = Infinity, high = -Infinity;
  for (const line of chart.series) for (const x of line.values) { low = Math.min(low, x); high = Math.max(high, x); }
  if (!(high > low)) { low -= 0.5; high += 0.5; }
  const top = large ? 46 : 8, { all, now } = large ? { all: [] } : cycle(), bottom = h - (large || now || !run.contacts.length ? 24 : 8);
  const toY = (x) => bottom - ((x - low) / (high - low)) * (bottom - top);
  const tick = nice(high - low, (bottom - top) / 34);
  g.textAlign = "right"; g.textBaseline = "middle"; g.lineWidth = 1;
  for (let x = Math.ceil(low / tick) * tick; x <= high + 1e-9 * tick; x += tick) {
    g.strokeStyle = colors.line; g.beginPath(); g.moveTo(gutter, toY(x)); g.lineTo(w - pad, toY(x)); g.stroke();
    g.fillStyle = colors.muted; g.fillText(label(x, tick).replace("-", "\u2212"), gutter - 8, toY(x));
  }
  if (now) { drawStrides(g, w, top, bottom, chart, all, now, toY); return; }
  if (large || !run.contacts.length) drawTimes(g, w, top, bottom);
  const stride = Math.max(1, Math.floor(time.length / (4 * w)));
  for (const line of chart.series) {
    g.strokeStyle = lineColor(line.color); g.lineWidth = line.color === "ink" ? 1.9 : 1.5; g.beginPath();
    for (let i = 0; i < time.length; i += stride) { const x = toX(time[i], w), y = toY(line.values[i]); if (i) g.lineTo(x, y); else g.moveTo(x, y); }
    g.stroke();
  }
  drawCursor(g, w, top - 4, bottom + 4);
  const p = locate(state.t);
  let x = gutter;
  for (const line of large ? chart.series : []) {
    disc(g, [x + 5, 20], 4, lineColor(line.color), null);
    g.fillStyle = colors.ink; g.textAlign = "left"; g.textBaseline = "middle"; g.fillText(line.name, x + 14, 20);
    x += g.measureText(line.name).width + 30;
  }
  for (const line of chart.series) disc(g, [toX(state.t, w), toY(mix(line.values, p))], 3.2, lineColor(line.color), null);
}
function drawStrides(g, w, top, bottom, chart, all, now, toY) { // the present stride strong, the others faint
  g.textAlign = "center"; g.textBaseline = "top"; g.lineWidth = 1;
  for (let s = 0; s <= 5; s++) {
    const x = onStride(s / 5, w);
    g.strokeStyle = colors.line; g.beginPath(); g.moveTo(x, top); g.lineTo(x, bottom); g.stroke();
    g.fillStyle = colors.muted; g.fillText(20 * s + " %", Math.min(x, w - 20), bottom + 6);
  }
  for (const stride of [...all.filter((each) => each !== now), now]) for (const line of chart.series) {
    g.strokeStyle = lineColor(line.color); g.lineWidth = line.color === "ink" ? 1.9 : 1.5; g.globalAlpha = stride === now ? 1 : 0.22; g.beginPath();
    const begin = locate(stride[0]).i;
    for (let i = begin; i < time.length; i++) {
      const x = onStride(share(stride, time[i]), w), y = toY(line.values[i]);
      if (i > begin) g.lineTo(x, y); else g.moveTo(x, y);
      if (time[i] >= stride[1]) break;
    }
    g.stroke();
  }
  g.globalAlpha = 1;
  const inside = now[0] <= state.t && state.t <= now[1], x = onStride(share(now, state.t), w), p = locate(state.t);
  if (!inside) return;
  drawCursor(g, w, top - 4, bottom + 4, x);
  for (const line of chart.series) disc(g, [x, toY(mix(line.values, p))], 3.2, lineColor(line.color), null);
}
function drawTimes(g, w, top, bottom) {
  const tick = nice(span, w / 110);
  g.textAlign = "center"; g.textBaseline = "top"; g.lineWidth = 1;
  for (let t = Math.ceil(first / tick) * tick; t <= last + 1e-9 * tick; t += tick) {
    g.strokeStyle = colors.line; g.beginPath(); g.moveTo(toX(t, w), top); g.lineTo(toX(t, w), bottom); g.stroke();
    g.fillStyle = colors.muted; g.fillText(label(t, tick) + " s", Math.min(toX(t, w), w - 2 - g.measureText(label(t, tick) + " s").width / 2), bottom + 6);
  }
}
const barHeight = Math.max(9, Math.min(19, 130 / Math.max(run.contacts.length, 1)));
el("bars").style.height = run.contacts.length ? run.contacts.length * barHeight + 28 + "px" : "0";
function drawBars() {
  if (!run.contacts.length) return;
  const { g, w, h } = prepare(el("bars"));
  drawTimes(g, w, 0, h - 22);
  run.contacts.forEach((contact, k) => {
    const y = k * barHeight + 3, on = contact.closed.some(([a, b]) => a <= state.t && state.t <= b);
    g.fillStyle = sideColor(contact.side);
    for (const [a, b] of contact.closed) { g.globalAlpha = on && a <= state.t && state.t <= b ? 1 : 0.55; g.beginPath(); g.roundRect(toX(a, w), y, Math.max(toX(b, w) - toX(a, w), 1), barHeight - 4, 2.5); g.fill(); }
    g.globalAlpha = 1;
    g.fillStyle = on ? colors.ink : colors.muted; g.textAlign = "right"; g.textBaseline = "middle";
    g.fillText(contact.name, gutter - 8, y + barHeight / 2 - 1, gutter - 10);
  });
  drawCursor(g, w, 0, h - 18);
}
const digits = (x) => (Math.abs(x) >= 1000 && Math.abs(x) < 1e6 ? x.toFixed(0) : x.toPrecision(3)).replace("-", "\u2212");
function writeLegend() {
  const chart = run.charts[state.chart], p = locate(state.t), unit = chart.unit ? ` ${chart.unit}` : "";
  chart.series.forEach((line, k) => { el("legend").children[k].lastChild.textContent = ` ${line.name} ${digits(mix(line.values, p))}${unit}`; });
}
function chooseChart(k) {
  state.chart = k;
  const lines = run.charts[k].series.map((line) => { const item = document.createElement("span"), mark = document.createElement("i"); mark.style.background = lineColor(line.color); item.append(mark, ""); item.append(" "); return item; });
  el("legend").replaceChildren(...lines);
  state.dirty = true;
}
