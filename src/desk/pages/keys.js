// The keys of the page on which garments are painted.

/** @param {string} id */
const input = (id) => /** @type {HTMLInputElement} */ (document.getElementById(id));

/** @param {string} name @param {string} value */
const pick = (name, value) => {
  /** @type {HTMLInputElement} */ (document.querySelector(`input[name=${name}][value=${value}]`)).checked = true;
};

/** @param {number} by millimetres */
const resize = (by) => {
  input("size").value = String(Number(input("size").value) + by);
  input("size").dispatchEvent(new Event("input"));
};

/** Shows the next layer, or the one before. @param {any} easel @param {number} by */
const turnTo = (easel, by) => {
  const at = easel.all.findIndex((/** @type {any} */ layer) => layer.name === easel.layer?.name);
  const to = easel.all[(at + by + easel.all.length) % easel.all.length];
  if (to && to.name !== easel.layer?.name) easel.show(to.name);
};

/** What each key does. @type {Record<string, (easel: any, e: KeyboardEvent) => void>} */
const KEYS = {
  b: () => pick("tool", "brush"),
  l: () => pick("tool", "line"),
  o: () => pick("tool", "lasso"),
  a: () => pick("op", "add"),
  e: () => pick("op", "erase"),
  c: () => pick("op", "clear"),
  m: () => input("mirror").click(),
  h: () => input("others").click(),
  w: () => input("wire").click(),
  f: (easel) => easel.home(),
  "[": () => resize(-2),
  "]": () => resize(2),
  ",": (easel) => turnTo(easel, -1),
  ".": (easel) => turnTo(easel, 1),
  z: (easel, e) => easel.step(e.shiftKey ? "redo" : "undo"),
  y: (easel) => easel.step("redo"),
};

/** @param {any} easel @param {KeyboardEvent} e */
export function pressed(easel, e) {
  const key = e.key.toLowerCase();
  if (e.altKey || ((e.ctrlKey || e.metaKey) && !["z", "y"].includes(key))) return;
  // A list that is in focus finds its entries by letters.
  if (/** @type {HTMLElement} */ (e.target).tagName === "SELECT" || !Object.hasOwn(KEYS, key)) return;
  e.preventDefault();
  KEYS[key](easel, e);
}
