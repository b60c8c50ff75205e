const COLOURS = ["#1f5f99", "#d0661b", "#14713f", "#8a4fb0", "#b42318", "#5b6b7b"];
const DASHES = [null, "7 4", "2 3", "9 3 2 3", "4 4", "1 4"];
const data = JSON.parse(document.getElementById("data").textContent);

function sceneLegend(host, scene) {
  const kinds = {"rigid body": "box of its mass and inertia", "flexible body": "FE part"};
  const bodies = scene.parts.filter((each) => each.kind in kinds);
  for (const part of bodies) {
    const patch = element("i", {class: "patch"}); patch.style.background = part.colour;
    const told = scene.schematic ? "size by inertia" : kinds[part.kind];
    host.append(element("span", {}, patch, bodies.length > 6 ? part.name : `${part.name} (${told})`));
  }
  for (const [kind, words] of [["connection", "connections"], ["fixation", "fixations"], ["input", "inputs"], ["sensor", "sensors"]]) {
    const part = scene.parts.find((each) => each.kind === kind);
    if (!part) continue;
    const patch = element("i", {class: "patch"}); patch.style.background = part.colour;
    host.append(element("span", {}, patch, words));
  }
}

class ModePlayer {
  constructor(scene, modes) {
    this.view = new SceneView(document.getElementById("mode-view"), scene, false);
    this.modes = modes; this.size = 1; this.phase = Math.PI / 2;
    this.running = !window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.list = document.getElementById("mode-list");
    modes.forEach((mode, number) => {
      const button = element("button", {type: "button"}, element("span", {}, String(mode.number)), element("span", {}, `${mode.frequency} Hz`), element("span", {class: "quiet"}, `ζ ${mode.damping} %`));
      button.addEventListener("click", () => this.choose(number));
      this.list.append(button);
    });
    this.button = document.getElementById("mode-run");
    this.button.addEventListener("click", () => { this.running = !this.running; this.tell(); });
    document.getElementById("mode-size").addEventListener("input", (event) => { this.size = this.view.largest = Number(event.target.value); this.show(); this.view.printLater(); });
    new IntersectionObserver(([entry]) => { this.seen = entry.isIntersecting; }).observe(this.view.host);
    this.choose(Math.max(0, modes.findIndex((mode) => !mode.rigid))); this.tell();
    requestAnimationFrame((time) => this.step(time));
  }
  tell() { this.button.textContent = this.running ? "pause" : "play"; this.button.setAttribute("aria-pressed", String(!this.running)); if (!this.running) { this.phase = Math.PI / 2; this.show(); } }
  choose(number) {
    this.number = number;
    [...this.list.children].forEach((button, i) => button.setAttribute("aria-pressed", String(i === number)));
    this.view.setMode(number);
    const mode = this.modes[number];
    document.getElementById("mode-title").textContent = `Mode ${mode.number}: ${mode.frequency} Hz, ζ ${mode.damping} %`;
    this.bars("mode-strain", mode.strain, "", mode.rigid ? "rigid-body motion strains nothing" : ""); this.bars("mode-kinetic", mode.kinetic, "kinetic", "");
    this.show();
  }
  bars(id, shares, kind, otherwise) {
    const host = document.getElementById(id);
    host.replaceChildren();
    if (otherwise) { host.append(element("span", {class: "whole"}, otherwise)); return; }
    for (const [name, share] of shares) {
      const bar = element("div", {class: `bar ${kind}`}); bar.style.width = `${Math.max(100 * share, 0.6)}%`;
      host.append(element("span", {title: name}, name), bar, element("span", {}, `${(100 * share).toFixed(share < 0.1 ? 1 : 0)} %`));
    }
  }
  step(time) {
    if (this.running && this.seen && this.last !== undefined) { this.phase += (time - this.last) / 1000 * 2 * Math.PI / 1.7; this.show(); }
    this.last = time;
    requestAnimationFrame((next) => this.step(next));
  }
  show() { this.view.amplitude = this.size * Math.sin(this.phase); this.view.draw(); }
}

// One pair of input and output at a time, all curves that exist of it, magnitude above phase.
class ResponseChart {
  constructor(id, responses, colours) {
    const host = document.getElementById(id), controls = document.getElementById(`${id}-choice`);
    this.responses = responses; this.colours = colours;
    this.labels = [...new Set(responses.curves.map((curve) => curve.label))];
    this.input = this.choice(controls, "from", responses.inputs); this.output = this.choice(controls, "to", responses.outputs);
    const whole = element("button", {type: "button"}, "whole range");
    whole.addEventListener("click", () => { this.chart.zoomed = null; this.chart.draw(); });
    controls.append(whole);
    host.before(this.caption = element("p", {class: "printed"}));  // paper shows no controls
    this.chart = new Chart(host, this.spec());
  }
  choice(host, words, names) {
    const select = element("select", {}, ...names.map((name, i) => element("option", {value: i}, name)));
    select.addEventListener("change", () => this.chart.set(this.spec()));
    host.append(element("label", {}, words, select));
    return select;
  }
  spec() {
    const [input, output] = [Number(this.input.value), Number(this.output.value)], unit = this.responses.units[output][input];
    this.caption.textContent = `From ${this.responses.inputs[input]} to ${this.responses.outputs[output]}`;
    const curves = this.responses.curves.filter((curve) => curve.input === input && curve.output === output).map((curve) => {
      const number = this.labels.indexOf(curve.label), look = {label: curve.label, x: unpack(curve.x), ...(this.colours[curve.label] || {colour: COLOURS[number % 6], dash: DASHES[number % 6]})};
      return [{...look, y: unpack(curve.magnitude), low: curve.low && unpack(curve.low), high: curve.high && unpack(curve.high)}, {...look, y: unpack(curve.phase)}];
    });
    return {
      label: `${this.responses.inputs[input]} to ${this.responses.outputs[output]}`,
      x: {label: "frequency [Hz]", unit: "Hz", log: true},
      panels: [
        {label: `magnitude [${unit}]`, unit: unit === "-" ? "" : unit, log: true, height: 250, curves: curves.map(([magnitude]) => magnitude)},
        {label: "phase [°]", unit: "°", height: 110, range: [-190, 190], ticks: [-180, -90, 0, 90, 180], wraps: true, curves: curves.map(([, phase]) => phase)},
      ],
    };
  }
}

function drawHistory(history) {
  for (const [number, panel] of history.entries()) {
    const host = document.getElementById(`history-${number}`);
    const colour = {true: {colour: "#14713f", shape: "dot"}, false: {colour: "#b42318", shape: "cross"}};
    new Chart(host, {
      label: panel.name,
      x: {label: "revision, fidelity", log: false, ticks: panel.ticks, range: [-0.5, panel.ticks.length - 0.5]},
      panels: [{
        label: `[${panel.unit}]`, unit: panel.unit, log: panel.log, height: 170,
        curves: [{label: "", x: panel.x, y: panel.y.map((value) => value === null ? NaN : value), colour: "#8a97a3", width: 1.2, marks: panel.met.map((met) => colour[met])}],
        limits: [{label: panel.limitLabel, steps: panel.limits}],
      }],
    });
  }
}

function drawBudget(budgets) {
  for (const [number, budget] of budgets.entries()) {
    const look = (curve, i) => ({label: curve.label, x: unpack(budget.x), colour: curve.total ? "#18222d" : COLOURS[i % 6], dash: curve.total ? null : DASHES[i % 6], width: curve.total ? 2.2 : 1.6});
    new Chart(document.getElementById(`budget-${number}`), {
      label: budget.name, x: {label: "frequency [Hz]", unit: "Hz", log: true},
      panels: [
        {label: `PSD [${budget.psdUnit}]`, unit: budget.psdUnit, log: true, height: 190, curves: budget.curves.map((curve, i) => ({...look(curve, i), y: unpack(curve.psd)}))},
        {label: `cumulative RMS [${budget.unit}]`, unit: budget.unit, fromZero: true, height: 150, limits: budget.limits, curves: budget.curves.map((curve, i) => ({...look(curve, i), y: unpack(curve.cumulative)}))},
      ],
    });
  }
}

if (data.scene) {
  const scene = new Scene(data.scene);
  new SceneView(document.getElementById("model-view"), scene, true);
  sceneLegend(document.getElementById("model-legend"), scene);
  if (data.modes.length) new ModePlayer(scene, data.modes);
}
if (data.responses) new ResponseChart("responses-chart", data.responses, {});
if (data.comparison) new ResponseChart("comparison-chart", data.comparison, {test: {colour: "#b42318"}, model: {colour: "#18222d", dash: "6 4"}});
if (data.budget) drawBudget(data.budget);
if (data.history) drawHistory(data.history);
document.documentElement.dataset.ready = "yes";
