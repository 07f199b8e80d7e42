(() => {
  const { data, chart, legend, short, small, make, show, hide, opens, named, start } = lab;
  const quantity = named("quantity", data.quantities);
  const [which, cost] = ["which", "cost"].map((id) => document.getElementById(id));
  const units = { seconds: "processor time [ms]", dt: "step dt [ms]", steps: "steps", iterations: "Newton iterations", residuals: "evaluations of the balance" };
  const margin = { left: 66, right: 70, top: 14, bottom: 44 };

  const error = (point) => {
    const values = point[which.value];
    const known = quantity.value ? [values[quantity.value]] : Object.values(values);
    const found = Math.max(...known.filter((value) => value > 0));
    return Number.isFinite(found) && (quantity.value || which.value !== "errors" || point.error !== null) ? found : null;
  };
  // what an error is certainly below, where it is not clear beside the reference's own; told of the largest of all
  const below = (point) => (!quantity.value && which.value === "errors" && point.error === null && point.at_most > 0 ? point.at_most : null);
  const work = (point) => (cost.value === "seconds" || cost.value === "dt" ? 1e3 : 1) * point[cost.value];
  const ticks = (low, high) => {
    const digits = high / low < 300 ? [1, 2, 5] : [1];
    const found = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power += 1)
      digits.forEach((digit) => found.push(digit * 10 ** power));
    return found.filter((value) => value >= low && value <= high);
  };

  // labels pushed down until none covers another
  const apart = (labels) => {
    const placed = [];
    labels.sort((a, b) => a.y - b.y).forEach((label) => {
      const meets = () => placed.find((other) => Math.abs(other.y - label.y) < 13 && Math.abs(other.x - label.x) < 52);
      for (let other = meets(); other; other = meets()) label.y = other.y + 13;
      placed.push(label);
    });
    return placed;
  };

  const told = (scheme, point) => [
    scheme.name,
    point.tol === null ? `dt      ${short(1e3 * point.dt)} ms` : `tol     ${short(point.tol)} m or rad`,
    ...(point.tol === null ? [] : [`reached ${small(point.achieved)}, estimated ${small(point.estimated)}; ${point.runs} runs`]),
    `error   ${below(point) ? `below ${small(below(point))}` : small(error(point))}${point.order === null ? "" : `   order ${point.order.toFixed(2)}`}`,
    `time    ${short(1e3 * point.seconds)} ms`,
    `steps   ${point.steps}, Newton ${point.iterations}`,
    `drift   ${small(point.drift)}, energy ${small(point.energy)} J`,
    ...(point.events && point.event_time !== null ? [`events  ${point.events}, off by ${small(point.event_time)} s`] : []),
    ...(point.same_events ? [] : ["its events are not those of the reference"]),
    ...(point.note ? [point.note] : []),
  ].join("\n");

  const emphasize = (number) =>
    chart.querySelectorAll("[data-scheme]").forEach((node) =>
      node.classList.toggle("faint", number !== null && Number(node.dataset.scheme) !== number));

  const draw = () => {
    chart.replaceChildren();
    hide();
    const { width, height } = chart.getBoundingClientRect();
    if (width <= margin.left + margin.right) return; // not laid out yet
    const all = data.schemes.flatMap((scheme, number) => scheme.points
      .filter((point) => !point.failure && (error(point) ?? below(point)) !== null && work(point) > 0)
      .map((point) => ({ scheme, number, point, cost: work(point), error: error(point) ?? below(point), hollow: error(point) === null })));
    if (!all.length) {
      make("text", { x: width / 2, y: height / 2, "text-anchor": "middle" }, "no clear error of this quantity");
      return;
    }
    const costs = all.map((each) => each.cost);
    const errors = all.map((each) => each.error);
    let [low, high] = [Math.min(...errors) / 2, Math.max(...errors) * 2];
    if (data.target) [low, high] = [Math.min(low, data.target / 1.5), Math.max(high, data.target * 1.5)];
    const spread = Math.max(...costs) / Math.min(...costs);
    const [first, last] = [Math.min(...costs) / (1.1 * spread ** 0.05), Math.max(...costs) * 1.1 * spread ** 0.05];
    const x = (value) => margin.left + (width - margin.left - margin.right) * Math.log(value / first) / Math.log(last / first);
    const y = (value) => height - margin.bottom - (height - margin.top - margin.bottom) * Math.log(value / low) / Math.log(high / low);

    const bounds = quantity.value ? [data.bound[quantity.value]] : Object.values(data.bound);
    const bound = Math.max(0, ...bounds.filter((value) => value > 0));
    if (bound > low)
      make("rect", { class: "bound", x: margin.left, width: width - margin.left - margin.right, y: y(Math.min(bound, high)), height: y(low) - y(Math.min(bound, high)) });
    ticks(first, last).forEach((value) => {
      make("line", { class: "grid", x1: x(value), x2: x(value), y1: margin.top, y2: height - margin.bottom });
      make("text", { x: x(value), y: height - margin.bottom + 18, "text-anchor": "middle" }, short(value));
    });
    ticks(low, high).forEach((value) => {
      make("line", { class: "grid", x1: margin.left, x2: width - margin.right, y1: y(value), y2: y(value) });
      make("text", { x: margin.left - 8, y: y(value) + 4, "text-anchor": "end" }, value.toExponential(0));
    });
    make("text", { x: (margin.left + width - margin.right) / 2, y: height - 6, "text-anchor": "middle" }, units[cost.value]);
    make("text", { x: 14, y: height / 2, "text-anchor": "middle", transform: `rotate(-90 14 ${height / 2})` }, `error over ${data.over}`);
    if (data.target) {
      make("line", { class: "target", x1: margin.left, x2: width - margin.right, y1: y(data.target), y2: y(data.target) });
      make("text", { x: width - margin.right - 4, y: y(data.target) - 5, "text-anchor": "end" }, `wanted ${data.target}`);
    }
    const labels = [];
    if (cost.value !== "dt")
      [...new Set(all.filter((each) => each.point.dt).map((each) => each.point.dt))].forEach((dt) => {
        const group = all.filter((each) => each.point.dt === dt).sort((a, b) => a.cost - b.cost);
        const end = group[group.length - 1];
        if (group.length > 2) make("polyline", { class: "same", points: group.map((each) => `${x(each.cost)},${y(each.error)}`).join(" ") });
        labels.push({ x: x(end.cost) + 10, y: y(end.error) + 4, text: `${short(1e3 * dt)} ms` });
      });
    const drawn = [];
    data.schemes.forEach((scheme, number) => {
      const points = all.filter((each) => each.scheme === scheme);
      [true, false].forEach((fixed) => {
        const line = points.filter((each) => (each.point.tol === null) === fixed);
        make("polyline", { class: fixed ? "curve" : "curve trial", "data-scheme": number, stroke: scheme.color, points: line.map((each) => `${x(each.cost)},${y(each.error)}`).join(" ") });
      });
      drawn.push(...points.map((each) => ({ ...each, number })));
    });
    apart(labels).forEach(({ x, y, text }) => make("text", { class: "step crowded", x, y }, text));
    drawn.forEach((each) => {
      const { scheme, number } = each;
      const at = { cx: x(each.cost), cy: y(each.error), "data-scheme": number };
      if (!each.point.same_events) make("circle", { ...at, class: "other", r: 9 });
      const dot = make("circle", { ...at, class: "point", r: each.point.tol === null ? 5.5 : 4, fill: scheme.color, tabindex: 0 });
      if (each.hollow) {
        dot.classList.add("hollow");
        dot.style.stroke = scheme.color;
      }
      opens(dot, () => { show(told(scheme, each.point), at.cx, at.cy); emphasize(number); }, () => { hide(); emphasize(null); });
    });
  };

  data.schemes.forEach((scheme, number) => {
    const entry = document.createElement("span");
    const line = document.createElement("i");
    line.style.background = scheme.color;
    entry.append(line, scheme.name);
    entry.addEventListener("pointerenter", () => emphasize(number));
    entry.addEventListener("pointerleave", () => emphasize(null));
    legend.append(entry);
  });
  start([quantity, which, cost], draw);
})();
