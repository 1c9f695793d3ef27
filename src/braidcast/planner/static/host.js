/** What the page talks to: the planner's server, or the file that the page itself is. */

import { unpack } from "./model.js";

const POLL = 300; // ms between looks at a running simulation
const HEARTBEAT = 2000; // ms between looks whether the server is there

/** Simulations of this visit whose results are kept; a braid and its gaps are 0.1 MB. */
export const KEPT = 10;

/** Why a file cannot simulate. */
export const NO_SERVER = "This page is a file without a server, so it cannot simulate: open the case with “braidcast planner CASE.toml”.";

/** Aborts are the user's wish and no fault to complain of. */
export class Cancelled extends Error {}

const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

/** crypto.randomUUID is only there on this machine's own addresses and by https. */
const randomName = () => Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");

export class ServerHost {
  kind = "server";
  #session = sessionStorage.getItem("session") ?? randomName();
  #job = null; // {cancelled, cancel()} of the simulation that is followed
  #started = null;
  #opened = "";

  constructor() {
    sessionStorage.setItem("session", this.#session);
  }

  /** Tables, model's name and card, and the surface if the vessel has one. */
  async start() {
    this.#started = await this.#identity();
    this.#opened = await this.#startText();
    return JSON.parse(this.#opened);
  }

  async model() {
    return (await this.#ask("api/model")).arrayBuffer();
  }

  /** Deploys the case by finite elements; onProgress({state, position, stage, fraction}). */
  async simulate(tables, onProgress) {
    const options = { method: "POST", body: JSON.stringify({ case: tables }), headers: { "Content-Type": "application/json" } };
    this.#job = cancellable();
    const { id } = await (await this.#patiently("api/jobs", onProgress, options)).json();
    this.#keep([...this.kept, { id, tables }].slice(-KEPT));
    return this.follow(id, onProgress, this.#job);
  }

  /** Simulations of this visit, also of before a reload: [{id, tables}]. */
  get kept() {
    return JSON.parse(sessionStorage.getItem("jobs") ?? "[]");
  }

  /** The result of a simulation, as soon as it is there. */
  async follow(id, onProgress, job = cancellable()) {
    this.#job = job;
    try {
      for (;;) {
        const state = await (await this.#patiently(`api/jobs/${id}`, onProgress)).json();
        onProgress(state);
        if (state.state === "done") break;
        if (state.state === "cancelled") throw new Cancelled();
        if (state.state === "failed") throw new Error(state.message);
        await this.#wait(POLL);
      }
      const { header, arrays } = unpack(await (await this.#patiently(`api/jobs/${id}/result`, onProgress)).arrayBuffer());
      return { ...header, ...arrays };
    } catch (error) {
      this.#keep(this.kept.filter((one) => one.id !== id));
      if (error instanceof Cancelled) this.#ask(`api/jobs/${id}`, { method: "DELETE" }).catch(() => {});
      if (error.status === 404) throw new Error("The simulation is lost: the server was restarted. Start it again.");
      throw error;
    }
  }

  /** Ends what is followed, whether or not the server is there to hear of it. */
  cancel() {
    this.#job.cancel();
  }

  /** Calls back whenever that changes with "here", "gone", "restarted" or, with another case, "other". */
  async watch(onChange) {
    let here = true;
    for (;;) {
      try {
        const started = await this.#identity();
        if (started !== this.#started) onChange((await this.#startText()) === this.#opened ? "restarted" : "other");
        else if (!here) onChange("here");
        [this.#started, here] = [started, true];
      } catch {
        if (here) onChange("gone");
        here = false;
      }
      await pause(HEARTBEAT);
    }
  }

  #keep(jobs) {
    sessionStorage.setItem("jobs", JSON.stringify(jobs));
  }

  #wait(milliseconds) {
    return Promise.race([pause(milliseconds), this.#job.cancelled]);
  }

  /** Asks, and where the server is gone for a while asks again. */
  async #patiently(path, onProgress, options) {
    for (;;) {
      try {
        return await this.#ask(path, options);
      } catch (error) {
        if (error.status) throw error;
        onProgress({ state: "gone" });
        await this.#wait(HEARTBEAT);
      }
    }
  }

  /** Of this run of the server. */
  async #identity() {
    return (await (await this.#ask("api/alive")).json()).started;
  }

  async #startText() {
    return (await this.#ask("api/start")).text();
  }

  async #ask(path, options = {}) {
    const answer = await fetch(path, { ...options, cache: "no-store", headers: { ...options.headers, "X-Braidcast-Session": this.#session } });
    if (answer.ok) return answer;
    const { error } = await answer.json().catch(() => ({}));
    throw Object.assign(new Error(error ?? `The server answers ${answer.status}.`), { status: answer.status });
  }
}

/** What is rejected with Cancelled once `cancel()` is called. */
function cancellable() {
  let cancel;
  const cancelled = new Promise((_, reject) => (cancel = () => reject(new Cancelled())));
  cancelled.catch(() => {}); // whoever waits for it hears of it
  return { cancelled, cancel };
}

/** The exported page: its first answers and its model, gzipped in base64, are elements of it. */
export class FileHost {
  kind = "file";
  kept = [];
  #start;
  #packed;

  /** `start`: the element with JSON; `model`: that with base64, empty without a model. */
  constructor(start, model) {
    this.#start = JSON.parse(start.textContent);
    this.#packed = model.textContent;
  }

  async start() {
    return this.#start;
  }

  async model() {
    if (!this.#packed) return null;
    const bytes = Uint8Array.from(atob(this.#packed), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
  }

  async simulate() {
    throw new Error(NO_SERVER);
  }

  cancel() {}
  watch() {}
}
