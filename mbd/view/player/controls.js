// Playing, and everything the reader can touch; last of the joined files, it starts the page.
// ---- playing ------------------------------------------------------------------------------------------------
function markEvents() {
  const buttons = el("events").querySelectorAll("button");
  let current = -1;
  instants.forEach((group, k) => { if (group.time <= state.t + 1e-9 * span) current = k; });
  buttons.forEach((button, k) => { button.classList.toggle("past", k < current); button.classList.toggle("now", k === current); });
  if (current !== markEvents.last && current >= 0) {
    const item = buttons[current].parentElement, box = el("events");
    box.scrollTop = item.offsetTop - box.offsetTop - box.clientHeight / 2;
  }
  markEvents.last = current;
}
function draw() {
  drawScene();
  const { g, w, h } = prepare(el("lines"));
  drawLines(g, w, h, run.charts[state.chart], false);
  drawBars();
  writeLegend();
  markEvents();
  el("time").value = state.t;
  el("clock").textContent = state.t.toFixed(span < 0.5 ? 5 : 3) + " s";
  el("time").setAttribute("aria-valuetext", `${el("clock").textContent} of ${+last.toPrecision(4)} s`);
  state.dirty = false;
}
function seek(t) { state.t = Math.min(Math.max(t, first), last); state.dirty = true; }
function play(on) {
  if (on && state.t >= last) state.t = first;
  state.playing = on; state.stamp = 0; state.dirty = true;
  el("play").textContent = on ? "\u275A\u275A" : "\u25B6";
}
function warnOfAliasing() { // pictures 1/60 s apart, and places stored at most as often
  const gap = Math.max(state.speed / 60, span / Math.max(time.length - 1, 1)), turn = run.spin ? run.spin.rate * gap : 0;
  el("alias").textContent = turn > Math.PI ? `${run.spin.name} turns ${(turn / (2 * Math.PI)).toPrecision(2)} times from one picture to the next: it does not turn as it looks.` : "";
}
function frame(stamp) {
  if (state.playing) {
    if (state.stamp) state.t += (Math.min(stamp - state.stamp, 100) / 1000) * state.speed;
    state.stamp = stamp;
    if (state.t >= last) { if (el("loop").checked) state.t = first; else { state.t = last; play(false); } }
    state.dirty = true;
  }
  if (state.dirty) draw();
  requestAnimationFrame(frame);
}
function nextEvent(direction) {
  const gap = 1e-6 * span, times = instants.map((group) => group.time);
  const found = direction > 0 ? times.find((t) => t > state.t + gap) : times.filter((t) => t < state.t - gap).pop();
  seek(found === undefined ? (direction > 0 ? last : first) : found);
}

// ---- controls -----------------------------------------------------------------------------------------------
function fill() {
  el("name").textContent = run.name;
  el("outcome").textContent = run.facts.length ? run.facts[0][1] : "";
  for (const [title, value] of run.facts) { const dt = document.createElement("dt"), dd = document.createElement("dd"); dt.textContent = title; dd.textContent = value; el("facts").append(dt, dd); }
  for (const group of instants) {
    const item = document.createElement("li"), button = document.createElement("button"), when = document.createElement("span");
    when.textContent = group.time.toFixed(span < 0.5 ? 5 : 3) + " s";
    button.append(when);
    for (const event of group.events) {
      const what = document.createElement("span"), dot = document.createElement("i");
      dot.style.borderColor = `var(--${event.side || "body"})`;
      if (event.kind !== "opened") dot.style.background = `var(--${event.side || "body"})`;
      what.append(dot, event.kind === "event" ? event.name : `${event.name} ${event.kind}`);
      if (event.loss) { const loss = document.createElement("small"); loss.textContent = `\u2212${event.loss.toPrecision(3)} J`; what.append(loss); }
      button.append(what);
    }
    button.addEventListener("click", () => { play(false); seek(group.time); });
    item.append(button); el("events").append(item);
  }
  el("happened").hidden = el("events").hidden = !run.events.length;
  el("fit").hidden = Boolean(run.spatial); // the camera in space has its own
  run.charts.forEach((chart, k) => el("chart").append(new Option(`${chart.title} [${chart.unit}]`, k)));
  el("over").append(new Option("over time", -1));
  run.contacts.forEach((contact, k) => { if (strides[k].length) el("over").append(new Option(`over strides, ${contact.name}`, k)); });
  el("over").hidden = el("over").options.length < 2;
  el("forced").hidden = !usual;
  el("named").hidden = !run.markers.length; el("names").checked = run.markers.length <= 6; // more than that hide what they name
  el("trace").append(new Option("\u2026", -1), new Option("clear", -2));
  run.points.forEach((point, k) => el("trace").append(new Option(point.name, k)));
  const natural = span < 1.5 ? roundDown(span / 3) : 1; // a short run is shown in slow motion
  const speeds = [...new Set([natural, 0.1, 0.25, 0.5, 1, 2, 5])].sort((a, b) => a - b);
  for (const s of speeds) el("speed").append(new Option(`${+s.toPrecision(3)}\u00D7`, s, false, s === natural));
  state.speed = natural;
  Object.assign(el("time"), { min: first, max: last });
  el("hint").textContent = run.points.length ? `space: play \u00B7 \u2190 \u2192: step \u00B7 \u2191 \u2193: events \u00B7 click a joint: trace${cameraHint}` : "";
}
function choosePoints() { // feet of a walker, or the last point of the mechanism
  const moving = run.points.map((_, k) => k).filter((k) => !fixed[k]);
  if (!run.touches.length && moving.length) state.traced.add(moving[moving.length - 1]);
}
function toggleTrace(k) { if (state.traced.has(k)) state.traced.delete(k); else state.traced.add(k); state.dirty = true; }
function nearest(event) {
  const box = el("scene").getBoundingClientRect(), x = event.clientX - box.left, y = event.clientY - box.top;
  let found = -1, best = 14;
  shown.forEach((q, k) => { const d = Math.hypot(q[0] - x, q[1] - y); if (d < best) { best = d; found = k; } });
  return found;
}
function listen() {
  el("play").addEventListener("click", () => play(!state.playing));
  el("time").addEventListener("input", () => { play(false); seek(+el("time").value); });
  el("speed").addEventListener("change", () => { state.speed = +el("speed").value; warnOfAliasing(); });
  el("over").addEventListener("change", () => { state.over = +el("over").value; state.dirty = true; });
  for (const id of ["forces", "names"]) el(id).addEventListener("change", () => { state.dirty = true; });
  el("chart").addEventListener("change", () => chooseChart(+el("chart").value));
  el("trace").addEventListener("change", () => { const k = +el("trace").value; if (k === -2) { state.traced.clear(); state.dirty = true; } else if (k >= 0) toggleTrace(k); el("trace").value = -1; });
  for (const id of ["follow", "ghosts"]) el(id).addEventListener("change", () => { Object.assign(camera, { dx: 0, dy: 0, zoom: 1 }); state.dirty = true; });
  for (const id of ["lines", "bars"]) {
    const asked = (event) => {
      const w = el(id).clientWidth, { now } = cycle();
      return now && id === "lines" ? now[0] + (toTime(event.offsetX, w) - first) / span * (now[1] - now[0]) : toTime(event.offsetX, w);
    };
    const move = (event) => { if (event.buttons) { play(false); seek(asked(event)); } };
    el(id).addEventListener("pointerdown", move); el(id).addEventListener("pointermove", move);
  }
  const stage = el("scene");
  let drag = null;
  stage.addEventListener("pointerdown", (event) => { drag = { x: event.clientX, y: event.clientY, moved: false }; stage.setPointerCapture(event.pointerId); });
  stage.addEventListener("pointermove", (event) => {
    if (drag) {
      const dx = event.clientX - drag.x, dy = event.clientY - drag.y;
      if (!drag.moved && Math.hypot(dx, dy) < 4) return;
      drag = { x: event.clientX, y: event.clientY, moved: true };
      dragged(dx, dy, event);
      state.dirty = true;
    } else { const k = nearest(event); if (k !== state.hover) { state.hover = k; state.dirty = true; } }
  });
  stage.addEventListener("pointerup", (event) => { if (drag && !drag.moved) { const k = nearest(event); if (k >= 0) toggleTrace(k); if (event.pointerType !== "mouse") { state.hover = k; state.dirty = true; } } drag = null; });
  stage.addEventListener("wheel", (event) => { event.preventDefault(); camera.zoom = Math.min(Math.max(camera.zoom * Math.exp(-event.deltaY * 0.0012), 0.05), 50); state.dirty = true; }, { passive: false });
  stage.addEventListener("dblclick", resetCamera);
  el("fit").addEventListener("click", resetCamera);
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
    const step = event.shiftKey ? span / 20 : span / Math.max(time.length - 1, 1);
    const actions = {
      " ": () => play(!state.playing), ArrowRight: () => { play(false); seek(state.t + step); }, ArrowLeft: () => { play(false); seek(state.t - step); },
      ArrowDown: () => { play(false); nextEvent(1); }, ArrowUp: () => { play(false); nextEvent(-1); }, Home: () => seek(first), End: () => seek(last), 0: resetCamera,
    };
    if (actions[event.key]) { event.preventDefault(); actions[event.key](); }
  });
  const redraw = () => { readColors(); chooseChart(state.chart); };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  new ResizeObserver(() => { state.dirty = true; }).observe(document.body);
}

readColors();
fill();
choosePoints();
if (run.points.length) { survey(); el("follow").checked = el("ghosts").checked = travels(); }
el("about").open = run.events.length < 6;
chooseChart(0);
warnOfAliasing();
listen();
const asked = /[#&]t=([-+.\deE]+)/.exec(location.hash); // …/run.html#t=1.2 opens paused at 1.2 s
if (asked) seek(+asked[1]);
play(!asked && !still);
requestAnimationFrame(frame);
