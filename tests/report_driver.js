// Drives the report as a reader would and writes what came of it into the document.
window.addEventListener("error", (event) => { document.documentElement.dataset.failure = event.message; });
setTimeout(() => {
  const found = {title: document.title, ready: document.documentElement.dataset.ready, failures: []};
  const painted = (canvas) => {
    const copy = document.createElement("canvas"); copy.width = canvas.width; copy.height = canvas.height;
    const context = copy.getContext("2d"); context.drawImage(canvas, 0, 0);
    const pixels = context.getImageData(0, 0, copy.width, copy.height).data;
    let sum = 0, count = 0;
    for (let i = 3; i < pixels.length; i += 4) if (pixels[i] > 40) { count++; sum = (sum * 31 + i + pixels[i - 3]) % 1e9; }
    return {share: count / (pixels.length / 4), sum};
  };
  const still = document.getElementById("model-view"), moving = document.getElementById("mode-view");
  found.painter = still.dataset.painter;
  found.before = painted(still.querySelector("canvas")); found.paper = painted(still.querySelector("canvas.paper"));
  const overlay = still.querySelector("canvas:last-of-type");
  for (let i = 0; i < 6; i++) overlay.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft"}));
  found.turned = painted(still.querySelector("canvas"));
  const modes = [...document.querySelectorAll("#mode-list button")];
  found.modes = modes.length;
  document.getElementById("mode-run").textContent === "pause" && document.getElementById("mode-run").click();
  modes[0].click(); found.first = painted(moving.querySelector("canvas"));
  modes[2].click(); found.third = painted(moving.querySelector("canvas")); found.heading = document.getElementById("mode-title").textContent;
  found.bars = [...document.querySelectorAll("#mode-strain .bar")].map((bar) => bar.style.width);
  const chart = document.getElementById("responses-chart"), [input, output] = document.querySelectorAll("#responses-chart-choice select");
  const curves = () => [...chart.querySelectorAll("path.curve")].map((path) => path.getAttribute("d").length);
  found.curves = curves(); found.ylabel = [...chart.querySelectorAll("text")].at(-1).textContent;
  input.value = "1"; input.dispatchEvent(new Event("change")); found.other = curves();
  found.caption = document.querySelector("#responses .printed").textContent;
  const drawing = chart.querySelector("svg"), box = drawing.getBoundingClientRect();
  const at = (kind, share) => drawing.dispatchEvent(new PointerEvent(kind, {clientX: box.left + share * box.width, clientY: box.top + 60, pointerId: 1, bubbles: true}));
  drawing.setPointerCapture = () => {};
  at("pointermove", 0.5); found.hint = chart.querySelector(".hint").textContent;
  at("pointerdown", 0.4); at("pointermove", 0.6); at("pointerup", 0.6);
  found.zoomed = [...chart.querySelectorAll("text")].map((t) => t.textContent);
  found.charts = document.querySelectorAll(".chart svg").length;
  found.wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
  document.documentElement.dataset.found = JSON.stringify(found);
}, 700);
