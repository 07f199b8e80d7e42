(() => {
  const { data, chart, legend, short, small, make, show, hide, opens, named, start } = lab;
  const output = named("output", data.outputs);
  const [order, rows] = [document.getElementById("order"), [...document.querySelectorAll("tbody tr")]];
  const body = document.querySelector("tbody");
  const row = 34;

  const change = (each) => (output.value ? each.outputs[output.value] ?? null : each.change);
  const brief = (value) => (value > 0 && value < 1e-3 ? small(value) : short(value, 2));
  const percent = (value) => `${short(100 * value, 2)} %`;
  const why = (each) => (each.differs_at !== null && change(each) !== null ? ` until ${short(each.differs_at)} s` : each.ends ? ", ends otherwise" : "");
  const said = (each) => {
    if (each.failure) return "cannot be left out";
    if (each.identical) return "nothing, to the bit";
    return (change(each) === null ? "not compared" : brief(change(each))) + why(each);
  };
  const cost = (each) => `${each.operations}${each.mark}${each.time === "–" ? "" : ` (${each.time} ns)`}`;

  const keys = {
    model: (each) => data.effects.indexOf(each),
    change: (each) => -(each.failure ? Infinity : each.comparable ? change(each) ?? 0 : 1e6 + (change(each) ?? 0)),
    share: (each) => -each.share,
    operations: (each) => -each.operations,
    time: (each) => -(each.added ?? -Infinity),
  };
  const sorted = () => [...data.effects].sort((a, b) => keys[order.value](a) - keys[order.value](b));

  const told = (each) => [
    `${each.name} (${each.kind})`,
    `energy      ${short(each.energy, 4)} J, ${percent(each.share)} of all`,
    `operations  ${each.operations} ${each.acts}`,
    `time        ${each.time === "–" ? "not measured" : `${each.time} ns of ${short(each.whole)} ns a step`}`,
    ...(each.failure ? [] : Object.entries(each.outputs).sort((a, b) => b[1] - a[1]).slice(0, 8).map(([name, value]) => `${small(value).padStart(10)}  ${name}`)),
    ...(each.note ? each.note.split("; ") : []),
    each.droppable ? "may be left out" : "stays",
  ].join("\n");

  const frames = (width, shown) => {
    const names = Math.min(190, 14 + 7.2 * Math.max(...data.effects.map((each) => each.name.length)));
    const height = row * shown.length;
    const wide = width > 760;
    const free = width - names - (wide ? 24 : 0);
    const sizes = wide ? [0.27, 0.46, 0.27].map((part) => part * free) : [free, free, free];
    let [x, y] = [names, 26];
    return sizes.map((size) => {
      const frame = { x, y, width: size - 12, height, names: x === names };
      if (wide) x += size + 12;
      else y += height + 76;
      return frame;
    });
  };

  const draw = () => {
    chart.replaceChildren();
    hide();
    const shown = sorted();
    const width = chart.getBoundingClientRect().width;
    const panels = frames(width, shown);
    chart.style.height = `${panels[2].y + panels[2].height + 46}px`;
    const known = data.effects.map(change).filter((value) => value > 0);
    const low = 10 ** Math.floor(Math.log10(Math.min(...known, data.tolerance) * 0.5));
    const high = 10 ** Math.ceil(Math.log10(Math.max(...known, data.tolerance) * 2));
    const biggest = (key) => Math.max(1e-12, ...data.effects.map(key));
    const linear = (most) => (value) => Math.max(0, value) / most * 0.62;
    const kinds = [
      { title: "share of the energy", size: linear(biggest((each) => each.share)), value: (each) => each.share, text: (each) => percent(each.share) },
      { title: "change without it, over the range", size: (value) => (value > 0 ? Math.log(value / low) / Math.log(high / low) * (width > 760 ? 0.7 : 0.5) : 0), value: change, text: said, changes: true },
      { title: "operations (time of a step)", size: linear(biggest((each) => each.operations)), value: (each) => each.operations, text: cost },
    ];
    kinds.forEach((kind, k) => panel(panels[k], kind, shown, low, high));
    shown.forEach((each) => body.append(rows[data.effects.indexOf(each)]));
  };

  const panel = (frame, kind, shown, low, high) => {
    const bottom = frame.y + frame.height;
    make("text", { class: "panel", x: frame.names && frame.x + frame.width < 400 ? 0 : frame.x, y: frame.y - 10 }, kind.title);
    if (kind.changes) {
      const every = 10 ** Math.max(1, Math.ceil(44 / (frame.width * kind.size(low * 10)))); // as many pixels as a label needs
      for (let value = low; value <= high * 1.001; value *= every) {
        const at = frame.x + frame.width * kind.size(value * 1.0000001);
        make("line", { class: "grid", x1: at, x2: at, y1: frame.y, y2: bottom });
        make("text", { x: at, y: bottom + 16, "text-anchor": "middle" }, value.toExponential(0));
      }
      const at = frame.x + frame.width * kind.size(data.tolerance);
      make("line", { class: "target", x1: at, x2: at, y1: frame.y, y2: bottom });
      make("text", { x: at, y: bottom + 32, "text-anchor": "middle" }, `allowed ${data.tolerance}`);
    }
    make("line", { class: "axis", x1: frame.x, x2: frame.x, y1: frame.y, y2: bottom });
    shown.forEach((each, place) => {
      const y = frame.y + row * place;
      const size = frame.width * kind.size(kind.value(each));
      const shade = each.droppable ? data.colors.droppable : data.colors.other;
      if (frame.names) make("text", { class: "name", x: frame.x - 8, y: y + row / 2 + 4, "text-anchor": "end" }, each.name);
      const bar = make("rect", { class: "bar", x: frame.x, y: y + 7, width: Math.max(size, 0), height: row - 14, fill: shade });
      if (kind.changes && !each.comparable) bar.classList.add("otherwise");
      const behind = kind.changes && !(size > 0) ? frame.width * kind.size(data.tolerance) : size;
      make("text", { class: "step", x: frame.x + behind + 7, y: y + row / 2 + 4 }, kind.text(each));
      const field = make("rect", { class: "field", x: frame.names ? 0 : frame.x, y, width: frame.width + (frame.names ? frame.x : 0), height: row, tabindex: frame.names ? 0 : -1 });
      const mine = rows[data.effects.indexOf(each)];
      opens(field, (event) => { show(told(each), event.offsetX ?? frame.x, y + row); mine.classList.add("told"); }, () => { hide(); mine.classList.remove("told"); });
    });
  };

  [[data.colors.droppable, "may be left out, all of these together"], [data.colors.other, "stays"]].forEach(([color, text]) => {
    const entry = document.createElement("span");
    const line = document.createElement("i");
    line.style.background = color;
    entry.append(line, text);
    legend.append(entry);
  });
  legend.append("pale: the run has other events or another end, so that it is compared until there");
  start([output, order], draw);
})();
