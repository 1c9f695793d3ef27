// The vessel and its braid on one canvas. Nothing moves, nothing is drawn.

import * as THREE from "three";
import { OrbitControls } from "./vendor/OrbitControls.js";
import { placeAt } from "./bezier.js";
import { drawRuler } from "./ruler.js";
import { lumenMesh } from "./vessel_mesh.js";
import { VesselShell } from "./vessel_shell.js";
import { VIEWS, axesOf } from "./views.js";
import { MAGNIFICATION, Wires } from "./wires.js";

/** Colours on light and on dark; the vessel's are seen through. */
const LIGHT = { background: "#ffffff", text: "#1b1f24", vessel: "#c98a76", sac: "#b5557f", neck: "#7a1f4b", site: "#3b4754", ghost: "#d55e00", wires: "#5d6875", ground: 1.3 };
const DARK = { background: "#15191e", text: "#e8ebee", vessel: "#e0b3a4", sac: "#e58fb3", neck: "#ffb3d1", site: "#c3ccd6", ghost: "#ff9a3d", wires: "#aab4bf", ground: 2.6 };
/** Software rendering takes its time by the pixel: no more of them than these. */
const MOST_PIXELS = 2.4e6;
const DISTANCE = 500; // of the eye, mm; all that is looked at is nearer
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const KEY_TURN = Math.PI / 36;
const KEY_ZOOM = 1.15;

export class View {
  /** Milliseconds of script in the last frame. */
  frameMilliseconds = 0;
  #hooks = new Set();
  #frame = 0;
  #marks = { neck: null, sac: null, site: null };
  #vessel = null; // {middle, necks, axes of a tube, reach of a surface}
  #size = [0, 0];

  /** Throws where the browser gives no WebGL 2. The canvas's parent must be positioned: axes and
   * scale are drawn on a second canvas laid over the first. */
  constructor(canvas, { dark = false } = {}) {
    this.canvas = canvas;
    try {
      this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    } catch {
      throw new Error("The 3D view needs WebGL 2, which this browser does not give; hardware acceleration may be switched off in its settings.");
    }
    this.renderer.sortObjects = false; // drawn in the order of this.space
    this.overlay = document.createElement("canvas");
    this.overlay.setAttribute("aria-hidden", "true");
    Object.assign(this.overlay.style, { position: "absolute", pointerEvents: "none" });
    canvas.after(this.overlay);
    if (!canvas.hasAttribute("tabindex")) canvas.tabIndex = 0;

    this.scene = new THREE.Scene();
    // The vessel's axes are those of the scene, whichever way it lies in space.
    this.space = new THREE.Group();
    this.space.matrixAutoUpdate = false;
    this.scene.add(this.space);
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 2 * DISTANCE);
    this.camera.position.set(0, 0, DISTANCE);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.zoomToCursor = true;
    this.controls.minZoom = 0.1;
    this.controls.maxZoom = 60;
    this.controls.addEventListener("change", () => this.render());

    this.listeners = new AbortController();
    const { signal } = this.listeners;
    canvas.addEventListener("keydown", (event) => this.#key(event), { signal });
    // three.js prepares itself for a new context; what the old one held is given up with it.
    canvas.addEventListener("webglcontextlost", () => this.space.children.forEach((child) => child.dispose()), { signal });
    canvas.addEventListener("webglcontextrestored", () => this.setDark(this.dark), { signal });
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(canvas);
    this.setDark(dark);
    this.resize();
  }

  /** Wires of segments + 1 nodes each (node indices, one wire after another), radius in mm. */
  setBraid(wires, wireRadius, segments) {
    this.#remove("ghost");
    this.order = wires;
    this.wireRadius = wireRadius;
    const count = wires.length / (segments + 1);
    this.#put("braid", new Wires(count, segments + 1, { radius: MAGNIFICATION * wireRadius, colour: this.colours.wires, fading: 0.55 }));
    this.braid.visible = false;
  }

  /** Moves all wires to positions (3N) mm. */
  setPositions(positions) {
    this.braid.setPositions(positions, this.order);
    this.braid.visible = true;
    this.render();
  }

  /** No braid, until it is moved again. */
  hideBraid() {
    if (this.braid) this.braid.visible = false;
    this.render();
  }

  /** Colours by values (N) between [low, high] of the palette "viridis" or "cividis"; null: plain. */
  setValues(values, range, palette) {
    this.braid.setValues(values, range, palette, this.order);
    this.render();
  }

  /** {kind: "tube", case, geometry} or {kind: "surface", vertices (3n) mm, triangles (3m)}. */
  setVessel(vessel) {
    if (!this.shell) this.space.add((this.shell = new VesselShell()));
    if (vessel.kind === "tube") {
      const { curve, length, sacCentre } = vessel.geometry;
      const mesh = lumenMesh(vessel.case, vessel.geometry);
      this.shell.setTube(mesh);
      const [first, middle, last] = [0, 0.5, 1].map((share) => placeAt(curve, share * length).point);
      this.#vessel = { middle, necks: mesh.necks, axes: axesOf(first, middle, last, sacCentre) };
    } else {
      const { center, radius } = this.shell.setSurface(vessel.vertices, vessel.triangles);
      this.#vessel = { middle: center.toArray(), necks: [], reach: radius };
    }
    this.setMarks(this.#marks);
  }

  /** Neck {centre, radius, normal}, sac {centre, radius} and site, the device's range as points
   * [[x, y, z], …] of the centreline; mm, or null. Of a tube the neck's own edge is drawn. */
  setMarks(marks) {
    this.#marks = { ...this.#marks, ...marks };
    const { neck, site } = this.#marks;
    const loops = neck ? (this.#vessel?.necks.length ? this.#vessel.necks : neck.centre ? [circle(neck)] : []) : [];
    this.#line("necks", loops.map((loop) => [...loop, loop[0]]), { colour: this.colours.neck, pixels: 1.2 });
    this.#line("site", site ? [site] : [], { colour: this.colours.site, pixels: 1 });
    this.shell?.setColours(this.colours, this.#marks.sac);
    this.render();
  }

  /** A second braid of the same wires at positions (3N) mm, thin and of one colour; null: none. */
  setGhost(positions) {
    if (!positions) this.#remove("ghost");
    else {
      if (!this.ghost) this.#put("ghost", new Wires(this.braid.wireCount, this.braid.nodes, { radius: this.wireRadius, pixels: 0.5, colour: this.colours.ghost, fading: 0.55 }));
      this.ghost.setPositions(positions, this.order);
    }
    this.render();
  }

  setDark(dark) {
    this.dark = dark;
    this.colours = dark ? DARK : LIGHT;
    this.renderer.setClearColor(this.colours.background);
    this.braid?.setColour(this.colours.wires);
    this.ghost?.setColour(this.colours.ghost);
    for (const line of this.necks ?? []) line.setColour(this.colours.neck);
    for (const line of this.site ?? []) line.setColour(this.colours.site);
    this.shell?.setColours(this.colours, this.#marks.sac);
    this.render();
  }

  /** "front", "back", "side", "top", "along" or "reset": braid and sac seen from there, all of them. */
  view(name) {
    const eye = new THREE.Vector3(...VIEWS[name]).setLength(DISTANCE);
    if (this.#vessel) this.#align();
    this.camera.position.copy(this.controls.target).add(eye);
    this.fit();
  }

  /** Braid and sac (or, without a braid, the vessel) in the middle, as large as they can be. */
  fit() {
    if (!this.aligned && this.#vessel) this.#align(true);
    this.controls.update();
    const { camera } = this;
    camera.updateMatrixWorld();
    const box = new THREE.Box3();
    const turn = new THREE.Matrix4().extractRotation(camera.matrixWorldInverse).multiply(this.space.matrix);
    const point = new THREE.Vector3();
    const include = (x, y, z, radius) => {
      point.set(x, y, z).applyMatrix4(turn);
      box.expandByPoint(point.addScalar(radius));
      box.expandByPoint(point.addScalar(-2 * radius));
    };
    const { sac } = this.#marks;
    if (this.braid?.visible) for (let k = 0; k < this.braid.data.length; k += 4) include(...this.braid.data.subarray(k, k + 3), 0);
    else if (this.#vessel) include(...this.#vessel.middle, this.#vessel.reach ?? 12);
    if (sac) include(...sac.centre, sac.radius);
    if (box.isEmpty()) return;
    const [width, height] = box.getSize(new THREE.Vector3()).toArray();
    const [across, down] = this.#size;
    // Half of what the camera shows at zoom 1 is 10 mm high.
    camera.zoom = Math.min((20 / (height || 1)) * 0.84, (((20 * across) / (down || 1)) / (width || 1)) * 0.88);
    const centre = box.getCenter(new THREE.Vector3()).applyMatrix4(new THREE.Matrix4().extractRotation(camera.matrixWorld));
    camera.position.add(centre).sub(this.controls.target);
    this.controls.target.copy(centre);
    camera.updateProjectionMatrix();
    this.controls.update();
    this.render();
  }

  /** What the camera looks at and how, to be given to another view: {position, target, zoom, axes}. */
  get pose() {
    return { position: this.camera.position.toArray(), target: this.controls.target.toArray(), zoom: this.camera.zoom, axes: this.space.matrix.toArray() };
  }

  set pose({ position, target, zoom, axes }) {
    this.camera.position.fromArray(position);
    this.controls.target.fromArray(target);
    this.camera.zoom = zoom;
    this.#turn(new THREE.Matrix4().fromArray(axes));
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.render();
  }

  /** mm of a CSS pixel. */
  get millimetresPerPixel() {
    return 20 / this.camera.zoom / (this.#size[1] || 1);
  }

  /** CSS pixels [x, y] of a point [x, y, z] mm on the canvas. */
  project(point) {
    this.camera.updateMatrixWorld();
    const { x, y } = new THREE.Vector3(...point).applyMatrix4(this.space.matrix).project(this.camera);
    return [0.5 * (1 + x) * this.#size[0], 0.5 * (1 - y) * this.#size[1]];
  }

  /** Called when the canvas has another size; a ResizeObserver does, too. */
  resize() {
    const { clientWidth: width, clientHeight: height, offsetLeft, offsetTop } = this.canvas;
    Object.assign(this.overlay.style, { left: `${offsetLeft}px`, top: `${offsetTop}px`, width: `${width}px`, height: `${height}px` });
    if (!width || !height) return;
    this.#size = [width, height];
    this.ratio = Math.min(globalThis.devicePixelRatio, 2, Math.max(Math.sqrt(MOST_PIXELS / (width * height)), 0.5));
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(width, height, false);
    [this.overlay.width, this.overlay.height] = [Math.round(width * devicePixelRatio), Math.round(height * devicePixelRatio)];
    const half = (10 * width) / height;
    Object.assign(this.camera, { left: -half, right: half, top: 10, bottom: -10 });
    this.camera.updateProjectionMatrix();
    // A canvas that was resized is empty until it is drawn: at once, or it flickers.
    this.draw();
  }

  /** Asks for a frame; as many times as one likes. */
  render() {
    if (this.#frame) return;
    this.#frame = requestAnimationFrame(() => this.draw());
  }

  /** Draws now. */
  draw() {
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    if (!this.#size[0] || this.renderer.getContext().isContextLost()) return;
    const start = performance.now();
    this.scene.updateMatrixWorld();
    this.camera.updateMatrixWorld();
    const pixel = this.millimetresPerPixel / this.ratio;
    for (const child of this.space.children) child.prepare?.(pixel, this.colours.background);
    this.renderer.render(this.scene, this.camera);
    const context = this.overlay.getContext("2d");
    const scale = this.overlay.width / this.#size[0];
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, ...this.#size);
    const turn = new THREE.Matrix4().extractRotation(this.camera.matrixWorldInverse).multiply(this.space.matrix);
    drawRuler(context, this.#size, this.millimetresPerPixel, turn.elements, this.colours);
    this.frameMilliseconds = performance.now() - start;
    for (const hook of this.#hooks) hook(this);
  }

  /** `hook(view)` after every frame; returns what takes it away again. */
  onFrame(hook) {
    this.#hooks.add(hook);
    return () => this.#hooks.delete(hook);
  }

  /** What is seen, with axes and scale, as a PNG file (Blob). */
  png() {
    const picture = document.createElement("canvas");
    [picture.width, picture.height] = [this.canvas.width, this.canvas.height];
    const context = picture.getContext("2d");
    this.draw(); // the browser keeps it only until this task ends
    context.drawImage(this.canvas, 0, 0);
    context.drawImage(this.overlay, 0, 0, picture.width, picture.height);
    return pngOf(picture);
  }

  /** Gives everything back, the canvas's WebGL context too: the canvas cannot be used again. */
  dispose() {
    cancelAnimationFrame(this.#frame);
    this.#frame = -1; // no more of them
    this.listeners.abort();
    this.observer.disconnect();
    this.controls.dispose();
    this.#hooks.clear();
    for (const child of [...this.space.children]) this.#discard(child);
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.overlay.remove();
  }

  #key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const names = ["reset", "front", "back", "side", "top", "along"];
    if (KEYS[event.key]) {
      const [right, down] = KEYS[event.key];
      const eye = this.camera.position.clone().sub(this.controls.target);
      const place = new THREE.Spherical().setFromVector3(eye);
      place.theta += right * KEY_TURN;
      place.phi += down * KEY_TURN;
      this.camera.position.copy(this.controls.target).add(eye.setFromSpherical(place.makeSafe()));
    } else if ("+=-".includes(event.key)) {
      const { minZoom, maxZoom } = this.controls;
      this.camera.zoom = Math.min(Math.max(this.camera.zoom * (event.key === "-" ? 1 / KEY_ZOOM : KEY_ZOOM), minZoom), maxZoom);
      this.camera.updateProjectionMatrix();
    } else if (names[event.key]) this.view(names[event.key]);
    else return;
    event.preventDefault();
    this.controls.update();
    this.render();
  }

  /** Turns space so that the vessel's axes are the scene's. */
  #align(first = false) {
    const [along, up, towards] = this.#vessel.axes ?? this.#surfaceAxes();
    this.aligned = true;
    this.#turn(new THREE.Matrix4().makeBasis(new THREE.Vector3(...along), new THREE.Vector3(...up), new THREE.Vector3(...towards)).transpose());
    if (first) this.camera.position.copy(this.controls.target).add(new THREE.Vector3(...VIEWS.reset).setLength(DISTANCE));
  }

  /** Of a vessel by its surface: the device's range lies along it. */
  #surfaceAxes() {
    const { site, sac } = this.#marks;
    if (!site) return [[0, 0, 1], [0, 1, 0], [-1, 0, 0]];
    return axesOf(site[0], site[Math.floor(site.length / 2)], site.at(-1), sac?.centre);
  }

  #turn(matrix) {
    this.space.matrix.copy(matrix);
    this.space.matrixWorldNeedsUpdate = true;
  }

  #put(name, wires) {
    this.#remove(name);
    this[name] = wires;
    this.space.add(wires);
  }

  #remove(name) {
    if (this[name]) this.#discard(this[name]);
    this[name] = null;
  }

  #discard(object) {
    this.space.remove(object);
    object.dispose();
  }

  /** Lines, each through its points, kept where they have as many points as before. */
  #line(name, lines, style) {
    const kept = this[name] ?? [];
    if (!this[name] || kept.length !== lines.length || kept.some((line, i) => line.nodes !== lines[i].length)) {
      kept.forEach((line) => this.#discard(line));
      this[name] = lines.map((points) => new Wires(1, points.length, { radius: 0, ...style }));
      this[name].forEach((line) => this.space.add(line));
    }
    this[name].forEach((line, i) => line.setPositions(lines[i].flat()));
  }
}

/** What is on a canvas as a PNG file, a promise of a Blob. */
export function pngOf(canvas) {
  return new Promise((resolve, reject) => {
    canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the browser made no picture"))), "image/png");
  });
}

/** Points of a circle {centre, radius, normal}. */
function circle({ centre, radius, normal }) {
  const n = new THREE.Vector3(...normal).normalize();
  const across = new THREE.Vector3(...(Math.abs(n.x) < 0.6 ? [1, 0, 0] : [0, 1, 0])).cross(n).normalize();
  const other = n.clone().cross(across);
  return Array.from({ length: 72 }, (_, i) => {
    const angle = (Math.PI * i) / 36;
    return new THREE.Vector3(...centre).addScaledVector(across, radius * Math.cos(angle)).addScaledVector(other, radius * Math.sin(angle)).toArray();
  });
}
