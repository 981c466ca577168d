// The clock, the controls and the labels of a replay, and `window.subzero`, by which a script drives it.

import { Camera } from "./camera.js";
import { readReplay } from "./data.js";
import { PlanView } from "./plan.js";
import { Plots, said, spaced } from "./plots.js";
import { Scene, webglOn } from "./scene.js";

const element = (id) => document.getElementById(id);
const SHOWN = ["surge_speed", "heading", "depth", "pitch", "cable_tension", "cable_length"];
const SLOWEST_FRAME_MS = 45, FINEST = 2, COARSEST = 0.5;
const STEP_SHARE = 1 / 200;                   // of the run, by an arrow key
const FIRST_VIEW_SHARE = 0.45;                // of the run: the moment that is shown before anybody plays it

class Player {
  constructor(stored) {
    this.replay = readReplay(stored);
    this.canvas = element("scene");
    this.lead = this.replay.actors[0];
    this.camera = new Camera(this.replay.extent);
    this.camera.besideVehicle(this.replay.vehicle.hull.length, this.lead.at("heading", FIRST_VIEW_SHARE * this.replay.end));
    this.isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.isPlaying = false;
    this.fineness = Math.min(devicePixelRatio || 1, FINEST);
    this.time = FIRST_VIEW_SHARE * this.replay.end;
    this.rate = 1;
    this.view = this.viewOf();
    this.plots = new Plots(element("plots"), this.replay, (t) => this.seek(t));
    this.prepareControls();
    this.prepareBar();
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    this.resize();
    requestAnimationFrame((now) => this.tick(now));
  }

  /** The 3-D scene, or flat views where there is no WebGL2. */
  viewOf() {
    const gl = webglOn(this.canvas);
    if (gl) {
      this.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
      this.canvas.addEventListener("webglcontextrestored", () => ((this.view = new Scene(gl, this.replay)), this.changed()));
      return new Scene(gl, this.replay);
    }
    element("no-webgl").hidden = false;
    return new PlanView(this.canvas, this.replay);
  }

  prepareControls() {
    const slider = element("time"), { end } = this.replay;
    slider.max = end;
    slider.step = "any";
    slider.addEventListener("input", () => this.seek(Number(slider.value)));
    element("play").addEventListener("click", () => this.toggle());
    element("poster").addEventListener("click", () => this.toggle());
    element("rate").addEventListener("change", (event) => (this.rate = Number(event.target.value)));
    this.choose(element("rate"), end > 90 ? (end > 400 ? 20 : 5) : 1);
    element("camera").addEventListener("change", (event) => this.look(event.target.value));
    this.prepareActors();
    this.camera.listenTo(this.canvas, () => this.changed());
    document.addEventListener("keydown", (event) => this.key(event));
  }

  choose(select, value) {
    select.value = String(value);
    this.rate = value;
  }

  /** A box to tick for each vehicle, and the table of what holds now. */
  prepareActors() {
    const names = [...new Set([...this.replay.actors.map((actor) => actor.name), ...(this.replay.measured ? ["measured"] : [])])];
    for (const name of names.length > 1 ? names : []) {
      const label = document.createElement("label"), box = document.createElement("input");
      Object.assign(box, { type: "checkbox", checked: true });
      box.addEventListener("change", () => {
        if (box.checked) this.view.hidden.delete(name);
        else this.view.hidden.add(name);
        this.changed();
      });
      label.append(box, name);
      element("actors").append(label);
    }
    const head = element("values").createTHead().insertRow();
    head.append(document.createElement("td"), ...this.replay.actors.map((actor) => cell("th", actor.name)));
    const body = element("values").createTBody();
    this.rows = SHOWN.filter((name) => this.lead.has(name)).map((name) => {
      const row = body.insertRow();
      row.append(cell("th", `${spaced(name)} [${this.replay.channels[name].unit}]`));
      return { name, cells: this.replay.actors.map(() => row.insertCell()) };
    });
  }

  /** The bar that says which colour is which tension; none without a cable. */
  prepareBar() {
    const { highestTension } = this.replay;
    element("bar").hidden = !(highestTension > 0) || this.view instanceof PlanView;
    ["bar-low", "bar-middle", "bar-high"].forEach((id, i) => (element(id).textContent = plain((highestTension * i) / 2, 2)));
  }

  /** Show other runs of the same names and the same vehicle, at this moment and from where the camera stands. */
  show(stored) {
    this.replay = readReplay(stored);
    this.lead = this.replay.actors[0];
    this.camera.extent = this.replay.extent;
    this.view.show(this.replay);
    this.plots.show(this.replay);
    element("time").max = this.replay.end;
    this.time = Math.min(this.time, this.replay.end);
    this.prepareBar();
    this.changed();
  }

  look(mode) {
    if (mode === "whole") this.camera.wholeScene();
    else {
      if (this.camera.mode === "stay" && mode !== "stay") this.camera.besideVehicle(this.replay.vehicle.hull.length, this.lead.at("heading", this.time));
      this.camera.mode = mode;
      this.camera.heading = undefined;
    }
    element("camera").value = mode;
    this.changed();
  }

  toggle() {
    element("poster").hidden = true;
    if (!this.hasPlayed || this.time >= this.replay.end) this.time = 0;
    this.hasPlayed = true;
    this.isPlaying = !this.isPlaying;
    element("play").textContent = this.isPlaying ? "❚❚" : "▶";
    element("play").setAttribute("aria-label", this.isPlaying ? "Pause" : "Play");
    this.changed();
  }

  /** Go to a time of the run [s]. */
  seek(t) {
    this.hasPlayed = true;
    element("poster").hidden = true;
    this.time = Math.min(Math.max(t, 0), this.replay.end);
    this.draw(0);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || /^(SELECT|TEXTAREA|BUTTON|SUMMARY|A)$/.test(event.target.tagName)) return;
    const step = this.replay.end * STEP_SHARE * (event.shiftKey ? 10 : 1), { camera } = this;
    const actions = {
      " ": () => this.toggle(), ArrowRight: () => this.seek(this.time + step), ArrowLeft: () => this.seek(this.time - step),
      Home: () => this.seek(0), End: () => this.seek(this.replay.end),
      a: () => camera.orbit(0.08, 0), d: () => camera.orbit(-0.08, 0), w: () => camera.orbit(0, 0.06), s: () => camera.orbit(0, -0.06),
      "+": () => camera.zoom(0.88), "-": () => camera.zoom(1.14),
      f: () => this.look("follow"), t: () => this.look("turn"), x: () => this.look("stay"), v: () => this.look("whole"),
      ".": () => this.faster(1), ",": () => this.faster(-1),
    };
    const isInReplay = element("replay").contains(event.target) || event.target === document.body;
    if (!isInReplay || !actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
    this.changed();
  }

  faster(by) {
    const select = element("rate");
    select.selectedIndex = Math.min(Math.max(select.selectedIndex + by, 0), select.options.length - 1);
    this.rate = Number(select.value);
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    this.size = [clientWidth, clientHeight];
    this.view.pixelsPerPoint = this.fineness;
    this.canvas.width = Math.max(1, Math.round(clientWidth * this.fineness));
    this.canvas.height = Math.max(1, Math.round(clientHeight * this.fineness));
    this.changed();
  }

  changed() {
    this.isStale = true;
  }

  /** Every frame of the screen: go on if it plays, and draw if anything is new. */
  tick(now) {
    const passed = Math.min(now - (this.before ?? now), 250);
    this.before = now;
    if (this.isPlaying) {
      this.time = Math.min(this.time + (passed / 1000) * this.rate, this.replay.end);
      if (this.time >= this.replay.end) this.toggle();
      this.spare(passed);
      this.isStale = true;
    }
    if (this.isStale) this.draw(now);
    requestAnimationFrame((next) => this.tick(next));
  }

  /** Draw more coarsely where this machine is slow. */
  spare(passed) {
    this.slowness = 0.9 * (this.slowness ?? 16) + 0.1 * passed;
    if (this.slowness < SLOWEST_FRAME_MS || this.fineness <= COARSEST) return;
    this.slowness = 16;
    this.setFineness(Math.max(COARSEST, 0.8 * this.fineness));
  }

  draw(now) {
    this.isStale = false;
    if (now) this.waves = now / 1000;
    this.camera.keepTo(this.lead.place(this.time), this.lead.at("heading", this.time));
    this.view.draw(this.time, this.camera, this.isCalm ? 0 : (this.waves ?? 0));
    this.tell();
    this.label();
  }

  tell() {
    const t = this.time, slider = element("time");
    slider.value = t;
    slider.setAttribute("aria-valuetext", `${t.toFixed(1)} seconds`);
    element("clock").textContent = `${t.toFixed(1)} s of ${plain(this.replay.end, 6)} s`;
    this.plots.showTime(t);
    for (const { name, cells } of this.rows)
      cells.forEach((one, i) => {
        one.textContent = said(this.replay.actors[i], name, t);
      });
  }

  /** Names beside what they name, and the scale. */
  label() {
    if (!this.view.onScreen) return;
    const { shown, hidden } = this.view, wanted = new Map();
    for (const actor of this.replay.actors)
      if (shown[actor.name] && !hidden.has(actor.name) && this.replay.actors.length > 1) wanted.set(actor.name, this.besideHull(actor));
    if (shown.drum) wanted.set(this.replay.drum_on_vessel ? "vessel" : "drum", shown.drum.position);
    this.labels ??= new Map();
    for (const [name, place] of wanted) this.putLabel(name, this.view.onScreen(place));
    for (const [name, label] of this.labels) if (!wanted.has(name)) label.hidden = true;
    const bed = this.replay.sea_bed ? `sea bed at ${plain(this.replay.sea_bed)} m` : `grid at ${plain(this.view.groundDepth)} m depth`;
    const large = this.view.scale > 1.05 ? `, vehicle drawn ${plain(this.view.scale, 2)} times its size` : "";
    element("scale").textContent = `${bed}, squares of ${this.view.spacing} m${large}`;
  }

  /** A place just above a vehicle, just below a ghost: so two that are close keep their names apart. */
  besideHull(actor) {
    const [north, east, down] = this.view.shown[actor.name].middle, off = 0.9 * this.replay.vehicle.hull.diameter * this.view.scale;
    return [north, east, down + (actor.isGhost ? off : -off)];
  }

  putLabel(name, at) {
    if (!this.labels.has(name)) {
      const label = cell("div", name);
      label.className = this.replay.actors.some((actor) => actor.name === name && actor.isGhost) ? "label below" : "label";
      element("labels").append(label);
      this.labels.set(name, label);
    }
    const label = this.labels.get(name), ghosts = this.replay.actors.filter((actor) => actor.isGhost).map((actor) => actor.name);
    label.style.marginTop = `${1.7 * Math.max(0, ghosts.indexOf(name))}em`;  // ghosts that are close keep their names apart
    const inside = at && at.every((share) => share > 0.01 && share < 0.97);
    label.hidden = !inside;
    if (inside) label.style.transform = `translate(${at[0] * this.size[0]}px, ${at[1] * this.size[1]}px)`;
  }

  /** Where everything is at a time, from the data: name → channel → value. */
  at(t) {
    return Object.fromEntries(this.replay.actors.map((actor) => [
      actor.name, Object.fromEntries(Object.keys(this.replay.channels).filter((name) => actor.has(name)).map((name) => [name, actor.at(name, t)])),
    ]));
  }

  /** What is on the screen now: the time, the place [north, east, depth] of each vehicle that was drawn, and the
   * arrows of its thrusters, as shares of full thrust. */
  shown() {
    const places = Object.entries(this.view.shown).map(([name, { position }]) => [name, [...position]]);
    const pushes = Object.entries(this.view.shown).map(([name, { pushes }]) => [name, pushes ?? {}]);
    return { time: this.time, places: Object.fromEntries(places), pushes: Object.fromEntries(pushes), camera: this.camera.mode, isPlaying: this.isPlaying };
  }

  /** Draw with so many pixels a point. */
  setFineness(fineness) {
    this.fineness = fineness;
    this.resize();
  }

  /** Show the moment `t` in a picture of so many points, and nothing around it: for films and still pictures. */
  filmAt(t, width, height) {
    const picture = this.canvas.parentElement;
    picture.style.cssText = `position: fixed; left: 0; top: 0; width: ${width}px; height: ${height}px; z-index: 9; border-radius: 0`;
    if (this.size[0] !== this.canvas.clientWidth || this.size[1] !== this.canvas.clientHeight) this.resize();
    this.waves = t;
    this.seek(t);
  }

  /** Draw so many frames of a whole replay one after the other, each to its end, and return how many a second. */
  framesPerSecond(frames = 60) {
    this.seek(0);
    const gl = this.view.gl, pixel = new Uint8Array(4), began = performance.now();
    for (let i = 0; i < frames; i++) {
      this.time = (this.replay.end * i) / frames;
      this.draw(performance.now());
      gl?.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits until all is drawn
    }
    return (1000 * frames) / (performance.now() - began);
  }
}

/** A number as one says it. */
const plain = (value, digits = 3) => String(Number(value.toPrecision(digits)));

function cell(kind, text) {
  const made = document.createElement(kind);
  made.textContent = text;
  return made;
}

const player = new Player(JSON.parse(element("replay-data").textContent));
window.subzero = {
  at: (t) => player.at(t),
  seek: (t) => player.seek(t),
  show: (stored) => player.show(stored),
  shown: () => player.shown(),
  look: (mode) => player.look(mode),
  setFineness: (fineness) => player.setFineness(fineness),
  filmAt: (t, width, height) => player.filmAt(t, width, height),
  framesPerSecond: (frames) => player.framesPerSecond(frames),
  camera: player.camera,
  end: player.replay.end,
};
