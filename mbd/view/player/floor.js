// Grounds of a spatial scene: planes with a grid and shadows straight below, planes that move, surfaces of given height.
function floors(p) { // planes at rest and moving; without any ground a grid below the motion, for depth
  const up = [0, 1, 0];
  const found = run.grounds.map(({ normal, offset }) => ({ normal, offset, at: normal.map((x) => x * offset), along: Math.abs(normal[1]) > 0.5 ? unitOf([normal[1], -normal[0], 0]) : unitOf([-normal[2], 0, normal[0]]), solid: true }));
  for (const deck of run.decks) {
    const at = here(deck.at, p), normal = unitOf(here(deck.normal, p));
    found.push({ normal, offset: dot(normal, at), at, along: unitOf(here(deck.along, p)), solid: true });
  }
  if (!found.length && !run.sheets.length && el("floor").checked) {
    const height = path.low[1] - 0.12 * extent();
    found.push({ normal: up, offset: height, at: [0, height, 0], along: [1, 0, 0], solid: false });
  }
  return found;
}
function shadowTint(share) {
  const paper = tint(colors.paper), ink = tint(colors.ink);
  return paper[0] < 0.5 ? blend(paper, [0, 0, 0], 0.6) : blend(paper, ink, share);
}
function drawFloor(v, floor, solids) { // a round patch that fades, shadows on it, lines of its material
  const { normal, offset, at, along } = floor, across = cross(along, normal), tick = nice(2.4 * extent(), 8), reach = 5.5 * tick;
  const paper = tint(colors.paper), ink = tint(colors.ink), from = plus(v.center, at, -1), a0 = dot(from, along), c0 = dot(from, across);
  const spot = (a, c) => seen([0, 1, 2].map((k) => at[k] + a * along[k] + c * across[k]));
  if (dot(eye[2], normal) > 0.02) {
    const fill = blend(paper, ink, 0.055), shade = shadowTint(floor.solid ? 0.2 : 0.15), opacity = floor.solid ? 0.94 : 0.5, rings = [0, 0.55, 1], rim = (k, q) => spot(a0 + rings[k] * reach * Math.cos(q), c0 + rings[k] * reach * Math.sin(q));
    for (let n = 0; n < 48; n++) {
      const q = (n * Math.PI) / 24, s = ((n + 1) * Math.PI) / 24, ends = [opacity, opacity, 0];
      floorFacets.triangle(rim(0, q), rim(1, q), rim(1, s), fill, opacity);
      for (const [k, angle] of [[1, q], [2, q], [1, s], [1, s], [2, q], [2, s]]) floorFacets.corner(rim(k, angle), fill, ends[k]);
    }
    if (normal[1] > 0.2) for (const solid of solids) addShadow(solid, floor, shade);
  }
  const color = blend(paper, ink, 0.26), fade = (a, c) => Math.max(0, 1 - ((a - a0) ** 2 + (c - c0) ** 2) / reach ** 2), width = 1 / v.scale;
  const line = (a, c, b, d) => fade(a, c) + fade(b, d) > 0 && ribbon(floorFacets, spot(a, c), spot(b, d), width, color, fade(a, c), fade(b, d), 2e-4 * extent());
  const nearA = Math.round(a0 / tick), nearC = Math.round(c0 / tick);
  for (let k = -5; k <= 5; k++) for (let n = -6; n < 6; n++) {
    line((nearA + k) * tick, (nearC + n) * tick, (nearA + k) * tick, (nearC + n + 1) * tick);
    line((nearA + n) * tick, (nearC + k) * tick, (nearA + n + 1) * tick, (nearC + k) * tick);
  }
}
function heightOf(places, rows, count) { // of a ground of given height, between its corners; NaN beside it
  const last = rows * count - 1, [x0, , z0] = places[0], [x1, , z1] = places[last], wide = (x1 - x0) / (count - 1), deep = (z1 - z0) / (rows - 1);
  return ([x, , z]) => {
    const s = (x - x0) / wide, t = (z - z0) / deep, i = Math.min(Math.floor(s), count - 2), j = Math.min(Math.floor(t), rows - 2);
    if (!(s >= 0 && t >= 0 && s <= count - 1 && t <= rows - 1)) return NaN;
    const k = j * count + i, a = s - i, b = t - j;
    return (1 - b) * ((1 - a) * places[k][1] + a * places[k + 1][1]) + b * ((1 - a) * places[k + count][1] + a * places[k + count + 1][1]);
  };
}
function drawSheet(v, sheet, solids) { // ground of a given height, with every second line of its corners
  const p = locate(state.t, sheet.times), a = sheet.risen[p.i], b = sheet.risen[p.j], { rows, count } = sheet, holes = new Set(sheet.holes);
  const places = [], pixels = [], fill = blend(tint(colors.paper), tint(colors.ink), 0.1), color = blend(tint(colors.paper), tint(colors.ink), 0.3), width = 1 / v.scale;
  for (let k = 0; k < rows * count; k++) { const rise = a[k] + p.w * (b[k] - a[k]); places.push([0, 1, 2].map((n) => sheet.at[n][k] + rise * sheet.up[n])); pixels.push(seen(places[k])); }
  const heightAt = heightOf(places, rows, count), apart = (places[count - 1][0] - places[0][0]) / (count - 1);
  if (sheet.up[1] > 1 - 1e-9) for (const solid of solids) addCurvedShadow(solid, heightAt, apart, 3e-3 * extent(), shadowTint(0.32));
  const there = (...corners) => !corners.some((k) => holes.has(k)), nearer = 2e-3 * extent();
  for (let j = 0; j < rows; j++) for (let i = 0; i < count; i++) {
    const k = j * count + i;
    if (i + 1 < count && j + 1 < rows && there(k, k + 1, k + count, k + count + 1)) {
      facet(places[k], places[k + 1], places[k + count + 1], fill); facet(places[k], places[k + count + 1], places[k + count], fill);
    }
    if (i + 1 < count && there(k, k + 1)) ribbon(floorFacets, pixels[k], pixels[k + 1], width, color, 1, 1, nearer);
    if (j + 1 < rows && i % 2 === 0 && there(k, k + count)) ribbon(floorFacets, pixels[k], pixels[k + count], width, color, 1, 1, nearer);
  }
}
function footprints(r) { // where feet touched; bright while they do
  const normal = run.grounds.length ? run.grounds[0].normal : [0, 1, 0], [x, y] = axesAlong(normal);
  for (const touch of run.touches) {
    if (touch.begin > state.t) continue;
    const active = state.t <= touch.end, size = (active ? 2.6 : 1.5) * r, color = tint(sideColor(touch.side)), middle = seen(touch.where);
    const rim = (k) => seen(plus(plus(touch.where, x, size * Math.cos((k * Math.PI) / 9)), y, size * Math.sin((k * Math.PI) / 9)));
    for (let k = 0; k < 18; k++) floorFacets.triangle(middle, rim(k), rim(k + 1), color, active ? 0.55 : 0.3);
  }
}
// ---- beside it ----------------------------------------------------------------------------------------------
function drawForceScale(g, w, h, v) {
  const round = roundDown(usual), px = round * longest() * v.scale, x = w - 16 - px, y = h - 18;
  g.strokeStyle = g.fillStyle = colors.force; g.lineWidth = 2.4;
  g.beginPath(); g.moveTo(x, y); g.lineTo(x + px, y); g.moveTo(x + px - 6, y - 4); g.lineTo(x + px, y); g.lineTo(x + px - 6, y + 4); g.stroke();
  g.fillStyle = colors.muted; g.textAlign = "center"; g.textBaseline = "bottom"; g.fillText(label(round, round) + " N", x + px / 2, y - 5);
}
function drawAxes(g, h) { // of the ground, the farthest first
  const tips = run.axes.map((axis, k) => ["xyz"[k], project(axis)]).sort((a, b) => a[1][2] - b[1][2]), x = 40, y = h - 68;
  g.textAlign = "center"; g.textBaseline = "middle"; g.lineWidth = 1.6;
  for (const [name, tip] of tips) {
    g.globalAlpha = tip[2] < -0.3 ? 0.55 : 1; g.strokeStyle = g.fillStyle = colors.muted;
    g.beginPath(); g.moveTo(x, y); g.lineTo(x + 20 * tip[0], y - 20 * tip[1]); g.stroke();
    if (Math.hypot(tip[0], tip[1]) > 0.2) g.fillText(name, x + 29 * tip[0], y - 29 * tip[1]);
  }
  g.globalAlpha = 1;
}
