// Grounds that move, height functions, wheels and blades.
function drawSheet(g, w, h, v, sheet) { // ground of a given height: a curve with soil below it, or a patch of lines
  const p = locate(state.t, sheet.times);
  for (const line of sheet.lines) {
    const a = line.at[p.i], b = line.at[p.j], q = [];
    for (let k = 0; k < line.count; k++) q.push(v.to(project(a.map((axis, n) => axis[k] + p.w * (b[n][k] - axis[k])))));
    if (!run.spatial) {
      const deep = w + h; // pixels, straight down
      g.fillStyle = colors.soil; g.beginPath(); g.moveTo(q[0][0], q[0][1] + deep);
      for (const x of q) g.lineTo(...x);
      g.lineTo(q[q.length - 1][0], q[q.length - 1][1] + deep); g.closePath(); g.fill();
    }
    g.strokeStyle = run.spatial ? colors.line : colors.ground; g.lineWidth = run.spatial ? 1 : 1.6;
    g.beginPath(); q.forEach((x, k) => (k ? g.lineTo(...x) : g.moveTo(...x))); g.stroke();
  }
}
function drawDeck(g, w, h, v, p, deck) { // a plane that moves; its marks move along with it
  const [at, normal, along] = [deck.at, deck.normal, deck.along].map((part) => part.map((axis) => mix(axis, p)));
  if (run.spatial) { drawPatch(g, v, p, at, normal, along); return; }
  const reach = (w + h) / v.scale, tick = nice(w / v.scale, 14), depth = 9 / v.scale;
  const s0 = (v.center[0] - at[0]) * along[0] + (v.center[1] - at[1]) * along[1];
  const spot = (s, deep) => v.to([0, 1].map((k) => at[k] + s * along[k] - deep * normal[k]));
  g.strokeStyle = colors.ground; g.lineWidth = 1.6;
  g.beginPath(); g.moveTo(...spot(s0 - reach, 0)); g.lineTo(...spot(s0 + reach, 0)); g.stroke();
  g.lineWidth = 1; g.beginPath();
  for (let s = Math.ceil((s0 - reach) / tick) * tick; s <= s0 + reach; s += tick) { g.moveTo(...spot(s, 0)); g.lineTo(...spot(s - depth, depth)); }
  g.stroke();
}
function drawPatch(g, v, p, at, normal, along) { // lines of the plane's material around the mechanism
  const across = [0, 1, 2].map((k) => along[(k + 1) % 3] * normal[(k + 2) % 3] - along[(k + 2) % 3] * normal[(k + 1) % 3]);
  const middle = [0, 1, 2].map((a) => run.points.reduce((sum, point) => sum + mix(point.at[a], p), 0) / run.points.length);
  const tick = nice(2.4 * extent(), 8);
  const near = (t) => Math.round(middle.reduce((sum, x, k) => sum + (x - at[k]) * t[k], 0) / tick);
  const c1 = near(along), c2 = near(across);
  const spot = (a, b) => v.to(project([0, 1, 2].map((k) => at[k] + tick * (a * along[k] + b * across[k]))));
  g.strokeStyle = colors.line; g.lineWidth = 1;
  for (let k = -5; k <= 5; k++) {
    g.beginPath(); g.moveTo(...spot(c1 + k, c2 - 5)); g.lineTo(...spot(c1 + k, c2 + 5)); g.stroke();
    g.beginPath(); g.moveTo(...spot(c1 - 5, c2 + k)); g.lineTo(...spot(c1 + 5, c2 + k)); g.stroke();
  }
}
function drawWheel(g, v, p, wheel) { // its rim and a spoke that turns with it
  const [at, spoke, down] = [wheel.at, wheel.spoke, wheel.down].map((part) => part.map((axis) => mix(axis, p)));
  const r = mix(wheel.radius, p), rim = (angle) => v.to(project(at.map((x, k) => x + r * (Math.cos(angle) * spoke[k] + Math.sin(angle) * down[k]))));
  const color = sideColor(wheel.side);
  g.beginPath();
  for (let k = 0; k <= 64; k++) { const q = rim((k * Math.PI) / 32); if (k) g.lineTo(...q); else g.moveTo(...q); }
  g.globalAlpha = 0.12; g.fillStyle = color; g.fill(); g.globalAlpha = 1;
  g.strokeStyle = color; g.lineWidth = 2.6; g.stroke();
  g.lineWidth = 2; g.beginPath(); g.moveTo(...v.to(project(at))); g.lineTo(...rim(0)); g.stroke();
}
function drawBlade(g, v, p, blade) { // a dark line along which it moves
  const [at, along] = [blade.at, blade.along].map((part) => part.map((axis) => mix(axis, p)));
  const length = Math.max(0.08 * extent(), 16 / v.scale);
  g.strokeStyle = colors.ink; g.lineWidth = 4;
  g.beginPath(); g.moveTo(...v.to(project(at.map((x, k) => x - length * along[k])))); g.lineTo(...v.to(project(at.map((x, k) => x + length * along[k])))); g.stroke();
}
