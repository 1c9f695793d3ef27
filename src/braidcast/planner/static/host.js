/** What the page talks to: the planner's server, or the file that the page itself is. */

import { unpack } from "./model.js";

const POLL = 300; // ms between looks at a running simulation
const HEARTBEAT = 2000; // ms between looks whether the server is there

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
  #job = null;
  #started = null;

  constructor() {
    sessionStorage.setItem("session", this.#session);
  }

  /** Tables, model's name and card, and the surface if the vessel has one. */
  async start() {
    return (await this.#ask("api/start")).json();
  }

  async model() {
    return (await this.#ask("api/model")).arrayBuffer();
  }

  /** Deploys the case by finite elements; onProgress({state, position, stage, fraction}). */
  async simulate(tables, onProgress) {
    const answer = await this.#ask("api/jobs", { method: "POST", body: JSON.stringify({ case: tables }), headers: { "Content-Type": "application/json" } });
    const { id } = await answer.json();
    sessionStorage.setItem("job", JSON.stringify({ id, tables }));
    return this.#follow(id, onProgress);
  }

  /** The simulation that ran when the page was left: {tables, result: promise}, or null. */
  resume(onProgress) {
    const kept = JSON.parse(sessionStorage.getItem("job") ?? "null");
    return kept && { tables: kept.tables, result: this.#follow(kept.id, onProgress) };
  }

  async cancel() {
    if (this.#job) await this.#ask(`api/jobs/${this.#job}`, { method: "DELETE" }).catch(() => {});
  }

  /** Calls back with "here", "gone" or "restarted" whenever that changes. */
  async watch(onChange) {
    let here = true;
    for (;;) {
      try {
        const { started } = await (await this.#ask("api/alive")).json();
        if (this.#started !== null && started !== this.#started) onChange("restarted");
        else if (!here) onChange("here");
        [this.#started, here] = [started, true];
      } catch {
        if (here) onChange("gone");
        here = false;
      }
      await pause(HEARTBEAT);
    }
  }

  async #follow(id, onProgress) {
    this.#job = id;
    try {
      for (;;) {
        const job = await this.#poll(id);
        onProgress(job);
        if (job.state === "done") break;
        if (job.state === "cancelled") throw new Cancelled();
        if (job.state === "failed") throw new Error(job.message);
        await pause(POLL);
      }
      const { header, arrays } = unpack(await (await this.#ask(`api/jobs/${id}/result`)).arrayBuffer());
      return { ...header, ...arrays };
    } catch (error) {
      sessionStorage.removeItem("job");
      throw error;
    } finally {
      this.#job = null;
    }
  }

  /** The state of a job; waits where the server is gone for a while. */
  async #poll(id) {
    for (;;) {
      try {
        return await (await this.#ask(`api/jobs/${id}`)).json();
      } catch (error) {
        if (error.status === 404) throw new Error("The simulation is lost: the server was restarted. Start it again.");
        if (error.status) throw error;
        await pause(HEARTBEAT);
      }
    }
  }

  async #ask(path, options = {}) {
    const answer = await fetch(path, { ...options, cache: "no-store", headers: { ...options.headers, "X-Braidcast-Session": this.#session } });
    if (answer.ok) return answer;
    const { error } = await answer.json().catch(() => ({}));
    throw Object.assign(new Error(error ?? `The server answers ${answer.status}.`), { status: answer.status });
  }
}

/** The exported page: its first answers and its model, gzipped in base64, are elements of it. */
export class FileHost {
  kind = "file";
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

  resume() {
    return null;
  }

  async cancel() {}
  watch() {}
}
