// The page on which garments are painted: what the pointer and the keys do, and what the server says.
import { bitsOf, unpacked, surfaceOf } from "./pack.js";
import { boundsOf } from "./math.js";
import { Viewer } from "./viewer.js";
import { boxed, circle, hit, mirrored, nearestVertex, pointOf, setColor, thinned, verticesNear } from "./surface.js";
import { Outbox, capital, newId } from "./outbox.js";
import { pressed } from "./keys.js";

const GARMENT_COLOR = [230, 80, 60];
const OTHER_COLORS = [[70, 130, 220], [60, 170, 110], [200, 150, 40], [160, 90, 200]];
const HEM_COLOR = [20, 90, 220];
const SCAN_COLOR = [190, 192, 196];
/** What a stroke looks like until the server has answered, by what it does. */
const FRESH_COLORS = { add: [255, 190, 60], erase: [60, 60, 70], clear: [255, 255, 255] };
/** How often it is asked what else happened, in milliseconds. */
const NEWS = 1000;
/** Farthest distance of a mirrored point from the scan, in metres: people do not stand quite symmetrically. */
const MIRROR_REACH = 0.06;

/** @template {HTMLElement} T @param {string} id @returns {T} */
const element = (id) => /** @type {T} */ (document.getElementById(id));
const box = (/** @type {string} */ id) => /** @type {HTMLInputElement} */ (element(id));
const choice = (/** @type {string} */ id) => /** @type {HTMLSelectElement} */ (element(id));
const chosen = (/** @type {string} */ name) => /** @type {HTMLInputElement} */ (document.querySelector(`input[name=${name}]:checked`)).value;

const query = new URLSearchParams(location.search);

/** What is known of a layer, in a sentence. @param {any} news */
function verdictOf(news) {
  const hems = `${news.hems} ${news.hems === 1 ? "hem" : "hems"} (expected: ${news.expected}), ${news.vertices} vertices; `;
  const verdict = news.verdict ? news.verdict[0] : "the verdict follows when you pause";
  return news.problem ?? `${news.name}: ${news.is_loaded ? hems : ""}${verdict}`;
}

class Easel {
  constructor() {
    this.viewer = new Viewer(/** @type {HTMLCanvasElement} */ (element("view")));
    /** @type {any} */
    this.layer = null;
    /** @type {any[]} */
    this.all = [];
    this.noteNumber = 0;
    this.freshColor = GARMENT_COLOR;
    this.loading = "";
    /** The path that is being drawn, or null. @type {any} */
    this.path = null;
    /** @type {any} */
    this.cursor = null;
    /** @type {any[]} */
    this.hemLines = [];
    this.outbox = new Outbox(query.get("token") ?? "", `overcoat-paint-${document.body.dataset.session}`, {
      sent: (message, answer) => this.sent(message, answer),
      refused: (message, error) => this.refused(message, error),
      state: (text, isBad) => this.say(text, isBad),
      shut: () => this.offerFiles(),
      prepare: (message) => this.prepare(message),
    });
    this.listen();
  }

  async begin() {
    const { status, answer } = await this.outbox.ask("/api/news");
    if (status !== 200) throw new Error(answer?.error ?? "the server does not answer");
    this.takeNews(answer);
    await this.show(query.get("layer") ?? this.all[0]?.name);
    this.listRefused();
    this.outbox.send();
    setTimeout(() => this.lookForNews(), NEWS);
  }

  // What is shown

  /** @param {string} name */
  async show(name) {
    if (!name || this.loading === name) return;
    this.loading = name;
    choice("layer").value = name;
    element("verdict").textContent = `Loading ${name} …`;
    const { status, answer } = await this.outbox.ask(`/api/layer?layer=${encodeURIComponent(name)}`);
    if (this.loading !== name) return;
    this.loading = "";
    if (status !== 200) {
      this.say(`${name} cannot be shown: ${answer?.error ?? "the server does not answer"}`, true);
      element("verdict").textContent = "";
      return;
    }
    const stream = await unpacked(answer.geometry);
    const isOther = this.layer?.name !== name;
    this.viewer.clear();
    [this.hemLines, this.cursor] = [[], null];
    const sent = surfaceOf(answer.surface, stream);
    const surface = boxed(sent);
    const drawn = this.viewer.addSurface(surface.positions, surface.indices, SCAN_COLOR);
    this.viewer.setColors(drawn, sent.colors.get("as scanned") ?? null);
    const inside = answer.inside.map((/** @type {any} */ part) => {
      const { positions, indices } = surfaceOf(part.surface, stream);
      return { name: part.name, color: part.color, drawn: this.viewer.addSurface(positions, indices, part.color) };
    });
    const count = answer.surface.vertices;
    const others = answer.others.map((/** @type {any} */ other) => ({ name: other.name, labels: bitsOf(other.labels, count) }));
    const { scan, middle, facing } = answer;
    this.layer = { name, scan, surface, drawn, inside, others, middle, facing, count, cut: null, fresh: new Uint8Array(count) };
    [this.layer.labelled, this.layer.overlay] = [new Uint8Array(4 * count), new Uint8Array(4 * count)];
    this.takeLabels(answer);
    if (isOther) this.home();
    this.showParts();
    // For tests, and for those who like to look inside.
    Object.assign(window, { easel: this, viewer: this.viewer });
    document.body.dataset.layer = name;
  }

  /** Takes labels and hems of the layer that is shown. @param {any} answer */
  takeLabels(answer) {
    const { layer, viewer } = this;
    layer.labels = bitsOf(answer.labels, layer.count);
    layer.version = answer.news.version;
    layer.fresh.fill(0);
    this.hemLines.forEach((line) => viewer.removeLine(line));
    const line = (/** @type {number[]} */ hem) => viewer.addLine(Float32Array.from(hem, (c) => c / 1000), HEM_COLOR, "loop", false);
    this.hemLines = answer.hem_lines.map(line);
    if (layer.cut) this.forgetCut();
    this.showOverlay();
    this.showParts();
    this.showNews(answer.news);
  }

  forgetCut() {
    this.viewer.removeSurface(this.layer.cut);
    this.layer.cut = null;
  }

  async showParts() {
    const { layer, viewer } = this;
    if (!layer) return;
    const isCut = choice("surface").value === "cut";
    if (isCut && !layer.cut) {
      const { status, answer } = await this.outbox.ask(`/api/cut?layer=${encodeURIComponent(layer.name)}`);
      if (status !== 200 || layer !== this.layer || layer.cut) return;
      const surface = surfaceOf(answer.surface, await unpacked(answer.geometry));
      layer.cut = viewer.addSurface(surface.positions, surface.indices, GARMENT_COLOR);
      viewer.setColors(layer.cut, surface.colors.get("as scanned") ?? null);
    }
    layer.drawn.isVisible = !isCut;
    if (layer.cut) layer.cut.isVisible = isCut;
    for (const part of layer.inside) part.drawn.isVisible = isCut && box("others").checked;
    for (const line of this.hemLines) line.isVisible = box("hems").checked;
    viewer.draw();
    this.showLegend();
  }

  /** Shows the labels, and over them what is being drawn. */
  showOverlay() {
    const { layer } = this;
    layer.labelled.fill(0);
    const put = (/** @type {Uint8Array} */ labels, /** @type {number[]} */ color, /** @type {number} */ share) => {
      for (let v = 0; v < layer.count; v++) if (labels[v]) setColor(layer.labelled, v, color, share);
    };
    if (box("overlay").checked) {
      const others = box("others").checked ? layer.others : [];
      for (let k = others.length - 1; k >= 0; k--) put(others[k].labels, OTHER_COLORS[k % OTHER_COLORS.length], 90);
      put(layer.labels, GARMENT_COLOR, 130);
    }
    /** @type {number[]} */
    const fresh = [];
    layer.fresh.forEach((/** @type {number} */ is, /** @type {number} */ v) => is && fresh.push(v));
    this.showFresh(fresh, true);
  }

  /** Shows what is being drawn at these vertices. @param {number[]} vertices @param {boolean} alone whether nothing else is drawn */
  showFresh(vertices, alone) {
    const { layer, viewer } = this;
    if (alone) layer.overlay.set(layer.labelled);
    for (const v of vertices) setColor(layer.overlay, v, this.freshColor, 190);
    viewer.setOverlay(layer.drawn, layer.overlay);
  }

  showLegend() {
    const legend = element("legend");
    const { layer } = this;
    const isCut = choice("surface").value === "cut";
    /** @type {[string, number[]][]} */
    const entries = isCut ? [] : [[layer.name, GARMENT_COLOR]];
    if (box("others").checked && isCut) entries.push(...layer.inside.map((/** @type {any} */ part) => [part.name, part.color]));
    if (box("others").checked && !isCut) {
      layer.others.forEach((/** @type {any} */ other, /** @type {number} */ k) => {
        const news = this.all.find((one) => one.name === other.name);
        entries.push([news ? verdictOf(news) : other.name, OTHER_COLORS[k % OTHER_COLORS.length]]);
      });
    }
    legend.replaceChildren(
      ...entries.map(([name, color]) => {
        const line = document.createElement("div");
        const swatch = document.createElement("span");
        swatch.className = "swatch";
        swatch.style.background = `rgb(${color.join(",")})`;
        line.append(swatch, name);
        return line;
      }),
    );
  }

  home() {
    const { layer, viewer } = this;
    if (!layer) return;
    const { min, max } = boundsOf(layer.surface.positions);
    viewer.camera.yaw = Math.atan2(layer.facing[0], layer.facing[2]);
    viewer.camera.pitch = 0.05;
    viewer.camera.frame(min, max, viewer.aspect());
    viewer.draw();
  }

  // What the server says

  /** @param {string} text @param {boolean} isBad */
  say(text, isBad) {
    element("state").textContent = text;
    element("state").className = isBad ? "bad" : "";
  }

  /** @param {any} news */
  showNews(news) {
    this.all = this.all.map((one) => (one.name === news.name ? news : one));
    if (news.name !== this.layer?.name) return;
    const line = element("verdict");
    line.textContent = verdictOf(news);
    line.className = news.problem ? "bad" : !news.hems_are_right ? "doubt" : (news.verdict?.[1] ?? "waits");
    element("findings").replaceChildren(
      ...news.findings.map((/** @type {string} */ finding) => {
        const item = document.createElement("li");
        item.textContent = finding;
        return item;
      }),
    );
    const waiting = this.outbox.waiting(news.name);
    /** @type {HTMLButtonElement} */ (element("undo")).disabled = !news.last && waiting === 0;
    /** @type {HTMLButtonElement} */ (element("redo")).disabled = !news.redo;
  }

  /** @param {any} news */
  takeNews(news) {
    this.all = news.layers;
    const names = news.layers.map((/** @type {any} */ layer) => layer.name);
    const select = choice("layer");
    if (names.join("\n") !== Array.from(select.options, (option) => option.value).join("\n")) {
      select.replaceChildren(...names.map((/** @type {string} */ name) => new Option(name, name)));
    }
    if (this.layer) select.value = this.layer.name;
    if (news.note && news.note[0] > this.noteNumber) {
      this.noteNumber = news.note[0];
      element("note").textContent = capital(news.note[1]) + ".";
    }
  }

  async lookForNews() {
    const { layer } = this;
    const about = layer ? `?layer=${encodeURIComponent(layer.name)}&version=${layer.version}` : "";
    const { status, answer } = await this.outbox.ask(`/api/news${about}`);
    if (status === 200 && layer === this.layer) {
      if (this.isAway) this.say("", false);
      this.isAway = false;
      this.takeNews(answer);
      const own = answer.layers.find((/** @type {any} */ one) => one.name === layer?.name);
      if (own && layer && own.is_loaded && own.scan !== layer.scan) {
        await this.show(layer.name);
      } else if (own && layer) {
        const isBehind = answer.labels && own.version !== layer.version;
        // While a stroke is under way its own answer follows.
        if (isBehind && this.outbox.waiting(layer.name) === 0 && !this.path) this.takeLabels({ ...answer, news: own });
        else this.showNews(own);
      } else if (layer) {
        element("verdict").textContent = `${layer.name} is no longer a layer of the session`;
        element("verdict").className = "bad";
      }
    } else if (status !== 200 && this.outbox.messages.length === 0) {
      this.isAway = true;
      this.say(answer?.error ? `${capital(answer.error)}.` : "The server does not answer. Nothing is lost: all strokes are saved.", true);
    }
    await this.lookAtOthers();
    setTimeout(() => this.lookForNews(), NEWS);
  }

  /** Shows what strokes on this layer have changed on the other garments of its scan. */
  async lookAtOthers() {
    const { layer } = this;
    if (!layer) return;
    for (const other of layer.others) {
      const news = this.all.find((one) => one.name === other.name);
      if (!news?.is_loaded || news.scan !== layer.scan || news.version === other.version) continue;
      const { status, answer } = await this.outbox.ask(`/api/news?layer=${encodeURIComponent(other.name)}`);
      if (status !== 200 || layer !== this.layer) return;
      other.labels = bitsOf(answer.labels, layer.count);
      other.version = news.version;
      this.showOverlay();
    }
    this.showLegend();
  }

  /** @param {any} message @param {any} answer */
  sent(message, answer) {
    this.lastMs = answer.ms;
    document.body.dataset.done = message.body.id;
    this.showNews(answer.news);
    if (this.layer?.name !== message.layer) return;
    if (answer.news.scan !== this.layer.scan) this.show(message.layer);
    else if (this.outbox.waiting(message.layer) === 0) this.takeLabels(answer);
  }

  /** @param {any} message @param {any} error */
  refused(message, error) {
    if (this.layer && this.outbox.waiting(this.layer.name) === 0) {
      this.layer.fresh.fill(0);
      this.showOverlay();
    }
    if (message.path !== "/api/paint") {
      this.say(`${capital(message.what)} was not possible: ${error.error}.`, true);
      return;
    }
    this.listRefused();
    if (error.kind === "moved" && this.layer?.name === message.layer) this.show(message.layer);
  }

  /** Lists the strokes that were refused, also before the page was loaded again, each with what can be done. */
  listRefused() {
    const button = (/** @type {string} */ text, /** @type {() => void} */ act) => {
      const made = document.createElement("button");
      [made.type, made.textContent] = ["button", text];
      made.addEventListener("click", act);
      return made;
    };
    const lines = this.outbox.refused.map((message) => {
      const takeOut = () => {
        this.outbox.takeOut(message);
        this.listRefused();
      };
      const again = button("Try again", () => {
        takeOut();
        if (message.layer === this.layer?.name) message.body.scan = this.layer.scan;
        this.outbox.put(message);
      });
      const line = document.createElement("p");
      line.className = "bad";
      line.setAttribute("role", "alert");
      line.append(`A stroke on ${message.layer} was not applied: ${message.refusal}. `, again, " ", button("Discard it", takeOut));
      return line;
    });
    element("refused").replaceChildren(...lines);
  }

  /** The server will never take what waits: the person can keep it as files for `overcoat mask`. */
  offerFiles() {
    for (const [layer, text] of this.outbox.files()) {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([text], { type: "application/jsonl" }));
      link.download = `${layer}-unsaved.jsonl`;
      link.textContent = `Keep the unsaved strokes on ${layer} as a file for \u201covercoat mask ${layer} FILE\u201d`;
      const line = document.createElement("p");
      line.append(link);
      element("files").append(line);
    }
  }

  /** Completes a message when its turn comes; false if there is nothing to do. @param {any} message */
  prepare(message) {
    if (message.path === "/api/paint" || message.body.stroke) return true;
    const news = this.all.find((one) => one.name === message.layer);
    const stroke = message.path === "/api/undo" ? news?.last : news?.redo;
    if (!stroke) return false;
    message.body.stroke = stroke;
    return true;
  }

  // What the person does

  /** @param {"undo" | "redo"} what */
  step(what) {
    const { layer } = this;
    if (layer) this.outbox.put({ path: `/api/${what}`, layer: layer.name, what, body: { id: newId(), layer: layer.name } });
  }

  radius() {
    return Number(box("size").value) / 1000;
  }

  /** @param {PointerEvent | MouseEvent} e */
  under(e) {
    return this.layer && choice("surface").value === "scan" ? hit(this.layer.surface, this.viewer.ray(e)) : null;
  }

  /** @param {PointerEvent} e */
  press(e) {
    const found = e.ctrlKey || e.altKey || e.metaKey ? null : this.under(e);
    if (!found) return false;
    const op = /** @type {"add" | "erase" | "clear"} */ (chosen("op"));
    this.freshColor = FRESH_COLORS[op];
    this.path = { tool: chosen("tool"), op, radius: this.radius(), points: [found.point], from: e, line: null, misses: 0 };
    this.drawPath();
    return true;
  }

  /** @param {PointerEvent} e */
  drag(e) {
    const { path } = this;
    if (!path) return;
    if (path.tool === "line") {
      path.points = this.between(path.from, e);
    } else {
      const events = e.getCoalescedEvents?.() ?? [];
      for (const one of events.length > 0 ? events : [e]) {
        const found = this.under(one);
        if (found) path.points.push(found.point);
        else path.misses++;
      }
    }
    this.drawPath();
  }

  /** The places of the surface on the straight line between two places of the picture. @param {PointerEvent} a @param {PointerEvent} b */
  between(a, b) {
    const count = Math.max(2, Math.ceil(Math.hypot(b.clientX - a.clientX, b.clientY - a.clientY) / 8));
    const points = [];
    for (let k = 0; k <= count; k++) {
      const at = { clientX: a.clientX + ((b.clientX - a.clientX) * k) / count, clientY: a.clientY + ((b.clientY - a.clientY) * k) / count };
      const found = this.under(/** @type {PointerEvent} */ (at));
      if (found) points.push(found.point);
    }
    return points;
  }

  drawPath() {
    const { path, layer, viewer } = this;
    if (path.line) viewer.removeLine(path.line);
    path.line = viewer.addLine(Float32Array.from(path.points.flat()), this.freshColor, path.tool === "lasso" ? "loop" : "line", true);
    if (path.tool === "lasso") return;
    if (path.tool === "line") layer.fresh.fill(0);
    const points = path.tool === "line" ? path.points : path.points.slice(-4);
    const near = points.flatMap((/** @type {number[]} */ at) => verticesNear(layer.surface, at, path.radius));
    for (const v of near) layer.fresh[v] = 1;
    this.showFresh(near, path.tool === "line");
  }

  release() {
    const { path, layer } = this;
    if (!path) return;
    this.path = null;
    if (path.line) this.viewer.removeLine(path.line);
    const closed = path.tool === "lasso";
    const points = thinned(path.points, closed ? 0.006 : Math.min(0.01, 0.4 * path.radius));
    if (closed && points.length < 3) {
      this.say("A lasso is drawn around a part of the scan, in one move.", true);
      return;
    }
    this.say(path.misses > 0 && closed ? "The lasso left the scan for a moment; there it goes straight on." : "", false);
    const strokes = [{ op: path.op, radius: path.radius, points, ...(closed ? { closed } : {}) }];
    if (box("mirror").checked) {
      const image = this.mirror(points);
      if (image.length > (closed ? 2 : 0)) strokes.push({ ...strokes[0], points: image });
      else this.say("The mirrored stroke is not on the scan, so only one is painted.", true);
    }
    const body = { id: newId(), layer: layer.name, scan: layer.scan, strokes };
    this.outbox.put({ path: "/api/paint", layer: layer.name, what: "a stroke", body });
  }

  /** @param {number[][]} points */
  mirror(points) {
    const { surface } = this.layer;
    const found = points.map((at) => nearestVertex(surface, mirrored(at, this.layer.middle, this.layer.facing)));
    return found.filter((one) => one.distance < MIRROR_REACH).map((one) => pointOf(surface.positions, one.vertex));
  }

  /** @param {PointerEvent} e */
  hover(e) {
    const { viewer } = this;
    if (this.cursor) viewer.removeLine(this.cursor);
    this.cursor = null;
    const found = this.under(e);
    if (found) this.cursor = viewer.addLine(circle(found.point, found.normal, this.radius()), [20, 20, 20], "loop", true);
  }

  listen() {
    const { viewer } = this;
    viewer.onPress = (e) => this.press(e);
    viewer.onDrag = (e) => this.drag(e);
    viewer.onRelease = () => this.release();
    viewer.canvas.addEventListener("pointermove", (e) => this.hover(e));
    element("panel").addEventListener("submit", (e) => e.preventDefault());
    choice("layer").addEventListener("change", () => this.show(choice("layer").value));
    element("undo").addEventListener("click", () => this.step("undo"));
    element("redo").addEventListener("click", () => this.step("redo"));
    element("home").addEventListener("click", () => this.home());
    const sizeText = () => (element("size-text").textContent = `${box("size").value} mm`);
    box("size").addEventListener("input", sizeText);
    sizeText();
    for (const id of ["surface", "others", "hems"]) element(id).addEventListener("change", () => this.showParts());
    for (const id of ["overlay", "others"]) element(id).addEventListener("change", () => this.layer && this.showOverlay());
    box("wire").addEventListener("change", () => {
      viewer.isWireframe = box("wire").checked;
      viewer.draw();
    });
    window.addEventListener("keydown", (e) => pressed(this, e));
    window.addEventListener("beforeunload", (e) => {
      if (this.outbox.messages.length > 0) e.preventDefault();
    });
  }
}

new Easel().begin().catch((error) => {
  element("verdict").textContent = "";
  element("state").textContent = `The page cannot begin: ${error.message}.`;
  element("state").className = "bad";
});
