/** The page: one state, looked at once a frame, shown everywhere. */

import { History, fromHash, toHash } from "./address.js";
import { Banners } from "./banners.js";
import { CompareBox } from "./compare.js";
import { NumberControl, SiteControl } from "./controls.js";
import { downloads } from "./downloads.js";
import { element, find, write } from "./elements.js";
import { files } from "./files.js";
import { FileHost, ServerHost } from "./host.js";
import { legend } from "./legend.js";
import { Model } from "./model.js";
import { changed, shownNumbers } from "./numbers.js";
import { Picture, isThere, scaleOf } from "./picture.js";
import { percent, showRows } from "./readouts.js";
import { SimulationBox, keyOf } from "./simulation.js";
import { Looker } from "./situation.js";
import { ETAS, Strip, bestSite } from "./strip.js";
import { theme } from "./theme.js";
import { palette } from "./wires.js";

const embedded = find("planner-start");
const host = embedded ? new FileHost(embedded, find("planner-model")) : new ServerHost();
const banners = new Banners(find("banners"));

class Planner {
  #scheduled = false;
  refit = false; // whether the pictures have been arranged anew
  pictures = []; // of B and, side by side, of A
  stdReady = false;
  seen = null; // the last possible case that was looked at
  impossible = ""; // why the present one is not
  scale = null; // of the colours of all pictures
  #pinned = { key: "", look: null };
  #stripKey = "";

  constructor(start, model) {
    Object.assign(this, { start, model });
    if (start.surface) {
      // Its site may be given by mm or by a point; the page knows sites by η alone.
      const { startArcLength, spareLength } = start.surface;
      const { crimped_radius } = start.case.site;
      start.case.site = { eta: startArcLength / spareLength, ...(crimped_radius && { crimped_radius }) };
    }
    this.fields = shownNumbers(start.case, model?.limits);
    this.initial = { tables: start.case, pinned: null, colour: "gap", compare: "off" };
    theme(find("theme"), (dark) => {
      this.isDark = dark;
      this.pictures.forEach(({ view }) => view.setDark(dark));
    });
    this.pictures.push(new Picture(find("canvas"), this.isDark));
    this.looker = new Looker(start, model, (tables) => this.simulation.of(tables));
    this.#build();
    this.readAddress();
    this.history = new History(() => toHash(this.state, this.fields), () => this.readAddress());
    addEventListener("resize", () => this.pictures.forEach(({ view }) => view.resize()));
  }

  /** Changes the state and shows it with the next frame; committed changes go into the history. */
  change(patch, committed = true) {
    Object.assign(this.state, patch);
    this.#forgetComplaints();
    if (committed) this.history.commit();
    this.schedule();
  }

  readAddress() {
    const { state, complaints } = fromHash(location.hash, this.initial, this.fields);
    if (state.pinned && this.looker.look(state.pinned).impossible) {
      complaints.push("The pinned case A is impossible.");
      Object.assign(state, { pinned: null, compare: "off" });
    }
    this.state = state;
    this.#forgetComplaints();
    banners.set("address", "note", complaints.length ? `The address holds something else than a case: ${complaints[0]} The rest of it is used.` : "");
    this.schedule();
  }

  /** What was refused, or could not be made, was so before this change. */
  #forgetComplaints() {
    for (const control of [this.siteControl, ...this.controls]) control.forget();
    banners.set("download", "note", "");
  }

  schedule() {
    if (this.#scheduled) return;
    this.#scheduled = true;
    requestAnimationFrame(() => {
      this.#scheduled = false;
      const before = performance.now();
      this.#show();
      performance.measure("planner-move", { start: before });
      performance.clearMeasures("planner-move"); // who observes has it; kept it would grow for ever
    });
  }

  #build() {
    const number = (field) => (value, committed) => this.change({ tables: changed(this.state.tables, field, value) }, committed);
    const [site, ...others] = this.fields;
    this.siteControl = new SiteControl(site, !this.start.surface, number(site));
    find("site-controls").append(this.siteControl.root);
    this.controls = others.map((field) => new NumberControl(field, number(field)));
    find("controls").append(...this.controls.map(({ root }) => root));
    if (this.start.surface) find("controls").append(element("p", { class: "note", text: `Vessel from the surface ${this.start.surface.name}: its shape is what it is, the site may be moved.` }));
    this.#buildStrip(site, number(site));
    this.simulation = new SimulationBox(find("simulation"), host, {
      current: () => this.state.tables,
      onChange: () => this.schedule(),
      onGo: (tables) => this.change({ tables }),
    });
    this.compare = new CompareBox(find("compare"), {
      onPin: () => this.change({ pinned: structuredClone(this.state.tables), compare: this.state.compare === "ghost" ? "ghost" : "sides" }),
      onUnpin: () => this.change({ pinned: null, compare: "off" }),
      onSwap: () => this.change({ pinned: this.state.tables, tables: this.state.pinned }),
      onArrange: (compare) => this.change({ compare }),
    });
    find("colour").addEventListener("change", ({ target }) => this.change({ colour: target.value }));
    const turn = (name) => {
      this.pictures.forEach(({ view }) => view.view(name));
      this.#fit();
    };
    find("standard-views").addEventListener("click", ({ target }) => target.dataset.view && turn(target.dataset.view));
    const name = () => (this.state.tables.title || "case").toLowerCase().replace(/[^a-z0-9]+/g, "_").slice(0, 40);
    downloads(find("downloads"), name, files(this), (text) => banners.set("download", "note", text));
    write(find("case-title"), this.start.case.title ?? "");
    write(find("model-name"), `braidcast ${this.start.version}; model: ${this.start.modelName ?? "none"}`);
  }

  #buildStrip(site, onChange) {
    if (!this.model) {
      find("strip").hidden = find("best").hidden = true;
      write(find("strip-title"), "Site along the centreline");
      return;
    }
    this.strip = new Strip(find("strip"), this.model.threshold, onChange);
    find("best").addEventListener("click", () => {
      const { eta, safe } = bestSite(this.strip.probabilities, this.model.threshold);
      banners.set("best", "note", safe ? "" : `No site of this vessel reaches ${percent(this.model.threshold)}; this is the most probable one.`);
      this.change({ tables: changed(this.state.tables, site, eta) });
    });
  }

  #show() {
    const { tables } = this.state;
    const now = this.looker.look(tables);
    const a = this.#lookA();
    this.impossible = now.impossible ?? "";
    banners.set("impossible", "error", now.impossible ? `Impossible: ${now.impossible}.${this.seen ? " The last possible case is shown in grey." : ""}` : "");
    this.#warn("outside", a ? "B is outside" : "Outside", now);
    this.#warn("outside-a", "A is outside", a);
    for (const control of this.controls) control.show(control.field.path.reduce((table, key) => table[key], tables));
    const seen = now.impossible ? this.seen : now;
    if (seen) this.siteControl.show(tables.site.eta, seen.geometry);
    find("panel").classList.toggle("stale-readouts", Boolean(now.impossible));
    this.#showPictures(now, seen, a);
    this.#showVerdict(now);
    if (!now.impossible) showRows(find("readouts"), now.rows);
    this.simulation.show(tables, this.impossible, now.simulated ?? []);
    this.compare.show(this.state.compare, a?.all ?? [], this.#rowsOf(seen), this.impossible);
    this.#showStrip(now);
    this.seen = seen;
    const ready = this.stdReady ? "all" : "page"; // with standard deviations, or not yet
    if (document.body.dataset.ready !== ready) document.body.dataset.ready = ready;
  }

  #warn(name, outside, look) {
    const { inRange = true, outOfRange } = look?.prediction ?? {};
    const labelled = (phrase) => this.fields.reduce((text, field) => text.replace(`${field.name} `, `${field.label} `), phrase);
    banners.set(name, "warning", inRange ? "" : `${outside} of what the model was trained for: ${outOfRange.map(labelled).join("; ")}. A hint, not a prediction.`);
  }

  /** Case A as last looked at; its simulation may have come since. */
  #lookA() {
    const { pinned } = this.state;
    if (!pinned) return null;
    const key = `${keyOf(pinned)} ${Boolean(this.simulation.of(pinned))} ${this.stdReady}`;
    if (key !== this.#pinned.key) {
      const look = this.looker.look(pinned);
      this.#pinned = { key, look: { ...look, all: this.#rowsOf(look) } };
    }
    return this.#pinned.look;
  }

  #rowsOf(look) {
    if (!look || look.impossible) return [];
    const { prediction } = look;
    const site = ["site", "Proximal end of the crimped stent", `${look.geometry.startArcLength.toFixed(2)} mm`];
    const verdict = prediction ? [["probability", "Probability of success", percent(prediction.successProbability)], ["verdict", "Verdict", prediction.success ? "success" : "failure"]] : [];
    return [site, ...verdict, ...look.rows.filter(([key]) => key !== "time"), ...look.simulated.map(([key, what, value]) => [key, `Simulation: ${what}`, value])];
  }

  /** Rows [key, what, value] of B, what is seen, and of A if one is pinned. */
  get bothRows() {
    return { a: this.#lookA()?.all ?? null, b: this.#rowsOf(this.seen) };
  }

  #showPictures(now, seen, a) {
    const { compare, colour } = this.state;
    const sides = compare === "sides";
    this.#arrange(sides);
    const coloured = [seen, sides ? a : null].filter((look) => look?.braid);
    this.scale = coloured.length ? scaleOf(colour, coloured) : null;
    const second = compare === "ghost" ? a.braid : now.prediction && now.simulation;
    this.captions = this.#captions(seen, a, second);
    this.captions.forEach((text, i) => write(find(["view-b", "view-a"][i]).lastElementChild, text));
    this.pictures[0].show(this.#scene(now, second?.positions ?? null));
    if (sides) this.pictures[1].show(this.#scene(a, null));
    if (this.refit) this.#fit();
    this.refit = false;
    legend(find("legend"), this.scale, palette);
    for (const option of find("colour").options) option.disabled = option.value !== "gap" && !(this.scale && isThere(option.value, coloured));
    find("colour").value = this.scale?.kind ?? "gap";
  }

  /** Of the picture of B and, side by side, of that of A. */
  #captions(b, a, second) {
    const missing = (look) => (look && !look.braid ? ", not simulated yet" : "");
    const { compare } = this.state;
    if (compare === "sides") return [`B${missing(b)}`, `A${missing(a)}`];
    if (compare === "off") return [second ? "Prediction in colours; simulation as the thin second braid" : ""];
    const vessel = b && b.shape.key !== a.shape.key ? "; the vessel is that of B" : "";
    return [`B in colours${missing(b)}; A as the thin second braid${missing(a)}${vessel}`];
  }

  #fit() {
    fitTogether(this.pictures.slice(0, this.state.compare === "sides" ? 2 : 1).map(({ view }) => view));
  }

  #scene(look, ghost) {
    if (look.impossible) return { stale: true };
    const { shape, braid, marks } = look;
    const { wires, device } = this.looker;
    return { vessel: shape.vessel, braid: braid && { positions: braid.positions, values: this.scale.of(look) }, scale: this.scale, wires, device, marks, ghost };
  }

  /** One canvas or two; the second is made when it is first needed. */
  #arrange(sides) {
    if (find("view-a").hidden === !sides) return;
    find("view-a").hidden = !sides;
    find("views").classList.toggle("two", sides);
    if (sides && !this.pictures[1]) {
      this.pictures.push(new Picture(find("canvas-a"), this.isDark));
      lookTogether(...this.pictures.map(({ view }) => view));
    }
    this.pictures.forEach(({ view }) => view.resize());
    this.refit = true;
  }

  #showVerdict({ impossible, prediction, simulation }) {
    const root = find("verdict");
    if (impossible) {
      root.className = "none";
      write(root, "✕ Impossible case");
    } else if (!prediction) {
      root.className = "none";
      write(root, `${this.start.withoutModel} ${simulation ? "" : "“Simulate this case” shows where the wires end up."}`.trim());
    } else {
      const { success, successProbability } = prediction;
      root.className = success ? "success" : "failure";
      root.replaceChildren(element("strong", { text: `${success ? "✓ Success" : "✕ Failure"}, ${percent(successProbability)}` }),
        element("span", { text: `probability of success; called from ${percent(this.model.threshold)} on` }));
    }
  }

  /** The strip belongs to the vessel; it is filled after the frame, so that the braid moves first. */
  #showStrip({ impossible, prediction }) {
    if (!this.strip) return;
    this.strip.root.classList.toggle("stale", Boolean(impossible) || !this.strip.probabilities);
    if (impossible) {
      write(find("strip-value"), "");
      return;
    }
    const { tables } = this.state;
    const key = JSON.stringify([tables.vessel, tables.aneurysm]);
    if (key !== this.#stripKey) {
      this.#stripKey = key;
      find("best").disabled = true;
      setTimeout(() => {
        if (key !== this.#stripKey) return; // moved on; its own turn comes
        const probabilities = ETAS.map((eta) => this.model.successProbability({ ...tables, site: { ...tables.site, eta } }));
        this.strip.fill(probabilities);
        this.strip.mark(this.state.tables.site.eta, prediction.successProbability);
        find("best").disabled = false;
      });
    }
    this.strip.mark(tables.site.eta, prediction.successProbability);
    write(find("strip-value"), `${percent(prediction.successProbability)} here`);
  }
}

/** Whichever of two views is turned, the other follows. */
function lookTogether(one, other) {
  const rounded = ({ pose }) => JSON.stringify(pose, (_, value) => (typeof value === "number" ? Number(value.toFixed(5)) : value));
  for (const [from, to] of [[one, other], [other, one]]) {
    from.onFrame(() => {
      if (to.canvas.clientWidth && rounded(from) !== rounded(to)) to.pose = from.pose;
    });
  }
}

/** The first of the views shows what each of them would show. */
function fitTogether(views) {
  const poses = views.map((view) => (view.fit(), view.pose));
  const [a, b] = [poses[0], poses.at(-1)];
  const { clientWidth, clientHeight } = views[0].canvas;
  const middle = (p, q) => p.map((x, k) => (x + q[k]) / 2);
  const apart = Math.hypot(...a.target.map((x, k) => x - b.target[k]));
  // At zoom 1 a view is 20 mm high.
  const zoom = 1 / (1 / Math.min(a.zoom, b.zoom) + (apart * clientHeight) / (20 * clientWidth));
  views[0].pose = { ...a, position: middle(a.position, b.position), target: middle(a.target, b.target), zoom };
}

const AWAY = {
  gone: ["error", "The server is gone. The sliders go on working, for the model is in this page; simulations wait. Trying to reach it …"],
  here: ["", ""],
  other: ["error", "The server was restarted with another case or another model. Reload this page to open it; shown here is still what it was."],
  restarted: ["note", "The server was restarted. Your case is kept; simulations that were running are lost."],
};

async function open() {
  try {
    const start = await host.start();
    const buffer = start.withoutModel || start.surface ? null : await host.model();
    const planner = new Planner(start, buffer && new Model(buffer));
    globalThis.planner = planner; // for tests and the curious
    host.watch((event) => {
      banners.set("server", ...AWAY[event]);
      if (event === "other") history.replaceState(null, "", location.pathname); // its numbers are the old case's
      if (event !== "gone") planner.schedule();
    });
    find("waiting").hidden = true;
    await planner.model?.prepareStd();
    planner.stdReady = true;
    planner.schedule();
  } catch (error) {
    find("waiting").hidden = false;
    write(find("waiting"), `The planner could not start: ${error.message}`);
    console.error(error);
  }
}

open();
