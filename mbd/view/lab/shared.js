"use strict";
const lab = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const [chart, tip, legend] = ["chart", "tip", "legend"].map((id) => document.getElementById(id));

  const short = (value, digits = 3) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(digits))));
  const small = (value) => (value === null || value === undefined ? "–" : value === 0 ? "0" : value.toExponential(1));

  const make = (name, attributes, text) => {
    const node = document.createElementNS("http://www.w3.org/2000/svg", name);
    Object.entries(attributes).forEach(([key, value]) => node.setAttribute(key, value));
    if (text !== undefined) node.textContent = text;
    chart.append(node);
    return node;
  };

  const show = (text, x, y) => {
    tip.textContent = text;
    tip.hidden = false;
    const room = chart.getBoundingClientRect().width - tip.offsetWidth - 8;
    const above = y - tip.offsetHeight - 12;
    tip.style.left = `${Math.min(x + 14, Math.max(room, 0))}px`;
    tip.style.top = `${above >= 0 ? above : y + 18}px`;
  };
  const hide = () => { tip.hidden = true; };

  const opens = (node, open, close) => {
    ["pointerenter", "focus"].forEach((word) => node.addEventListener(word, open));
    ["pointerleave", "blur"].forEach((word) => node.addEventListener(word, close));
  };

  const named = (id, names) => {
    const select = document.getElementById(id);
    names.forEach((name) => select.add(new Option(name, name)));
    return select;
  };

  const start = (controls, draw) => {
    controls.forEach((control) => control.addEventListener("change", draw));
    let width = 0;
    new ResizeObserver(() => {
      const now = chart.getBoundingClientRect().width;
      if (now !== width) draw();
      width = now;
    }).observe(chart);
    draw();
  };

  return { data, chart, legend, short, small, make, show, hide, opens, named, start };
})();
