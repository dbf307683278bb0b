// The viewer of a report: choose a scene, hide layers or peel them off, choose colours, fly to a mark.
import { unpacked, surfaceOf } from "./pack.js";
import { boundsOf } from "./math.js";
import { Viewer } from "./viewer.js";

/** The colours of marks and hems. */
const MARK_COLOR = [220, 30, 30];
const HEM_COLOR = [20, 90, 220];
/** The choice of colours without any per vertex. */
const PLAIN = "by layer";

/** @template {HTMLElement} T @param {string} id @returns {T} */
const element = (id) => /** @type {T} */ (document.getElementById(id));

async function begin() {
  const data = JSON.parse(element("scene-data").textContent ?? "");
  const stream = await unpacked(element("geometry").textContent ?? "");
  const canvas = /** @type {HTMLCanvasElement} */ (element("view"));
  const viewer = new Viewer(canvas);
  Object.assign(window, { viewer });
  const sceneChoice = /** @type {HTMLSelectElement} */ (element("scene"));
  const colorChoice = /** @type {HTMLSelectElement} */ (element("colors"));
  const peel = /** @type {HTMLInputElement} */ (element("peel"));
  const parts = /** @type {HTMLFieldSetElement} */ (element("parts"));
  const wire = /** @type {HTMLInputElement} */ (element("wire"));
  const hems = /** @type {HTMLInputElement} */ (element("hems"));
  /** @type {{ drawn: any, surface: any, box: HTMLInputElement, isScan: boolean, color: number[] }[]} */
  let shown = [];
  /** @type {any} */
  let scene = null;

  data.scenes.forEach((/** @type {any} */ one, /** @type {number} */ k) => sceneChoice.add(new Option(one.name, String(k))));

  function home() {
    const visible = shown.filter((part) => part.box.checked);
    const boxes = (visible.length ? visible : shown).map((part) => boundsOf(part.surface.positions));
    if (boxes.length === 0) return;
    const min = [0, 1, 2].map((axis) => Math.min(...boxes.map((b) => b.min[axis])));
    const max = [0, 1, 2].map((axis) => Math.max(...boxes.map((b) => b.max[axis])));
    viewer.camera.yaw = 0;
    viewer.camera.pitch = 0.05;
    viewer.camera.frame(min, max, viewer.aspect());
    viewer.draw();
  }

  function showParts() {
    for (const part of shown) part.drawn.isVisible = part.box.checked;
    viewer.draw();
  }

  function showColors() {
    for (const part of shown) viewer.setColors(part.drawn, part.surface.colors.get(colorChoice.value) ?? null);
    const legend = element("legend");
    legend.replaceChildren();
    const entries =
      colorChoice.value === "air to the skin"
        ? data.ease
        : colorChoice.value === PLAIN
          ? shown.map((part) => [part.box.value, part.color])
          : colorChoice.value === "labels"
            ? [[`${scene.name}`, [230, 80, 60]], ["not labelled", [150, 150, 150]]]
            : [];
    for (const [name, color] of entries) {
      const line = document.createElement("div");
      const swatch = document.createElement("span");
      swatch.className = "swatch";
      swatch.style.background = `rgb(${color.join(",")})`;
      line.append(swatch, name);
      legend.append(line);
    }
  }

  function showMarks() {
    for (const line of [...viewer.lines]) viewer.removeLine(line);
    if (!hems.checked) return;
    for (const hem of scene.hems) viewer.addLine(Float32Array.from(hem, (/** @type {number} */ c) => c / 1000), HEM_COLOR, "loop", false);
    for (const mark of scene.marks) viewer.addLine(Float32Array.from(mark.at), MARK_COLOR, "points", true);
  }

  /** @param {number} k */
  function show(k) {
    scene = data.scenes[k];
    sceneChoice.value = String(k);
    viewer.clear();
    parts.querySelectorAll("label").forEach((label) => label.remove());
    shown = scene.parts.map((/** @type {any} */ part) => {
      const surface = surfaceOf(part.surface, stream);
      const drawn = viewer.addSurface(surface.positions, surface.indices, part.color);
      const box = document.createElement("input");
      box.type = "checkbox";
      box.value = part.name;
      box.checked = !part.is_hidden;
      box.addEventListener("change", showParts);
      const label = document.createElement("label");
      label.append(box, ` ${part.name}`);
      parts.append(label);
      return { drawn, surface, box, isScan: part.name === "scan", color: part.color };
    });
    const before = colorChoice.value;
    const names = new Set(shown.flatMap((part) => [...part.surface.colors.keys()]));
    colorChoice.replaceChildren(...[PLAIN, ...names].map((name) => new Option(name, name)));
    const wanted = [before, "as scanned", PLAIN].find((name) => name === PLAIN || names.has(name));
    colorChoice.value = wanted ?? PLAIN;
    const layers = shown.filter((part) => !part.isScan).length;
    peel.max = String(Math.max(0, layers - 1));
    peel.value = "0";
    showColors();
    showParts();
    showMarks();
    home();
  }

  peel.addEventListener("input", () => {
    const layers = shown.filter((part) => !part.isScan);
    layers.forEach((part, k) => (part.box.checked = k < layers.length - Number(peel.value)));
    showParts();
  });
  sceneChoice.addEventListener("change", () => show(Number(sceneChoice.value)));
  colorChoice.addEventListener("change", showColors);
  hems.addEventListener("change", showMarks);
  wire.addEventListener("change", () => {
    viewer.isWireframe = wire.checked;
    viewer.draw();
  });
  element("home").addEventListener("click", home);
  element("panel").addEventListener("submit", (e) => e.preventDefault());
  for (const button of document.querySelectorAll("button[data-scene]")) {
    button.addEventListener("click", () => {
      const { scene: k, mark } = /** @type {HTMLElement} */ (button).dataset;
      show(Number(k));
      if (mark !== undefined) {
        const { at } = scene.marks[Number(mark)];
        viewer.camera.target = at;
        viewer.camera.distance = 0.7;
        viewer.camera.yaw = at[2] < 0 ? Math.PI : 0;
        viewer.draw();
      }
      canvas.scrollIntoView({ block: "center" });
      canvas.focus({ preventScroll: true });
    });
  }
  show(0);
  element("note").textContent = "Drag to turn, shift and drag to move, wheel or pinch to zoom; with keys: arrows, shift and arrows, + and −.";
}

begin().catch((error) => {
  element("note").textContent = `The layers cannot be shown in 3D: ${error.message}. The pictures below show them.`;
});
