// A spatial mechanism: how it is seen, and what of it is drawn.
const sequence = (part) => part.map((axis) => unpack(axis));
for (const solid of run.solids) { solid.at = sequence(solid.at); solid.turn = sequence(solid.turn); solid.formed = formed(solid.kind, solid.half); }
for (const hinge of run.hinges) { hinge.at = sequence(hinge.at); hinge.axis = sequence(hinge.axis); }
for (const sheet of run.sheets) {
  const size = sheet.rows * sheet.count;
  sheet.at = sheet.at.map((axis) => unpack(axis, size)); sheet.risen = [new Float64Array(size), ...sheet.risen.map((heights) => unpack(heights, size))];
}
for (const cone of run.cones) { cone.at = sequence(cone.at); cone.axis = sequence(cone.axis); cone.contact = run.contacts.find((contact) => contact.name === cone.name); }
const here = (part, p) => part.map((axis) => mix(axis, p));

// ---- camera -------------------------------------------------------------------------------------------------
// Parallel rays: right, up and toward the viewer as rows, as mbd/view/camera.py has them.
let eye = null, origin = [0, 0, 0];
function look() {
  const cy = Math.cos(camera.yaw), sy = Math.sin(camera.yaw), cp = Math.cos(camera.pitch), sp = Math.sin(camera.pitch);
  eye = [[cy, 0, sy], [sp * sy, cp, -sp * cy], [-cp * sy, sp, cp * cy]];
}
const project = (p) => [dot(eye[0], p), dot(eye[1], p), dot(eye[2], p)];
[camera.yaw, camera.pitch] = run.views.reset;
look();
function survey() { // the center over time, and how far anything is from it: the same for every direction of the camera
  const things = [...run.points.map((point) => [point.at, 0]), ...run.solids.map((solid) => [solid.at, Math.hypot(...solid.half)]), ...[...run.wheels, ...run.balls].map((round) => [round.at, round.radius[0]])];
  const n = time.length, raw = [0, 1, 2].map(() => new Float64Array(n)), low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < n; i++) for (let a = 0; a < 3; a++) {
    let least = Infinity, most = -Infinity;
    for (const [at, reach] of things) { least = Math.min(least, at[a][i] - reach); most = Math.max(most, at[a][i] + reach); }
    raw[a][i] = (least + most) / 2; low[a] = Math.min(low[a], least); high[a] = Math.max(high[a], most);
  }
  const center = raw.map(smooth), middle = low.map((x, a) => (x + high[a]) / 2);
  const farthest = (from) => things.reduce((far, [at, reach]) => at[0].reduce((most, _, i) => Math.max(most, Math.hypot(...at.map((axis, a) => axis[i] - from(a, i))) + reach), far), 0);
  const whole = Math.max(farthest((a) => middle[a]), 1e-9), radius = Math.max(farthest((a, i) => center[a][i]), 0.2 * whole);
  path = { center, radius, whole, middle, low };
}
const extent = () => 2 * path.radius;
const travels = () => path.whole > 2.2 * path.radius;
function view(w, h, p) {
  const follow = el("follow").checked, center = follow ? here(path.center, p) : path.middle;
  const scale = (camera.zoom * (Math.min(w, h) - 48)) / (2.1 * (follow ? path.radius : path.whole)), middle = [w / 2 + camera.dx, h / 2 + camera.dy];
  origin = project(center);
  return { scale, middle, center, to: ([x, y]) => [middle[0] + scale * (x - origin[0]), middle[1] - scale * (y - origin[1])] };
}

// ---- the mechanism ------------------------------------------------------------------------------------------
const solidOf = new Map(run.solids.map((solid) => [solid.body, solid]));
let theme = "";
function drawScene() {
  const { g, w, h } = prepare(el("scene")), p = locate(state.t), v = view(w, h, p), r = 0.016 * extent();
  if (theme !== colors.paper) { theme = colors.paper; tints.clear(); }
  for (const facets of [solidFacets, floorFacets, hiddenFacets]) facets.clear();
  const cast = [...bodies(p, r), ...wheels(p, r), ...balls(p)];
  for (const [solid, color, second] of cast) addSolid(solid, color, second);
  for (const [solid, color, second] of [...joints(p, r), ...blades(p, r)]) addSolid(solid, color, second);
  for (const [solid, color] of el("forces").checked ? arrows(p, r) : []) { addSolid(solid, color); addSolid(solid, color, color, hiddenFacets, 0.4); }
  if (el("ghosts").checked) ghosts(v, r);
  stops(p, r);
  traces(v, p);
  for (const sheet of run.sheets) drawSheet(v, sheet, cast.map(([solid]) => solid));
  for (const floor of floors(p)) drawFloor(v, floor, cast.map(([solid]) => solid));
  footprints(r);
  drawFacets(g, w, h, v);
  shown = run.points.map((_, k) => v.to(pointAt(k, p)));
  for (const k of state.traced) disc(g, shown[k], 3.2, colors.paper, colors.ink);
  drawMarkers(g, v, p, shown, 6);
  if (state.hover >= 0) { disc(g, shown[state.hover], 4, colors.paper, colors.ink); caption(g, shown[state.hover], run.points[state.hover].name); }
  drawScale(g, w, h, v);
  if (usual && el("forces").checked) drawForceScale(g, w, h, v);
  drawAxes(g, h);
}
function bodies(p, r) { // solids of their inertia, capsules along the lines of their frames, plates between them
  const found = [];
  for (const solid of run.solids) {
    const color = tint(sideColor(solid.side));
    found.push([{ ...solid.formed, center: here(solid.at, p), axes: axesOf(here(solid.turn, p)) }, blend(color, tint(colors.paper), 0.25), blend(color, tint(colors.paper), 0.5)]);
  }
  for (const segment of run.segments) {
    const color = tint(sideColor(segment.side)), at = segment.points.map((n) => placeOf(n, p)), solid = solidOf.get(segment.body);
    const limb = (a, b, size) => found.push([capsule(a, b, size), color, color]);
    if (solid) {
      const center = here(solid.at, p), axes = axesOf(here(solid.turn, p)), inside = (q) => axes.every((axis, k) => Math.abs(dot(axis, plus(q, center, -1))) < 1.02 * solid.half[k]);
      for (const q of at) if (!inside(q)) limb(center, q, 0.55 * r);
    }
    else if (at.length === 1) limb(at[0], at[0], r * (1.2 + 1.6 * Math.cbrt(segment.mass)));
    else {
      const closed = at.length > 2;
      for (let k = closed ? 0 : 1; k < at.length; k++) limb(...within(at[(k + at.length - 1) % at.length], at[k], segment.radius || 0), segment.radius || r);
      if (closed) plate(at, blend(color, tint(colors.paper), 0.5));
    }
  }
  return found;
}
function within(a, b, radius) { // ends of a capsule that reaches no farther than from a to b
  const along = plus(b, a, -1), length = Math.hypot(...along), cut = length > 0 ? Math.min(radius, 0.45 * length) / length : 0;
  return [plus(a, along, cut), plus(b, along, -cut)];
}
function balls(p) {
  return run.balls.map((ball) => { const color = tint(sideColor(ball.side)), at = here(ball.at, p); return [capsule(at, at, mix(ball.radius, p)), color, color]; });
}
function joints(p, r) { // a pin along each axis, else a ball; a block where a point does not move
  const found = [], light = blend(tint(colors.body), tint(colors.paper), 0.55), ink = tint(colors.ink);
  for (const hinge of run.hinges) {
    found.push([{ ...pin(1.45 * r), center: here(hinge.at, p), axes: axesAlong(unitOf(here(hinge.axis, p))) }, light, light]);
  }
  const centers = run.solids.map((solid) => here(solid.at, p));
  for (const n of inFigure) {
    const at = placeOf(n, p);
    if (fixed[n]) found.push([{ ...block(1.5 * r), center: at, axes: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }, blend(ink, tint(colors.paper), 0.45)]);
    else if (!centers.some((center) => Math.hypot(...plus(center, at, -1)) < 0.1 * r)) found.push([capsule(at, at, 1.3 * r), light, light]);
  }
  return found;
}
function stops(p, r) { // cones that directions of bodies stay within: a rim and lines to it, strong while they are reached
  for (const cone of run.cones) {
    const at = here(cone.at, p), [across, beside, along] = axesAlong(unitOf(here(cone.axis, p))), length = 0.3 * extent();
    const touched = cone.contact && cone.contact.closed.some(([a, b]) => a <= state.t && state.t <= b + 0.03 * span);
    const color = touched ? tint(colors.force) : blend(tint(colors.muted), tint(colors.paper), 0.35), [c, s] = [Math.cos(cone.angle), Math.sin(cone.angle)];
    const rim = Array.from({ length: 49 }, (_, k) => { const turn = (k * Math.PI) / 24; return seen([0, 1, 2].map((a) => at[a] + length * (c * along[a] + s * (Math.cos(turn) * across[a] + Math.sin(turn) * beside[a])))); });
    const line = (a, b, width) => { ribbon(solidFacets, a, b, width, color); ribbon(hiddenFacets, a, b, width, color, 0.4); };
    rim.slice(1).forEach((q, k) => { line(rim[k], q, 0.45 * r); if (k % 4 === 0) line(seen(at), q, 0.25 * r); });
  }
}
const kept = new Map();
const keep = (name, make) => { if (!kept.has(name)) kept.set(name, make()); return kept.get(name); };
const pin = (size) => keep("pin", () => formed("cylinder", [size, size, 1.9 * size]));
const block = (size) => keep("block", () => formed("box", [size, size, size]));
function wheels(p, r) {
  return run.wheels.map((wheel) => {
    const [spoke, down] = [wheel.spoke, wheel.down].map((part) => unitOf(here(part, p))), size = mix(wheel.radius, p), color = tint(sideColor(wheel.side));
    return [{ ...formed("wheel", [size, size, Math.max(0.05 * size, 0.3 * r)]), center: here(wheel.at, p), axes: [spoke, down, cross(spoke, down)] }, color, blend(color, tint(colors.paper), 0.5)];
  });
}
function blades(p, r) {
  return run.blades.map((blade) => {
    const along = unitOf(here(blade.along, p)), length = 0.07 * extent(), ink = tint(colors.ink);
    return [{ ...formed("box", [length, 0.9 * r, 0.35 * r]), center: here(blade.at, p), axes: [along, ...axesAlong(along).slice(0, 2).reverse()] }, ink, ink];
  });
}
const longest = () => extent() / 3 / usual; // meters of arrow per newton
function arrows(p, r) { // forces of the ground on feet
  const found = [], color = tint(colors.force);
  for (const push of usual ? run.pushes : []) {
    const force = here(push.force, p), size = Math.hypot(...force);
    if (size < 0.005 * usual) continue;
    const from = here(push.at, p), to = plus(from, force, longest() * Math.min(1, (1.5 * usual) / size)), along = force.map((x) => x / size), head = Math.min(3.4 * r, 0.45 * Math.hypot(...plus(to, from, -1)));
    found.push([capsule(from, plus(to, along, -0.9 * head), 0.4 * r), color, color]);
    found.push([{ ...formed("cone", [0.36 * head, 0.36 * head, 0.5 * head]), center: plus(to, along, -0.5 * head), axes: axesAlong(along) }, color, color]);
  }
  return found;
}
function ghosts(v, r) { // where the lines of the mechanism were
  const gap = Math.min(0.12, span / 12);
  for (let k = 9; k >= 1; k--) {
    if (state.t - k * gap < first) continue;
    const p = locate(state.t - k * gap);
    for (const segment of run.segments) {
      const color = blend(tint(colors.paper), tint(sideColor(segment.side)), 0.08 + 0.2 * (1 - k / 10)), at = segment.points.map((n) => seen(placeOf(n, p)));
      for (let n = 1; n < at.length; n++) ribbon(solidFacets, at[n - 1], at[n], 0.8 * r, color);
    }
  }
}
function traces(v, p) {
  const stride = Math.ceil(p.i / 1500) || 1;
  for (const k of state.traced) {
    const owner = run.segments.find((segment) => segment.points.includes(k)), color = blend(tint(sideColor(owner ? owner.side : "")), tint(colors.paper), 0.2);
    let last = null;
    for (let i = 0; i <= p.i + stride; i += stride) {
      const q = i > p.i ? seen(placeOf(k, p)) : seen(run.points[k].at.map((axis) => axis[i]));
      if (last) ribbon(solidFacets, last, q, 1.7 / v.scale, color);
      last = q;
    }
  }
}
