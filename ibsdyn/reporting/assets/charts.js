const SVG = "http://www.w3.org/2000/svg";

function svg(name, attributes = {}, text = null) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== null) made.textContent = text;
  return made;
}

function shown(value) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) {
    const [digits, power] = value.toExponential(2).split("e");
    return `${digits}·10${superscript(Number(power))}`;
  }
  return String(Number(value.toPrecision(4)));
}

// Round steps on a linear axis; 1 2 5 within few decades and whole decades over many on a logarithmic one.
function ticks(low, high, log, most) {
  if (!log) {
    const rough = (high - low) / most || 1, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((m) => m * power >= rough * 0.999);
    const found = [];
    for (let i = Math.ceil(low / step - 1e-9); i <= high / step + 1e-9; i++) found.push(i * step);
    return found;
  }
  const decades = Math.log10(high / low), found = [];
  const inner = decades < most / 3 ? [1, 2, 5] : [1], every = inner.length > 1 ? 1 : Math.max(1, Math.ceil(decades / most));
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power++) {
    if (((power % every) + every) % every) continue;
    for (const m of inner) if (m * 10 ** power >= low * 0.9999 && m * 10 ** power <= high * 1.0001) found.push(m * 10 ** power);
  }
  return found.length > 1 ? found : ticks(low, high, false, most).filter((value) => value > 0);
}

function superscript(power) {
  return [...String(power)].map((c) => c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]).join("");
}

// The power of ten that a linear axis of very small or large values carries in its label.
function sharedPower(low, high, log) {
  const size = Math.max(Math.abs(low), Math.abs(high));
  return log || size === 0 || (size >= 1e-2 && size < 1e5) ? 0 : Math.floor(Math.log10(size) + 1e-9);
}

function decade(value, log) {
  const power = Math.round(Math.log10(value));
  if (log && value > 0 && Math.abs(Math.log10(value) - power) < 1e-6 && (power < -2 || power > 4)) {
    return `10${superscript(power)}`;
  }
  return shown(value);
}

// Curves over a shared x axis, panels one above the other; drag across to zoom, double-click for everything.
// spec: {x: {label, log, ticks?: [[value, text]]}, panels: [{label, log, height, range?, ticks?, curves, limits}]}
// curve: {label, x, y, colour, dash?, low?, high?, marks?: [colour]}; limits: [{label, y | steps: [[x0, x1, y]]}]
class Chart {
  constructor(host, spec) {
    this.host = host; this.hidden = new Set(); this.host.classList.add("chart");
    this.legend = element("div", {class: "legend"}); host.after(this.legend);
    this.hint = element("div", {class: "hint", hidden: ""});
    this.set(spec);
    new ResizeObserver(() => { if (host.clientWidth !== this.width) this.draw(); }).observe(host);
  }
  set(spec) {
    this.spec = spec; this.zoomed = null;
    this.drawLegend(); this.draw();
  }
  drawLegend() {
    this.legend.replaceChildren();
    const seen = new Set();
    for (const panel of this.spec.panels) for (const curve of panel.curves) {
      if (!curve.label || seen.has(curve.label)) continue;
      seen.add(curve.label);
      const button = element("button", {type: "button", "aria-pressed": String(!this.hidden.has(curve.label)), title: "show or hide"}, element("i"), curve.label);
      const mark = button.firstChild; mark.style.borderTopColor = curve.colour; mark.style.borderTopStyle = !curve.dash ? "solid" : Number(curve.dash.split(" ")[0]) < 3 ? "dotted" : "dashed";
      button.addEventListener("click", () => { this.hidden.has(curve.label) ? this.hidden.delete(curve.label) : this.hidden.add(curve.label); this.drawLegend(); this.draw(); });
      this.legend.append(button);
    }
  }
  visible(panel) { return panel.curves.filter((curve) => !this.hidden.has(curve.label)); }
  whole() {
    if (this.spec.x.range) return this.spec.x.range;
    let [low, high] = [Infinity, -Infinity];
    for (const panel of this.spec.panels) for (const curve of panel.curves) for (const x of curve.x) {
      if (this.spec.x.log && x <= 0) continue;
      low = Math.min(low, x); high = Math.max(high, x);
    }
    return low < high ? [low, high] : [low - 0.5, high + 0.5];
  }
  range(panel, [from, to]) {
    if (panel.range) return panel.range;
    let [low, high] = [Infinity, -Infinity];
    const take = (y) => { if (Number.isFinite(y) && (!panel.log || y > 0)) { low = Math.min(low, y); high = Math.max(high, y); } };
    for (const curve of this.visible(panel)) for (let i = 0; i < curve.x.length; i++) if (curve.x[i] >= from && curve.x[i] <= to) take(curve.y[i]);
    for (const limit of panel.limits || []) { if (limit.steps) limit.steps.forEach((step) => take(step[2])); else take(limit.y); }
    panel.empty = low > high || (low === 0 && high === 0);
    if (panel.empty) return panel.log ? [0.1, 10] : [0, 1];
    if (panel.log) { const room = Math.max(1.15, (high / low) ** (panel.limits?.length ? 0.16 : 0.05)); return [low / room, high * room]; }
    const room = (panel.limits?.length ? 0.2 : 0.08) * (high - low) || Math.abs(high) * 0.1 || 1;
    return [panel.fromZero && low >= 0 ? 0 : low - room, high + room];
  }
  draw() {
    const width = this.width = this.host.clientWidth;
    if (!width) return;
    const left = 78, right = 14, top = 10, gap = 22, bottom = this.spec.x.ticks ? 54 : 46;
    const heights = this.spec.panels.map((panel) => panel.height);
    const total = top + heights.reduce((a, b) => a + b) + gap * (heights.length - 1) + bottom;
    const drawing = svg("svg", {viewBox: `0 0 ${width} ${total}`, height: total, role: "img", "aria-label": this.spec.label || "chart"});
    const span = this.zoomed || this.whole(), scale = this.spec.x.log ? Math.log10 : (v) => v;
    const [a, b] = span.map(scale), inner = width - left - right;
    const px = (x) => left + inner * (scale(x) - a) / (b - a);
    const back = (pixel) => { const v = a + (b - a) * (pixel - left) / inner; return this.spec.x.log ? 10 ** v : v; };
    this.geometry = {left, right, top, bottom, inner, px, back, total};
    let y0 = top;
    this.spec.panels.forEach((panel, number) => {
      const clip = `clip-${Chart.count = (Chart.count || 0) + 1}`, defs = svg("clipPath", {id: clip});
      defs.append(svg("rect", {x: left, y: y0, width: inner, height: panel.height})); drawing.append(defs);
      const [low, high] = this.range(panel, span), own = panel.log ? Math.log10 : (v) => v;
      const py = (y) => y0 + panel.height * (1 - (own(panel.log ? Math.max(y, 1e-300) : y) - own(low)) / (own(high) - own(low)));
      const last = number === this.spec.panels.length - 1;
      // Given ticks keep their grid lines; texts that would run into each other give way to every second, third, ...
      const longest = Math.max(1, ...(this.spec.x.ticks || []).flatMap(([, text]) => text.split("\n").map((line) => line.length)));
      const each = Math.ceil((7.2 * longest + 8) * (this.spec.x.ticks || []).length / inner) || 1;
      for (const [place, [value, text]] of (this.spec.x.ticks || ticks(...span, this.spec.x.log, Math.max(3, inner / 85)).map((v) => [v, decade(v, this.spec.x.log)])).entries()) {
        if (value < span[0] || value > span[1]) continue;
        drawing.append(svg("line", {class: "grid", x1: px(value), x2: px(value), y1: y0, y2: y0 + panel.height}));
        const written = !this.spec.x.ticks || (this.spec.x.ticks.length - 1 - place) % each === 0;
        // A long text at the edge moves inwards.
        if (last && written) text.split("\n").forEach((line, row) => drawing.append(svg("text", {x: Math.min(px(value), width - 3.4 * line.length), y: y0 + panel.height + 17 + 14 * row, "text-anchor": "middle"}, line)));
      }
      const power = sharedPower(low, high, panel.log), carried = power ? panel.label.replace("[", `[10${superscript(power)} `) : panel.label;
      for (const value of panel.ticks || ticks(low, high, panel.log, Math.max(2, panel.height / 42))) {
        drawing.append(svg("line", {class: "grid", x1: left, x2: left + inner, y1: py(value), y2: py(value)}));
        drawing.append(svg("text", {x: left - 7, y: py(value) + 4, "text-anchor": "end"}, power ? String(Number((value / 10 ** power).toPrecision(4))) : decade(value, panel.log)));
      }
      const group = svg("g", {"clip-path": `url(#${clip})`});
      for (const curve of this.visible(panel)) this.drawCurve(group, curve, px, py, span, panel);
      for (const limit of panel.limits || []) {
        for (const [from, to, y] of limit.steps || [[span[0], span[1], limit.y]]) {
          group.append(svg("line", {x1: px(from), x2: px(to), y1: py(y), y2: py(y), stroke: "#18222d", "stroke-width": 1.6, "stroke-dasharray": "6 4"}));
        }
        if (limit.label) {
          // On the side where the curves end further from the line.
          const [, , y] = (limit.steps || [[0, 0, limit.y]]).at(-1), shown = this.visible(panel).filter((curve) => curve.y.length);
          const room = (place) => Math.min(...shown.map((curve) => Math.abs(py(curve.y.at(place)) - py(y))).filter(Number.isFinite));
          const whole = !limit.steps || (limit.steps.length === 1 && limit.steps[0][0] <= span[0]);
          const right = !whole || !(room(0) > room(-1));
          group.append(svg("text", {x: right ? left + inner - 6 : left + 6, y: py(y) - 6, "text-anchor": right ? "end" : "start", class: "strong"}, limit.label));
        }
      }
      drawing.append(group, svg("rect", {class: "frame", x: left, y: y0, width: inner, height: panel.height}));
      const middle = y0 + panel.height / 2;
      if (panel.empty) drawing.append(svg("text", {x: left + inner / 2, y: middle, "text-anchor": "middle"}, "zero throughout"));
      drawing.append(svg("text", {x: 15, y: middle, "text-anchor": "middle", transform: `rotate(-90 15 ${middle})`}, carried));
      panel.geometry = {y0, py};
      y0 += panel.height + gap;
    });
    drawing.append(svg("text", {x: left + inner / 2, y: total - 6, "text-anchor": "middle"}, this.spec.x.label));
    this.cursor = svg("line", {stroke: "#8a97a3", y1: top, y2: total - bottom, visibility: "hidden"});
    this.chosen = svg("rect", {fill: "#1f5f99", opacity: 0.15, y: top, height: total - bottom - top, visibility: "hidden"});
    drawing.append(this.chosen, this.cursor);
    this.host.replaceChildren(drawing, this.hint);
    this.listen(drawing);
  }
  drawCurve(group, curve, px, py, span, panel) {
    if (curve.low) {
      const upper = [], lower = [];
      for (let i = 0; i < curve.x.length; i++) { upper.push(`${px(curve.x[i]).toFixed(1)} ${py(curve.high[i]).toFixed(1)}`); lower.push(`${px(curve.x[i]).toFixed(1)} ${Math.min(py(curve.low[i]), 9999).toFixed(1)}`); }
      group.append(svg("path", {d: `M${upper.join("L")}L${lower.reverse().join("L")}Z`, fill: curve.colour, opacity: 0.2}));
    }
    let path = "", pen = false;
    for (let i = 0; i < curve.x.length; i++) {
      const [x, y] = [curve.x[i], curve.y[i]], good = Number.isFinite(y) && (!panel.log || y > 0) && (!this.spec.x.log || x > 0);
      const wraps = panel.wraps && i && Math.abs(y - curve.y[i - 1]) > 180;
      if (good && curve.x[Math.min(i + 1, curve.x.length - 1)] >= span[0] && curve.x[Math.max(i - 1, 0)] <= span[1]) path += `${pen && !wraps ? "L" : "M"}${px(x).toFixed(1)} ${py(y).toFixed(1)}`;
      pen = good;
    }
    group.append(svg("path", {class: "curve", d: path, stroke: curve.colour, "stroke-width": curve.width || 1.8, "stroke-dasharray": curve.dash || "none"}));
    const size = Math.min(5, Math.max(2, 0.4 * (px(span[1]) - px(span[0])) / curve.x.length));
    (curve.marks || []).forEach(({colour, shape}, i) => {
      if (!Number.isFinite(curve.y[i])) return;
      const [x, y] = [px(curve.x[i]), py(curve.y[i])];
      group.append(shape === "cross" ? svg("path", {d: `M${x - size} ${y - size}l${2 * size} ${2 * size}M${x - size} ${y + size}l${2 * size} ${-2 * size}`, stroke: colour, "stroke-width": 0.6 * size}) : svg("circle", {cx: x, cy: y, r: size, fill: colour}));
    });
  }
  listen(drawing) {
    let start = null;
    const at = (event) => { const box = drawing.getBoundingClientRect(); return Math.max(this.geometry.left, Math.min(this.geometry.left + this.geometry.inner, (event.clientX - box.left) * this.width / box.width)); };
    drawing.addEventListener("pointerdown", (event) => { if (this.spec.x.ticks) return; start = at(event); drawing.setPointerCapture(event.pointerId); });
    drawing.addEventListener("pointermove", (event) => {
      const here = at(event);
      if (start !== null) { this.chosen.setAttribute("x", Math.min(start, here)); this.chosen.setAttribute("width", Math.abs(here - start)); this.chosen.setAttribute("visibility", "visible"); }
      this.read(here);
    });
    drawing.addEventListener("pointerup", (event) => {
      const end = at(event), from = start; start = null;
      if (from === null || Math.abs(end - from) < 6) { this.chosen.setAttribute("visibility", "hidden"); return; }
      this.zoomed = [from, end].sort((p, q) => p - q).map(this.geometry.back); this.draw();
    });
    drawing.addEventListener("dblclick", () => { this.zoomed = null; this.draw(); });
    drawing.addEventListener("pointerleave", () => { this.hint.hidden = true; this.cursor.setAttribute("visibility", "hidden"); });
  }
  read(pixel) {
    const wanted = this.geometry.back(pixel), lines = [];
    let place = null;
    for (const panel of this.spec.panels) for (const curve of this.visible(panel)) {
      let low = 0, high = curve.x.length - 1;
      while (high - low > 1) { const middle = (low + high) >> 1; if (curve.x[middle] < wanted) low = middle; else high = middle; }
      const near = Math.abs(this.geometry.px(curve.x[low]) - pixel) < Math.abs(this.geometry.px(curve.x[high]) - pixel) ? low : high;
      if (Math.abs(this.geometry.px(curve.x[near]) - pixel) > 40) continue;
      if (place === null || Math.abs(curve.x[near] - wanted) < Math.abs(place - wanted)) place = curve.x[near];
      lines.push(`${curve.label ? `${curve.label}: ` : ""}${shown(curve.y[near])}${panel.unit ? ` ${panel.unit}` : ""}`);
    }
    if (!lines.length) { this.hint.hidden = true; return; }
    const known = (this.spec.x.ticks || []).find(([value]) => value === place);
    const head = known ? known[1].replace("\n", ", ") : `${shown(place)} ${this.spec.x.unit || ""}`;
    this.hint.replaceChildren(element("b", {}, head), ...lines.flatMap((line) => [element("br"), line]));
    this.hint.hidden = false;
    const x = pixel * this.host.clientWidth / this.width;
    this.hint.style.top = "16px"; this.hint.style.left = `${Math.min(x + 14, this.host.clientWidth - this.hint.offsetWidth - 4)}px`;
    if (x + 14 + this.hint.offsetWidth > this.host.clientWidth) this.hint.style.left = `${x - 14 - this.hint.offsetWidth}px`;
    this.cursor.setAttribute("x1", pixel); this.cursor.setAttribute("x2", pixel); this.cursor.setAttribute("visibility", "visible");
  }
}
