// Facets of a spatial scene in the axes of its picture (right, up, toward the viewer) [m], colored where they are made.
for (const mesh of Object.values(run.meshes)) { mesh.at = Float64Array.from(mesh.at); mesh.normal = Float64Array.from(mesh.normal); mesh.faces = Uint16Array.from(mesh.faces); }
const EACH = 7; // numbers of a corner: place, color, opacity
class Facets {
  constructor() { this.data = new Float32Array(1 << 16); this.size = 0; }
  clear() { this.size = 0; }
  corner(p, c, opacity = 1) {
    if (this.size + EACH > this.data.length) { const larger = new Float32Array(2 * this.data.length); larger.set(this.data); this.data = larger; }
    const d = this.data; let n = this.size;
    d[n++] = p[0]; d[n++] = p[1]; d[n++] = p[2]; d[n++] = c[0]; d[n++] = c[1]; d[n++] = c[2]; d[n++] = opacity;
    this.size = n;
  }
  triangle(a, b, c, color, opacity) { this.corner(a, color, opacity); this.corner(b, color, opacity); this.corner(c, color, opacity); }
}
const solidFacets = new Facets(), floorFacets = new Facets(); // drawn with depth; then laid over them where nothing is nearer
const hiddenFacets = new Facets(); // laid over all where something is nearer: forces shine through

// ---- colors -------------------------------------------------------------------------------------------------
const tints = new Map(); // of a theme, by their text
function tint(text) {
  if (!tints.has(text)) {
    const digits = /^#(..)(..)(..)$/.exec(text);
    tints.set(text, digits ? digits.slice(1).map((two) => parseInt(two, 16) / 255) : [0.5, 0.5, 0.5]);
  }
  return tints.get(text);
}
const blend = (a, b, w) => a.map((x, k) => x + w * (b[k] - x));
const lit = (upwards, facing) => 0.56 + 0.17 * (1 + upwards) + 0.2 * Math.max(facing, 0); // light from above, and some from the viewer

// ---- vectors ------------------------------------------------------------------------------------------------
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const plus = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
function axesAlong(z) { // columns of a rotation whose third is along z
  const k = Math.abs(z[0]) < 0.6 ? [1, 0, 0] : [0, 1, 0], x = unitOf(cross(k, z));
  return [x, cross(z, x), z];
}
function axesOf([w, x, y, z]) { // columns of the rotation of a quaternion of any size
  const s = 2 / (w * w + x * x + y * y + z * z);
  return [[1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)], [s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)], [s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)]];
}

// ---- solids -------------------------------------------------------------------------------------------------
// A solid: places of its corners along its axes [m], their normals, where it is and how it is turned.
function formed(kind, half) {
  const mesh = run.meshes[kind], at = mesh.at.map((x, k) => x * half[k % 3]), normal = new Float64Array(at.length);
  for (let k = 0; k < at.length; k += 3) { const n = unitOf([0, 1, 2].map((a) => mesh.normal[k + a] / half[a])); normal.set(n, k); }
  return { mesh, at, normal };
}
function capsule(a, b, r) { // from a to b, with round ends; a ball where they are one
  const mesh = run.meshes.capsule, along = plus(b, a, -1), length = Math.hypot(...along);
  const at = mesh.at.map((x, k) => r * mesh.normal[k] + 0.5 * length * (x - mesh.normal[k]));
  return { mesh, at, normal: mesh.normal, center: plus(a, along, 0.5), axes: axesAlong(length > 1e-12 ? along.map((x) => x / length) : [0, 1, 0]) };
}
let work = new Float64Array(0);
function addSolid({ mesh, at, normal, center, axes }, color, second = color, facets = solidFacets, opacity = 1) {
  const count = at.length / 3, m = eye.map((row) => axes.map((axis) => dot(row, axis))), c = eye.map((row, k) => dot(row, center) - origin[k]);
  const up = [eye[0][1], eye[1][1], eye[2][1]];
  if (work.length < 4 * count) work = new Float64Array(4 * count);
  for (let k = 0; k < count; k++) {
    const x = at[3 * k], y = at[3 * k + 1], z = at[3 * k + 2], nx = normal[3 * k], ny = normal[3 * k + 1], nz = normal[3 * k + 2];
    let upwards = 0, facing = 0;
    for (let a = 0; a < 3; a++) {
      work[4 * k + a] = c[a] + m[a][0] * x + m[a][1] * y + m[a][2] * z;
      const n = m[a][0] * nx + m[a][1] * ny + m[a][2] * nz;
      upwards += up[a] * n; if (a === 2) facing = n;
    }
    work[4 * k + 3] = lit(upwards, facing);
  }
  const { faces, marked } = mesh;
  for (let f = 0; f < marked.length; f++) {
    const a = 4 * faces[3 * f], b = 4 * faces[3 * f + 1], d = 4 * faces[3 * f + 2], tone = marked[f] ? second : color;
    if ((work[b] - work[a]) * (work[d + 1] - work[a + 1]) <= (work[b + 1] - work[a + 1]) * (work[d] - work[a])) continue; // looks away
    for (let k = 0; k < 3; k++) {
      const n = 4 * faces[3 * f + k], l = work[n + 3];
      corner3[0] = work[n]; corner3[1] = work[n + 1]; corner3[2] = work[n + 2];
      shade3[0] = Math.min(tone[0] * l, 1); shade3[1] = Math.min(tone[1] * l, 1); shade3[2] = Math.min(tone[2] * l, 1);
      facets.corner(corner3, shade3, opacity);
    }
  }
}
const corner3 = [0, 0, 0], shade3 = [0, 0, 0];
function addShadow({ mesh, at, center, axes }, { normal: n, offset }, color) { // straight below, on a plane
  const count = at.length / 3, faces = mesh.faces, p = [0, 0, 0];
  if (work.length < 4 * count) work = new Float64Array(4 * count);
  for (let k = 0; k < count; k++) {
    for (let a = 0; a < 3; a++) p[a] = center[a] + axes[0][a] * at[3 * k] + axes[1][a] * at[3 * k + 1] + axes[2][a] * at[3 * k + 2];
    const below = (offset - n[0] * p[0] - n[2] * p[2]) / n[1];
    work[4 * k + 3] = p[1] - below; p[1] = below;
    for (let a = 0; a < 3; a++) work[4 * k + a] = dot(eye[a], p) - origin[a];
  }
  for (let f = 0; f < faces.length; f += 3) {
    const corners = [4 * faces[f], 4 * faces[f + 1], 4 * faces[f + 2]];
    if (corners.every((c) => work[c + 3] < 0)) continue;
    const [a, b, c] = corners, turned = (work[b] - work[a]) * (work[c + 1] - work[a + 1]) - (work[b + 1] - work[a + 1]) * (work[c] - work[a]);
    if (turned > 0) for (const k of corners) { corner3[0] = work[k]; corner3[1] = work[k + 1]; corner3[2] = work[k + 2]; floorFacets.corner(corner3, color); }
  }
}
function addCurvedShadow({ mesh, at, center, axes }, heightAt, fine, nearer, color) { // straight below, of what looks up
  const place = (k) => [0, 1, 2].map((a) => center[a] + axes[0][a] * at[3 * k] + axes[1][a] * at[3 * k + 1] + axes[2][a] * at[3 * k + 2]);
  const lay = (a, b, c, depth) => { // cut into halves until no edge is longer than the lines of the ground are apart
    const sides = [[a, b, c], [b, c, a], [c, a, b]].sort((p, q) => Math.hypot(q[0][0] - q[1][0], q[0][2] - q[1][2]) - Math.hypot(p[0][0] - p[1][0], p[0][2] - p[1][2]));
    const [p, q, r] = sides[0];
    if (depth < 10 && Math.hypot(p[0] - q[0], p[2] - q[2]) > fine) { const m = plus(p, plus(q, p, -1), 0.5); lay(p, m, r, depth + 1); lay(m, q, r, depth + 1); return; }
    const low = [a, b, c].map((s) => [s[0], heightAt(s), s[2]]);
    if (low.some((s, k) => !(s[1] < [a, b, c][k][1]))) return; // beside the ground, or below it
    for (const s of low) { const t = seen(s); t[2] += nearer; floorFacets.corner(t, color); }
  };
  for (let f = 0; f < mesh.faces.length; f += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => place(mesh.faces[f + k]));
    if ((b[2] - a[2]) * (c[0] - a[0]) > (b[0] - a[0]) * (c[2] - a[2])) lay(a, b, c, 0);
  }
}
// ---- flat things --------------------------------------------------------------------------------------------
const seen = (p) => { const q = project(p); return [q[0] - origin[0], q[1] - origin[1], q[2] - origin[2]]; };
function ribbon(facets, a, b, width, color, from = 1, to = from, nearer = 0) { // a line between places in the axes of the picture
  const dx = b[0] - a[0], dy = b[1] - a[1], size = Math.hypot(dx, dy);
  if (!(size > 0)) return;
  const x = (-dy / size) * 0.5 * width, y = (dx / size) * 0.5 * width, z = nearer;
  const p = [a[0] + x, a[1] + y, a[2] + z], q = [a[0] - x, a[1] - y, a[2] + z], r = [b[0] + x, b[1] + y, b[2] + z], s = [b[0] - x, b[1] - y, b[2] + z];
  facets.corner(p, color, from); facets.corner(q, color, from); facets.corner(r, color, to);
  facets.corner(q, color, from); facets.corner(s, color, to); facets.corner(r, color, to);
}
function plate(corners, color) { // a flat polygon, lit from both sides
  const middle = corners.reduce((sum, p) => plus(sum, p), [0, 0, 0]).map((x) => x / corners.length);
  corners.forEach((p, k) => facet(middle, p, corners[(k + 1) % corners.length], color));
}
function facet(a, b, c, color) {
  const n = cross(plus(b, a, -1), plus(c, a, -1)), size = Math.hypot(...n);
  if (!(size > 0)) return;
  const facing = dot(eye[2], n) / size, upwards = (facing < 0 ? -n[1] : n[1]) / size, l = lit(upwards, Math.abs(facing)), shade = color.map((x) => Math.min(x * l, 1));
  solidFacets.triangle(seen(a), seen(b), seen(c), shade);
}
