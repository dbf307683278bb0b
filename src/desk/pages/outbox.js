// What is to be sent to the server: in order, one after another, until it is done. Nothing is lost when the connection is.

/**
 * @typedef {{ path: string, layer: string, what: string, body: any, refusal?: string }} Message
 * @typedef {{ sent: (message: Message, answer: any) => void, refused: (message: Message, error: any) => void,
 *   state: (text: string, isBad: boolean) => void, shut: () => void, prepare: (message: Message) => boolean }} Listener
 */

/** Ways of waiting, in milliseconds. */
const FIRST_WAIT = 300;
const LONGEST_WAIT = 4000;

/** An id that no other stroke has. */
export function newId() {
  const bytes = crypto.getRandomValues(new Uint8Array(12));
  return Array.from(bytes, (b) => b.toString(16).padStart(2, "0")).join("");
}

export class Outbox {
  /**
   * @param {string} token
   * @param {string} store the beginning of the names under which unsent messages are kept in this browser
   * @param {Listener} listener
   */
  constructor(token, store, listener) {
    this.token = token;
    this.store = `${store}-${newId()}`;
    this.listener = listener;
    this.isSending = false;
    this.isShut = false;
    this.wait = FIRST_WAIT;
    const adopted = this.adopted(store);
    /** What waits, in order. */
    this.messages = adopted.filter((message) => !message.refusal);
    /** Strokes that the server has refused, until the person has decided. */
    this.refused = adopted.filter((message) => message.refusal);
    this.keep();
  }

  /**
   * What pages that were closed have not sent, and what was refused. A page that is still open has it too; the server applies each
   * id once.
   * @param {string} store @returns {Message[]}
   */
  adopted(store) {
    try {
      const names = Object.keys(localStorage).filter((name) => name.startsWith(store));
      const messages = names.flatMap((name) => JSON.parse(localStorage.getItem(name) ?? "[]"));
      for (const name of names) localStorage.removeItem(name);
      return messages;
    } catch {
      return [];
    }
  }

  keep() {
    try {
      const kept = [...this.messages, ...this.refused];
      if (kept.length > 0) localStorage.setItem(this.store, JSON.stringify(kept));
      else localStorage.removeItem(this.store);
    } catch {
      // A browser that keeps nothing still sends everything.
    }
  }

  /** @param {Message} message */
  put(message) {
    this.messages.push(message);
    this.keep();
    this.send();
  }

  /** @param {string} layer how many messages wait for this layer */
  waiting(layer) {
    return this.messages.filter((message) => message.layer === layer).length;
  }

  /** Forgets a stroke that was refused; it may be put in again. @param {Message} message */
  takeOut(message) {
    this.refused = this.refused.filter((one) => one !== message);
    delete message.refusal;
    this.keep();
  }

  /** Forgets the first message. */
  drop() {
    this.messages.shift();
    this.keep();
  }

  async send() {
    if (this.isSending || this.isShut) return;
    this.isSending = true;
    while (this.messages.length > 0 && !this.isShut) {
      const message = this.messages[0];
      if (!this.listener.prepare(message)) {
        this.drop();
        continue;
      }
      this.keep();
      const { status, answer } = await this.ask(message.path, message.body);
      if (status === 200) {
        this.wait = FIRST_WAIT;
        this.drop();
        this.listener.sent(message, answer);
        this.listener.state("", false);
      } else if (answer?.kind === "stranger") {
        this.isShut = true;
        this.listener.shut();
        this.listener.state(`The server was started anew. ${capital(answer.error)}. ${this.count("is sent when that page opens in this browser, on the same port")}`, true);
      } else if (status === 0 || answer?.kind === "later" || !answer) {
        const why = status === 0 ? "The server does not answer" : capital(answer?.error ?? `the server answers ${status}`);
        this.listener.state(`${why}. ${this.count()}`, true);
        await new Promise((done) => setTimeout(done, this.wait));
        this.wait = Math.min(LONGEST_WAIT, 2 * this.wait);
      } else {
        if (message.path === "/api/paint") this.refused.push({ ...message, refusal: answer.error });
        this.drop();
        this.listener.refused(message, answer);
      }
    }
    this.isSending = false;
  }

  /**
   * The strokes that are not saved, as brush files: one for each layer.
   * @returns {Map<string, string>}
   */
  files() {
    const files = new Map();
    for (const { path, layer, body } of [...this.refused, ...this.messages]) {
      if (path !== "/api/paint") continue;
      const lines = body.strokes.map((/** @type {any} */ stroke) => JSON.stringify({ layer, ...stroke, frame: "world", id: body.id }) + "\n");
      files.set(layer, (files.get(layer) ?? "") + lines.join(""));
    }
    return files;
  }

  /** How many strokes are not saved, and what becomes of them. */
  count(future = "is sent again soon") {
    const n = this.messages.length;
    return n === 0 ? "" : n === 1 ? `1 stroke is not saved yet; it ${future}.` : `${n} strokes are not saved yet; each ${future}.`;
  }

  /**
   * Asks the server; the status is 0 if it does not answer.
   * @param {string} path @param {any} [body]
   */
  async ask(path, body) {
    /** @type {RequestInit} */
    const options = { headers: { "X-Overcoat-Token": this.token } };
    if (body !== undefined) Object.assign(options, { method: "POST", body: JSON.stringify(body) });
    try {
      const response = await fetch(path, options);
      return { status: response.status, answer: await response.json().catch(() => null) };
    } catch {
      return { status: 0, answer: null };
    }
  }
}

/** @param {string} text */
export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
