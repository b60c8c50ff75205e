"use strict";
// Arrays come as {"f4": base64}: 32-bit floats, 16-bit integers, 32-bit counts.
function unpack(packed) {
  const [kind] = Object.keys(packed), text = atob(packed[kind]), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return new {f4: Float32Array, i2: Int16Array, u4: Uint32Array}[kind](bytes.buffer);
}

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function rgb(hex) {
  return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
}

// The model's points, unpacked once and shared by all views.
class Scene {
  constructor(data) {
    Object.assign(this, data);
    this.positions = unpack(data.positions);
    this.faces = unpack(data.faces);
    this.lines = unpack(data.lines);
    this.motions = data.modes.map((mode) => unpack(mode.motion));
  }
}

const FACE_VERTEX = `#version 300 es
in vec3 position; in vec3 motion; uniform float amplitude; uniform mat3 turn; uniform vec4 window; uniform float depth; out vec3 seen;
void main() {
  seen = turn * (position + amplitude * motion);
  gl_Position = vec4((seen.xy + window.zw) * window.xy, -seen.z * depth, 1.0);
}`;
// The normal comes from the surface on the screen, so that it follows the deformed shape.
const FACE_FRAGMENT = `#version 300 es
precision highp float; in vec3 seen; uniform vec4 colour; out vec4 painted;
void main() {
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  float light = 0.50 + 0.38 * abs(normal.z) + 0.12 * dot(normal, vec3(-0.45, 0.7, 0.55));
  painted = vec4(colour.rgb * light * colour.a, colour.a);
}`;
// Every line is a rectangle as wide as asked on the screen, a little nearer than the faces that it borders.
const LINE_VERTEX = `#version 300 es
in vec3 from; in vec3 to; in vec3 fromMotion; in vec3 toMotion; in vec4 ink; in float width;
uniform float amplitude; uniform mat3 turn; uniform vec4 window; uniform float depth; uniform vec2 pixels; uniform float ghost; out vec4 colour;
void main() {
  vec3 a = turn * (from + amplitude * fromMotion), b = turn * (to + amplitude * toMotion);
  bool end = gl_VertexID >= 2;
  float side = gl_VertexID % 2 == 0 ? 1.0 : -1.0;
  vec3 here = end ? b : a;
  vec2 along = (b.xy - a.xy) * window.xy * pixels;
  float length_ = max(length(along), 1e-6);
  vec2 across = vec2(-along.y, along.x) / length_;
  vec2 place = (here.xy + window.zw) * window.xy + side * width * across / pixels;
  gl_Position = vec4(place, -here.z * depth - 0.002, 1.0);
  colour = vec4(ink.rgb, ink.a * ghost);
  // Edges of bodies have an alpha below 1; only glyphs shine through what is before them.
  if (ghost < 1.0 && ink.a < 1.0) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;
const LINE_FRAGMENT = `#version 300 es
precision highp float; in vec4 colour; out vec4 painted;
void main() { painted = vec4(colour.rgb * colour.a, colour.a); }`;

function lineStyle(part) {
  if (part.kind === "flexible body") return {shade: 0.35, alpha: part.faces[1] ? 0.55 : 0.99, width: part.faces[1] ? 1 : 2.5};
  if (part.kind === "rigid body") return {shade: 0.65, alpha: 0.9, width: 1.2};
  return {shade: 1, alpha: 1, width: part.kind === "fixation" ? 1.2 : part.kind === "connection" ? 1.6 : 2.2};
}

class WebGLPainter {
  constructor(canvas, scene) {
    const gl = canvas.getContext("webgl2", {antialias: true, premultipliedAlpha: true, preserveDrawingBuffer: true});
    if (!gl) throw new Error("no WebGL 2");
    this.gl = gl; this.scene = scene;
    this.faceProgram = this.program(FACE_VERTEX, FACE_FRAGMENT);
    this.lineProgram = this.program(LINE_VERTEX, LINE_FRAGMENT);
    this.motion = new Float32Array(scene.positions.length);
    this.buildFaces(); this.buildLines();
  }
  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source); gl.compileShader(shader); gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    return program;
  }
  attribute(program, name, size, data, usage, divisor = 0) {
    const gl = this.gl, buffer = gl.createBuffer(), place = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, data, usage);
    gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
    gl.vertexAttribDivisor(place, divisor);
    return buffer;
  }
  buildFaces() {
    const gl = this.gl;
    this.faceArray = gl.createVertexArray(); gl.bindVertexArray(this.faceArray);
    this.attribute(this.faceProgram, "position", 3, this.scene.positions, gl.STATIC_DRAW);
    this.motionBuffer = this.attribute(this.faceProgram, "motion", 3, this.motion, gl.DYNAMIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, this.scene.faces, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
  }
  buildLines() {
    const gl = this.gl, {lines, parts} = this.scene, count = lines.length / 2;
    const ink = new Float32Array(4 * count), width = new Float32Array(count);
    for (const part of parts) {
      const style = lineStyle(part), colour = rgb(part.colour);
      for (let i = part.lines[0] / 2; i < (part.lines[0] + part.lines[1]) / 2; i++) {
        ink.set([...colour.map((c) => c * style.shade), style.alpha], 4 * i); width[i] = style.width;
      }
    }
    this.lineArray = gl.createVertexArray(); gl.bindVertexArray(this.lineArray);
    this.attribute(this.lineProgram, "from", 3, this.ends(this.scene.positions, 0), gl.STATIC_DRAW, 1);
    this.attribute(this.lineProgram, "to", 3, this.ends(this.scene.positions, 1), gl.STATIC_DRAW, 1);
    this.fromMotion = this.attribute(this.lineProgram, "fromMotion", 3, this.ends(this.motion, 0), gl.DYNAMIC_DRAW, 1);
    this.toMotion = this.attribute(this.lineProgram, "toMotion", 3, this.ends(this.motion, 1), gl.DYNAMIC_DRAW, 1);
    this.attribute(this.lineProgram, "ink", 4, ink, gl.STATIC_DRAW, 1);
    this.attribute(this.lineProgram, "width", 1, width, gl.STATIC_DRAW, 1);
    gl.bindVertexArray(null);
  }
  ends(values, end) {
    const {lines} = this.scene, found = new Float32Array(3 * lines.length / 2);
    for (let i = 0; i < lines.length / 2; i++) for (let k = 0; k < 3; k++) found[3 * i + k] = values[3 * lines[2 * i + end] + k];
    return found;
  }
  setMotion(motion) {
    const gl = this.gl;
    for (const [buffer, values] of [[this.motionBuffer, motion], [this.fromMotion, this.ends(motion, 0)], [this.toMotion, this.ends(motion, 1)]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    }
  }
  draw(camera, amplitude, width, height) {
    const gl = this.gl;
    gl.viewport(0, 0, gl.canvas.width, gl.canvas.height);
    gl.clearColor(0, 0, 0, 0); gl.depthMask(true); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST); gl.depthFunc(gl.LEQUAL); gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const window_ = [2 * camera.zoom / width, 2 * camera.zoom / height, camera.pan[0], camera.pan[1]];
    const set = (program) => {
      gl.useProgram(program);
      gl.uniform1f(gl.getUniformLocation(program, "amplitude"), amplitude);
      gl.uniformMatrix3fv(gl.getUniformLocation(program, "turn"), true, camera.turn());
      gl.uniform4fv(gl.getUniformLocation(program, "window"), window_);
      gl.uniform1f(gl.getUniformLocation(program, "depth"), 1 / this.scene.size);
    };
    const faces = (part) => {
      gl.uniform4fv(gl.getUniformLocation(this.faceProgram, "colour"), [...rgb(part.colour), part.opacity]);
      gl.drawElements(gl.TRIANGLES, part.faces[1], gl.UNSIGNED_INT, 4 * part.faces[0]);
    };
    set(this.faceProgram); gl.bindVertexArray(this.faceArray);
    this.scene.parts.filter((part) => part.opacity === 1 && part.faces[1]).forEach(faces);
    set(this.lineProgram);
    gl.uniform2fv(gl.getUniformLocation(this.lineProgram, "pixels"), [width, height]);
    gl.bindVertexArray(this.lineArray);
    this.drawLines(1);
    // What one looks through comes last and hides nothing behind it.
    set(this.faceProgram); gl.bindVertexArray(this.faceArray); gl.depthMask(false);
    this.scene.parts.filter((part) => part.opacity < 1 && part.faces[1]).forEach(faces);
    gl.disable(gl.DEPTH_TEST);
    gl.useProgram(this.lineProgram); gl.bindVertexArray(this.lineArray);
    this.drawLines(0.4);
    gl.depthMask(true); gl.bindVertexArray(null);
  }
  drawLines(ghost) {
    this.gl.uniform1f(this.gl.getUniformLocation(this.lineProgram, "ghost"), ghost);
    this.gl.drawArraysInstanced(this.gl.TRIANGLE_STRIP, 0, 4, this.scene.lines.length / 2);
  }
}

// Where a browser has no WebGL 2: the same picture on a plain canvas, far faces first.
class CanvasPainter {
  constructor(canvas, scene) {
    this.canvas = canvas; this.scene = scene; this.motion = new Float32Array(scene.positions.length);
    this.order = [];
    for (const part of scene.parts) {
      for (let i = 0; i < part.faces[1]; i += 3) this.order.push({part, at: part.faces[0] + i, face: true, depth: 0});
      const style = lineStyle(part), colour = rgb(part.colour).map((c) => Math.round(255 * c * style.shade));
      for (let i = 0; i < part.lines[1]; i += 2) this.order.push({part, at: part.lines[0] + i, face: false, depth: 0, width: style.width, ink: `rgba(${colour},${style.alpha})`});
    }
  }
  setMotion(motion) { this.motion = motion; }
  draw(camera, amplitude, width, height) {
    const context = this.canvas.getContext("2d"), ratio = this.canvas.width / width, turn = camera.turn();
    const {positions, faces, lines} = this.scene, count = positions.length / 3, seen = new Float32Array(3 * count);
    for (let i = 0; i < count; i++) {
      const p = [0, 1, 2].map((k) => positions[3 * i + k] + amplitude * this.motion[3 * i + k]);
      for (let k = 0; k < 3; k++) seen[3 * i + k] = turn[3 * k] * p[0] + turn[3 * k + 1] * p[1] + turn[3 * k + 2] * p[2];
    }
    const x = (i) => width / 2 + camera.zoom * (seen[3 * i] + camera.pan[0]);
    const y = (i) => height / 2 - camera.zoom * (seen[3 * i + 1] + camera.pan[1]);
    const bias = 0.002 * this.scene.size;
    for (const entry of this.order) {
      const index = entry.face ? faces : lines, corners = entry.face ? 3 : 2;
      entry.depth = entry.face ? 0 : bias;
      for (let k = 0; k < corners; k++) entry.depth += seen[3 * index[entry.at + k] + 2] / corners;
    }
    this.order.sort((a, b) => a.depth - b.depth);
    context.setTransform(ratio, 0, 0, ratio, 0, 0); context.clearRect(0, 0, width, height); context.lineJoin = "round";
    for (const {part, at, face, width: stroke, ink} of this.order) {
      const index = face ? faces : lines, a = index[at], b = index[at + 1];
      context.beginPath(); context.moveTo(x(a), y(a)); context.lineTo(x(b), y(b));
      if (!face) { context.strokeStyle = ink; context.lineWidth = stroke; context.stroke(); continue; }
      const c = index[at + 2], u = [0, 1, 2].map((k) => seen[3 * b + k] - seen[3 * a + k]), v = [0, 1, 2].map((k) => seen[3 * c + k] - seen[3 * a + k]);
      const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const light = 0.5 + 0.42 * Math.abs(normal[2]) / (Math.hypot(...normal) || 1);
      context.lineTo(x(c), y(c)); context.closePath();
      context.fillStyle = `rgba(${rgb(part.colour).map((value) => Math.round(255 * value * light))},${part.opacity})`;
      context.fill();
      if (part.opacity === 1) { context.strokeStyle = context.fillStyle; context.lineWidth = 0.7; context.stroke(); }
    }
  }
}

const VIEWS = {"3-D": [0.7, 0.42], x: [Math.PI / 2, 0], y: [Math.PI, 0], z: [0, Math.PI / 2]};

// Size of the picture for paper, in the units of its names.
const PAPER = [660, 400];

class Camera {
  constructor(size) { this.size = size; this.pan = [0, 0]; [this.around, this.up] = VIEWS["3-D"]; }
  // Rows: right, upward, towards the viewer. z stands up; "around" turns about it.
  turn() {
    const [ca, sa, cu, su] = [Math.cos(this.around), Math.sin(this.around), Math.cos(this.up), Math.sin(this.up)];
    return [ca, sa, 0, -su * sa, su * ca, cu, sa * cu, -ca * cu, su];
  }
}

class SceneView {
  constructor(host, scene, labelled) {
    this.host = host; this.scene = scene; this.labelled = labelled;
    this.camera = new Camera(scene.size); this.amplitude = 0;
    this.canvas = element("canvas", {"aria-hidden": "true"});
    this.overlay = element("canvas", {tabindex: "0", role: "img", "aria-label": "3-D picture of the model; drag or arrow keys turn it, plus and minus zoom"});
    host.append(this.canvas, this.overlay);
    try { this.painter = new WebGLPainter(this.canvas, scene); host.dataset.painter = "webgl"; }
    catch { this.canvas.replaceWith(this.canvas = element("canvas", {"aria-hidden": "true"})); this.painter = new CanvasPainter(this.canvas, scene); host.dataset.painter = "canvas"; }
    // Browsers leave WebGL out of what they print: a plain canvas, hidden on the screen, has the picture for paper.
    this.paper = element("canvas", {class: "paper", "aria-hidden": "true"});
    [this.paper.width, this.paper.height] = PAPER.map((length) => 2 * length);
    this.paperPainter = new CanvasPainter(this.paper, scene);
    this.overlay.before(this.paper);
    this.addTools(); this.listen();
    new ResizeObserver(() => this.fit()).observe(host);
    this.fit(); this.printLater();
  }
  addTools() {
    const tools = element("div", {class: "tools"});
    for (const name of Object.keys(VIEWS)) {
      const button = element("button", {type: "button", title: name === "3-D" ? "from the corner" : `along ${name}`}, name);
      button.addEventListener("click", () => { [this.camera.around, this.camera.up] = VIEWS[name]; this.camera.pan = [0, 0]; this.fit(); this.printLater(); });
      tools.append(button);
    }
    const names = element("button", {type: "button", "aria-pressed": String(this.labelled)}, "names");
    names.addEventListener("click", () => { this.labelled = !this.labelled; names.setAttribute("aria-pressed", String(this.labelled)); this.draw(); this.printLater(); });
    tools.append(names);
    this.host.append(tools);
  }
  listen() {
    const held = new Map();
    this.overlay.addEventListener("pointerdown", (event) => { held.set(event.pointerId, event); this.overlay.setPointerCapture(event.pointerId); this.overlay.focus({preventScroll: true}); });
    const release = (event) => held.delete(event.pointerId);
    this.overlay.addEventListener("pointerup", release); this.overlay.addEventListener("pointercancel", release);
    this.overlay.addEventListener("pointermove", (event) => {
      const before = held.get(event.pointerId);
      if (!before) return;
      const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
      if (event.buttons === 2 || event.shiftKey) { this.camera.pan[0] += dx / this.camera.zoom; this.camera.pan[1] -= dy / this.camera.zoom; this.draw(); }
      else this.rotate(-dx / 140, dy / 140);
      held.set(event.pointerId, event);
    });
    this.overlay.addEventListener("contextmenu", (event) => event.preventDefault());
    // The page scrolls with the wheel; only a picture that was clicked takes it for itself.
    this.overlay.addEventListener("wheel", (event) => {
      if (document.activeElement !== this.overlay && !event.ctrlKey) return;
      event.preventDefault(); this.camera.zoom *= Math.exp(-event.deltaY / 700); this.draw();
    }, {passive: false});
    this.overlay.addEventListener("keydown", (event) => {
      const turns = {ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[event.key];
      const zoom = {"+": 1.15, "=": 1.15, "-": 1 / 1.15}[event.key];
      if (!turns && !zoom) return;
      event.preventDefault();
      if (turns) this.rotate(...turns); else { this.camera.zoom *= zoom; this.draw(); }
    });
  }
  rotate(around, up) {
    this.camera.around += around;
    this.camera.up = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, this.camera.up + up));
    this.draw(); this.printLater();
  }
  setMode(number) {
    const motion = Float32Array.from(this.scene.motions[number], (value) => value * this.scene.modes[number].unit);
    this.motion = motion; this.painter.setMotion(motion); this.paperPainter.setMotion(motion);
    this.draw(); this.printLater();
  }
  // As large as the picture allows from this side, with room for the motion and the names.
  fitting(width, height) {
    const turn = this.camera.turn(), reach = [0, 0], {positions} = this.scene;
    for (let i = 0; i < positions.length; i += 3) for (let k = 0; k < 2; k++) {
      reach[k] = Math.max(reach[k], Math.abs(turn[3 * k] * positions[i] + turn[3 * k + 1] * positions[i + 1] + turn[3 * k + 2] * positions[i + 2]));
    }
    return 0.84 * Math.min(width / 2 / (reach[0] || 1), height / 2 / (reach[1] || 1));
  }
  fit() {
    const [width, height] = [this.host.clientWidth, this.host.clientHeight], ratio = window.devicePixelRatio || 1;
    if (!width || !height) return;
    for (const canvas of [this.canvas, this.overlay]) { canvas.width = width * ratio; canvas.height = height * ratio; }
    this.camera.zoom = this.fitting(width, height);
    this.draw();
  }
  draw() {
    const [width, height] = [this.host.clientWidth, this.host.clientHeight];
    if (!width || !height) return;
    const frame = {camera: this.camera, width, height, amplitude: this.amplitude};
    this.painter.draw(this.camera, this.amplitude, width, height);
    const context = this.overlay.getContext("2d"), ratio = this.overlay.width / width;
    context.setTransform(ratio, 0, 0, ratio, 0, 0); context.clearRect(0, 0, width, height);
    this.annotate(context, frame);
  }
  // The shape stands at its largest on paper; drawn when the view has come to rest.
  printLater() {
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => {
      const [width, height] = PAPER, camera = Object.assign(Object.create(Camera.prototype), this.camera, {zoom: this.fitting(width, height), pan: [0, 0]});
      const frame = {camera, width, height, amplitude: this.motion ? this.largest ?? 1 : 0};
      this.paperPainter.draw(camera, frame.amplitude, width, height);
      this.annotate(this.paper.getContext("2d"), frame);
    }, 60);
  }
  annotate(context, frame) {
    context.font = "12.5px 'Segoe UI', 'Helvetica Neue', Arial, sans-serif"; context.textBaseline = "middle";
    if (this.labelled) this.drawNames(context, frame);
    this.drawTriad(context, frame.height);
    if (!this.scene.schematic) this.drawScale(context, frame);
  }
  place(i, {camera, width, height, amplitude}) {
    const turn = camera.turn(), {positions} = this.scene;
    const p = [0, 1, 2].map((k) => positions[3 * i + k] + (this.motion ? amplitude * this.motion[3 * i + k] : 0));
    const seen = [0, 1].map((k) => turn[3 * k] * p[0] + turn[3 * k + 1] * p[1] + turn[3 * k + 2] * p[2]);
    return [width / 2 + camera.zoom * (seen[0] + camera.pan[0]), height / 2 - camera.zoom * (seen[1] + camera.pan[1])];
  }
  // A name stands beside what it names, or near it with a line to it; where there is no room it is left out.
  drawNames(context, frame) {
    const taken = [], high = 16, order = ["rigid body", "flexible body", "fixation", "input", "sensor", "connection"];
    const named = this.scene.parts.filter((part) => part.kind !== "connection" || this.scene.parts.length <= 40);
    named.sort((a, b) => order.indexOf(a.kind) - order.indexOf(b.kind));
    for (const part of named) {
      const [x, y] = this.anchor(part, frame), wide = context.measureText(part.name).width + 6;
      const places = [0, 1, -1, 2, -2, 3, -3].flatMap((row) => [[x + 5, y + high * row], [x - 5 - wide, y + high * row]]);
      const fits = ([left, middle]) => left >= 2 && left + wide <= frame.width - 2 && middle >= 10 && middle <= frame.height - 10
        && !taken.some((t) => Math.abs(t.middle - middle) < high && left < t.left + t.wide && t.left < left + wide);
      const place = places.find(fits);
      if (!place) continue;
      const [left, middle] = place;
      taken.push({left, middle, wide});
      const colour = part.kind === "rigid body" || part.kind === "flexible body" ? "#18222d" : part.colour;
      if (middle !== y) {
        context.strokeStyle = colour; context.lineWidth = 0.8;
        context.beginPath(); context.moveTo(x, y); context.lineTo(left > x ? left : left + wide, middle); context.stroke();
      }
      context.fillStyle = "rgba(255,255,255,.82)"; context.fillRect(left, middle - high / 2, wide, high);
      context.fillStyle = colour; context.fillText(part.name, left + 3, middle);
    }
  }
  anchor(part, frame) {
    const [first, count] = part.points;
    if (part.kind === "sensor" || part.kind === "input") return this.place(first + 1, frame);
    if (part.kind === "connection" && count > 4 && !this.scene.schematic) return this.place(first + 4 + Math.floor((count - 4) / 2), frame);
    if (part.kind === "fixation") return this.place(first, frame);
    const step = Math.max(1, Math.floor(count / 60)), sum = [0, 0];
    let used = 0;
    for (let i = 0; i < count; i += step, used++) this.place(first + i, frame).forEach((value, k) => { sum[k] += value; });
    return sum.map((value) => value / used);
  }
  drawTriad(context, height) {
    const turn = this.camera.turn(), [x, y] = [44, height - 44];
    ["x", "y", "z"].forEach((name, k) => {
      const end = [x + 27 * turn[k], y - 27 * turn[3 + k]];
      context.strokeStyle = context.fillStyle = ["#b42318", "#14713f", "#1f5f99"][k]; context.lineWidth = 2;
      context.beginPath(); context.moveTo(x, y); context.lineTo(...end); context.stroke();
      context.fillText(name, x + 37 * turn[k] - 3, y - 37 * turn[3 + k]);
    });
  }
  drawScale(context, {camera, width, height}) {
    const wanted = 130 / camera.zoom, power = 10 ** Math.floor(Math.log10(wanted));
    const length = power * [5, 2, 1].find((step) => step * power <= wanted), drawn = length * camera.zoom;
    const right = width - 18, low = height - 18;
    context.strokeStyle = context.fillStyle = "#56646f"; context.lineWidth = 1.5;
    context.beginPath(); context.moveTo(right - drawn, low - 5); context.lineTo(right - drawn, low); context.lineTo(right, low); context.lineTo(right, low - 5); context.stroke();
    const text = length >= 1 ? `${length} m` : `${Number((1000 * length).toPrecision(3))} mm`;
    context.fillText(text, right - drawn / 2 - context.measureText(text).width / 2, low - 12);
  }
}
