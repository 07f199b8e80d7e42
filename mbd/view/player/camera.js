// Turning, zooming and shifting the camera of a spatial scene: by dragging, two fingers, buttons and keys.
const cameraHint = " \u00B7 drag: turn \u00B7 shift and drag: shift";
const touching = new Map(); // fingers and mice on the stage: their places [px]
let turning = 0; // which of the turns to a view is under way
function turn(yaw, pitch) {
  camera.yaw = ((((yaw + Math.PI) % (2 * Math.PI)) + 2 * Math.PI) % (2 * Math.PI)) - Math.PI;
  camera.pitch = Math.min(Math.max(pitch, -Math.PI / 2), Math.PI / 2);
  look(); tell(); state.dirty = true;
}
const zoom = (factor) => { camera.zoom = Math.min(Math.max(camera.zoom * factor, 0.05), 50); state.dirty = true; };
function tell() { // the direction in words
  const named = Object.entries(run.views).find(([name, [yaw, pitch]]) => name !== "reset" && Math.abs(yaw - camera.yaw) + Math.abs(pitch - camera.pitch) < 1e-6);
  const degrees = (x) => `${Math.round((x * 180) / Math.PI)}\u00B0`;
  el("seen").textContent = named ? `seen from the ${named[0]}` : `turned ${degrees(camera.yaw)}, raised ${degrees(camera.pitch)}`;
}
function dragged(dx, dy, event) {
  if (touching.size > 1) return;
  turning++;
  if (event.shiftKey || event.buttons & 6) { camera.dx += dx; camera.dy += dy; } else turn(camera.yaw + dx * 0.008, camera.pitch + dy * 0.008);
}
function turnTo(name) { // in a quarter of a second, at once for readers who want no motion
  const [yaw, pitch] = run.views[name], from = [camera.yaw, camera.pitch], mine = ++turning;
  const way = ((((yaw - from[0] + Math.PI) % (2 * Math.PI)) + 2 * Math.PI) % (2 * Math.PI)) - Math.PI;
  if (still) { turn(yaw, pitch); return; }
  let begin = null;
  const step = (stamp) => {
    if (mine !== turning) return;
    begin = begin === null ? stamp : begin;
    const s = Math.min((stamp - begin) / 250, 1), w = s * s * (3 - 2 * s);
    if (s < 1) { turn(from[0] + w * way, from[1] + w * (pitch - from[1])); requestAnimationFrame(step); } else turn(yaw, pitch);
  };
  requestAnimationFrame(step);
}
function resetCamera() { Object.assign(camera, { zoom: 1, dx: 0, dy: 0 }); turnTo("reset"); state.dirty = true; }
function pinched(event) { // two fingers: their distance zooms, their middle shifts
  const before = [...touching.values()], old = touching.get(event.pointerId), now = [event.clientX, event.clientY];
  touching.set(event.pointerId, now);
  if (before.length !== 2) return;
  const other = before.find((place) => place !== old), apart = (a) => Math.hypot(a[0] - other[0], a[1] - other[1]);
  zoom(apart(now) / Math.max(apart(old), 1));
  camera.dx += (now[0] - old[0]) / 2; camera.dy += (now[1] - old[1]) / 2;
}
const TURN = Math.PI / 12;
const moves = {
  front: () => turnTo("front"), side: () => turnTo("side"), top: () => turnTo("top"), reset: resetCamera,
  left: () => turn(camera.yaw - TURN, camera.pitch), right: () => turn(camera.yaw + TURN, camera.pitch),
  up: () => turn(camera.yaw, camera.pitch + TURN), down: () => turn(camera.yaw, camera.pitch - TURN),
  closer: () => zoom(1.25), farther: () => zoom(0.8),
};
const byKey = { a: "left", d: "right", w: "up", s: "down", "+": "closer", "=": "closer", "-": "farther", 1: "front", 2: "side", 3: "top", 0: "reset" };
for (const button of el("camera").querySelectorAll("button")) button.addEventListener("click", () => { turning++; moves[button.dataset.move](); });
el("floor").addEventListener("change", () => { state.dirty = true; });
el("floored").hidden = run.grounds.length + run.decks.length + run.sheets.length > 0;
{
  const stage = el("scene"); // keys of one letter count only here
  stage.setAttribute("aria-label", "the moving mechanism; keys a, d, w and s turn the camera, plus and minus zoom, 1 2 3 are the front, the side and the top, 0 resets");
  stage.addEventListener("keydown", (event) => { if (!event.ctrlKey && !event.metaKey && !event.altKey && byKey[event.key]) { turning++; moves[byKey[event.key]](); event.preventDefault(); } });
  stage.addEventListener("pointerdown", (event) => touching.set(event.pointerId, [event.clientX, event.clientY]));
  stage.addEventListener("pointermove", (event) => { if (touching.has(event.pointerId)) pinched(event); });
  for (const kind of ["pointerup", "pointercancel"]) stage.addEventListener(kind, (event) => touching.delete(event.pointerId));
  stage.addEventListener("contextmenu", (event) => event.preventDefault());
}
tell();
