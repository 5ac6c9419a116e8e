// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Charts of DATA, which page.py writes in front of this: for each choice its
// points, and images by name.
"use strict";

const COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const METRICS = {
  rms: "root mean square error", mean: "mean error", largest: "largest error",
  p99: "99th percentile of errors", flip: "FLIP", psnr: "PSNR, dB",
};
const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 560, HEIGHT = 380, LEFT = 58, RIGHT = 18, TOP = 16, BOTTOM = 46;
let metric = "rms";

function make(parent, name, attributes, text) {
  const node = parent.namespaceURI === SVG || name === "svg"
      ? document.createElementNS(SVG, name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {}))
    node.setAttribute(key, value);
  if (text !== undefined)
    node.textContent = text;
  parent.append(node);
  return node;
}

function format(value) {
  if (value === 0 || !isFinite(value))
    return value === 0 ? "0" : "∞";
  return value < 0.001 || value >= 1e5 ? value.toExponential(1)
                                       : String(+value.toPrecision(3));
}

// Larger is worse, of all metrics.
function errorOf(point) {
  return metric === "psnr" ? Math.pow(10, -point.psnr / 20) : point[metric];
}

// A logarithmic axis; zero has a place of its own in front of it.
function makeAxis(values, from, to) {
  const positive = values.filter(v => v > 0);
  let low = Math.min(...positive), high = Math.max(...positive);
  if (!positive.length)
    [low, high] = [0.1, 1];
  [low, high] = [Math.log10(low), Math.log10(high)];
  const margin = Math.max(0.12, 0.08 * (high - low));
  [low, high] = [low - margin, high + margin];
  const hasZero = values.some(v => v === 0);
  const first = hasZero ? from + 0.1 * (to - from) : from;
  const place = v => v > 0 ? first + (Math.log10(v) - low) / (high - low) * (to - first) : from;
  const ticks = [];
  const steps = high - low < 2.2 ? [1, 2, 5] : [1];
  const every = Math.max(1, Math.ceil((high - low) / 6));
  for (let e = Math.floor(low); e <= high; e += every)
    for (const step of steps) {
      const v = step * Math.pow(10, e);
      if (Math.log10(v) >= low && Math.log10(v) <= high)
        ticks.push(v);
    }
  if (hasZero)
    ticks.unshift(0);
  return {place, ticks};
}

function markFront(points) {
  const better = (a, b) => a.ms <= b.ms && errorOf(a) <= errorOf(b) &&
      (a.ms < b.ms || errorOf(a) < errorOf(b));
  return points.filter(p => !points.some(q => better(q, p)))
      .sort((a, b) => a.ms - b.ms || errorOf(b) - errorOf(a));
}

function drawAxes(svg, x, y, xLabel, yLabel) {
  for (const tick of y.ticks) {
    make(svg, "line", {class: "tick", x1: LEFT, x2: WIDTH - RIGHT, y1: y.place(tick), y2: y.place(tick)});
    make(svg, "text", {x: LEFT - 6, y: y.place(tick) + 4, "text-anchor": "end"}, format(tick));
  }
  for (const tick of x.ticks) {
    make(svg, "line", {class: "tick", x1: x.place(tick), x2: x.place(tick), y1: TOP, y2: HEIGHT - BOTTOM});
    make(svg, "text", {x: x.place(tick), y: HEIGHT - BOTTOM + 18, "text-anchor": "middle"}, format(tick));
  }
  make(svg, "text", {x: (LEFT + WIDTH) / 2, y: HEIGHT - 6, "text-anchor": "middle"}, xLabel);
  make(svg, "text", {x: 14, y: HEIGHT / 2, "text-anchor": "middle", transform: `rotate(-90 14 ${HEIGHT / 2})`}, yLabel);
}

function show(view, choice, point) {
  view.replaceChildren();
  make(view, "h3", {}, `${point.setting}, ${point.scene}: ${format(point.ms)} ms`);
  make(view, "div", {class: "quiet"}, `rounds from ${format(point.least)} to ${format(point.most)} ms; ` +
      Object.keys(METRICS).map(m => `${m} ${format(point[m])}`).join(", "));
  const pair = make(view, "div", {class: "pair"});
  make(pair, "img", {src: DATA.images[point.reference], alt: "the reference"});
  const top = make(pair, "img", {src: DATA.images[point.image], alt: point.setting});
  const slider = make(view, "input", {type: "range", min: 0, max: 100, value: 50, "aria-label": "reference to the left, setting to the right"});
  const cut = () => top.style.clipPath = `inset(0 0 0 ${slider.value}%)`;
  slider.addEventListener("input", cut);
  cut();
  const line = make(view, "label", {class: "quiet"});
  const box = make(line, "input", {type: "checkbox"});
  line.append(` difference (FLIP); left: ${choice.against}`);
  box.addEventListener("change", () => {
    top.src = DATA.images[box.checked ? point.map : point.image];
    slider.value = box.checked ? 0 : 50;
    cut();
  });
  make(view, "code", {}, point.command);
}

// Labels that would lie on others are left to the pointer.
function makeLabeller(svg) {
  const taken = [];
  return (x, y, text) => {
    const width = 6.6 * text.length, isLeft = x + 9 + width > WIDTH;
    const box = {x: isLeft ? x - 9 - width : x + 9, y: y - 8, width};
    if (taken.some(o => Math.abs(o.y - box.y) < 12 && box.x < o.x + o.width && o.x < box.x + width))
      return;
    taken.push(box);
    make(svg, "text", {class: "label", x: box.x, y: box.y}, text);
  };
}

function drawChoice(section, choice) {
  const old = section.querySelector("svg");
  const svg = make(section.querySelector(".chart"), "svg", {viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": choice.title});
  if (old)
    old.remove();
  const view = section.querySelector(".view");
  const x = makeAxis(choice.points.map(errorOf), LEFT + 8, WIDTH - RIGHT);
  const y = makeAxis(choice.points.flatMap(p => [p.ms, p.least, p.most]), HEIGHT - BOTTOM, TOP);
  drawAxes(svg, x, y, metric === "psnr" ? "10^(-PSNR / 20)" : METRICS[metric], "ms a frame");
  const label = makeLabeller(svg);
  DATA.scenes.forEach((scene, i) => {
    const color = COLORS[i % COLORS.length];
    const points = choice.points.filter(p => p.scene === scene);
    const front = markFront(points);
    make(svg, "path", {class: "front", stroke: color, d: front.map((p, n) => `${n ? "L" : "M"}${x.place(errorOf(p))} ${y.place(p.ms)}`).join("")});
    for (const p of points) {
      const at = [x.place(errorOf(p)), y.place(p.ms)];
      make(svg, "line", {class: "spread", stroke: color, x1: at[0], x2: at[0], y1: y.place(p.least), y2: y.place(p.most)});
      const dot = make(svg, "circle", {class: front.includes(p) ? "point" : "point off", cx: at[0], cy: at[1], r: 6.5, fill: color, tabindex: 0, role: "button", "aria-label": `${p.setting}, ${p.scene}`});
      const choose = () => {
        svg.querySelectorAll(".shown").forEach(other => other.classList.remove("shown"));
        dot.classList.add("shown");
        show(view, choice, p);
      };
      for (const event of ["mouseenter", "focus", "click"])
        dot.addEventListener(event, choose);
      label(...at, p.setting);
      if (!view.hasChildNodes() && front.includes(p))
        choose();
    }
  });
}

// Error against how hard the scene is: the naive method, and ours.
function drawMode(figure, mode) {
  make(figure, "p", {class: "quiet"}, `${mode.error}, by ${mode.hardness}`);
  const svg = make(figure, "svg", {viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": mode.title});
  const x = makeAxis(mode.points.map(p => p.scene), LEFT + 8, WIDTH - RIGHT);
  const y = makeAxis(mode.points.flatMap(p => [p.naive, p.ours]), HEIGHT - BOTTOM, TOP);
  drawAxes(svg, x, y, "", "");
  [["naive", COLORS[1]], ["ours", COLORS[0]]].forEach(([who, color]) => {
    make(svg, "path", {class: "front", stroke: color, d: mode.points.map((p, n) => `${n ? "L" : "M"}${x.place(p.scene)} ${y.place(p[who])}`).join("")});
    for (const p of mode.points)
      make(make(svg, "circle", {class: "point", cx: x.place(p.scene), cy: y.place(p[who]), r: 5, fill: color}), "title", {}, `${mode[who]}: ${format(p[who])}`);
  });
}

function drawAll() {
  for (const choice of DATA.choices)
    drawChoice(document.getElementById(choice.name), choice);
}

document.getElementById("metric").addEventListener("change", event => {
  metric = event.target.value;
  drawAll();
});
drawAll();
for (const mode of DATA.modes)
  drawMode(document.getElementById(`mode-${mode.name}`), mode);
