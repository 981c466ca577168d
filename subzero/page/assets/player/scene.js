// Draws one moment of a replay with WebGL2: background, bed, solid things, lines, ghosts, surface, specks, in this order.

import { drumMesh, standMesh, vehicleMeshes, vesselMesh } from "./meshes.js";
import { roundNumber } from "./data.js";
import { background, bed, grid, line, solid, specks, surfaceFromAbove, surfaceFromBelow } from "./shaders.js";
import { add, alongMatrix, length, poseMatrix, product, projectionMatrix, scaled, subtract, transformed, turnAbout, unit, viewMatrix } from "./vectors.js";

const FIELD_OF_VIEW = 0.75;                   // vertical [rad]
const SMALLEST_VEHICLE = 0.055;               // a vehicle is never drawn shorter than this share of the distance to the target
const PROPELLER_SLOWED = 12;                  // a screen shows 25 turns a second as anything but that
const GHOST = [1.0, 0.76, 0.50, 0.36], GHOST_TRACK = [1.0, 0.66, 0.36, 0.95], TRACK = [0.75, 0.93, 1.0, 0.85], DOTS = [1, 1, 1, 0.9];
const WHITE_GHOST = [0.93, 0.98, 1.0, 0.45], WHITE_TRACK = [1, 1, 1, 0.95];   // what others are held against is white, all else that is no more than a ghost orange
const SPECKS = 500;
const DUCT = 0.07, ARROW = 1.0, LEAST_SHARE = 0.01;   // radius of a thruster, and its arrow at full command, as shares of the hull's length
const BACKGROUND_TILES = [24, 24];

const isReference = (actor) => actor.name === "measured" || actor.name === "nominal";

/** WebGL2 on a canvas, or null where there is none. */
export function webglOn(canvas) {
  const options = { antialias: !isDrawnBySoftware(), alpha: false, powerPreference: "high-performance" };
  return canvas.getContext("webgl2", options);
}

/** Without a graphics card smooth edges cost too much: lines are smooth in any case. */
function isDrawnBySoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const about = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = about ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

function programOf(gl, { vertex, fragment }) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  const places = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(program, i);
    places[name] = gl.getUniformLocation(program, name);
  }
  return { program, places };
}

export class Scene {
  /** @param replay of `readReplay`. */
  constructor(gl, replay) {
    this.gl = gl;
    const shaders = { background, solid, line, bed, grid, surfaceFromAbove, surfaceFromBelow, specks };
    this.programs = Object.fromEntries(Object.entries(shaders).map(([name, one]) => [name, programOf(gl, one)]));
    const { rudderAt, planesAt, propellerAt, ...parts } = vehicleMeshes(replay.vehicle);
    this.axes = { rudderAt, planesAt, propellerAt };
    this.meshes = Object.fromEntries(Object.entries(parts).map(([name, corners]) => [name, this.mesh(corners)]));
    this.drum = this.mesh(drumMesh());
    this.vessel = this.mesh(vesselMesh());
    this.nothing = gl.createVertexArray();
    this.lines = this.lineBuffer();
    this.specks = this.speckCloud();
    this.pixelsPerPoint = 1;
    this.hidden = new Set();
    this.show(replay);
  }

  /** Take other runs of the same vehicle. */
  show(replay) {
    this.replay = replay;
    this.tracks = new Map(replay.actors.map((actor) => [actor, trackOf(actor)]));
    this.measured = measuredTrack(replay.measured);
    this.groundDepth = replay.sea_bed ?? depthOfGrid(replay.extent);
    this.cablePoints = new Map();
    this.shown = {};
  }

  mesh(corners) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(corners), gl.STATIC_DRAW);
    for (let i = 0; i < 3; i++) {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 36, 12 * i);
    }
    return { array, count: corners.length / 9 };
  }

  lineBuffer() {
    const gl = this.gl, array = gl.createVertexArray(), buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    for (let i = 0; i < 2; i++) {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, 4, gl.FLOAT, false, 16, 16 * i);
      gl.vertexAttribDivisor(i, 1);
    }
    return { array, buffer };
  }

  speckCloud() {
    const gl = this.gl, array = gl.createVertexArray();
    let state = 7;
    const random = () => ((state = (state * 16807) % 2147483647) / 2147483647);
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, Float32Array.from({ length: 3 * SPECKS }, random), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    return array;
  }

  /** Draw the moment `t` of the replay; `seconds` is the time of the waves. */
  draw(t, camera, seconds) {
    const gl = this.gl, { width, height } = gl.canvas;
    this.place(camera, width, height);
    gl.viewport(0, 0, width, height);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.common = { eye: this.eye, seconds, clearness: this.clearness, toClip: this.toClip };
    gl.disable(gl.BLEND);
    this.drawBackground();
    if (this.replay.sea_bed) this.drawGround(true);
    this.drawSolids(t);
    gl.enable(gl.BLEND);
    if (!this.replay.sea_bed) this.drawGround(false);
    this.drawLines(t, width, height);
    this.drawGhosts(t);
    this.drawSurface();
    this.drawSpecks(height);
  }

  place(camera, width, height) {
    const [low, high] = this.replay.extent, size = length(subtract(high, low));
    this.eye = camera.eye();
    this.distance = camera.distance;
    this.reach = 8 * size + 12 * camera.distance + 100;
    this.near = Math.max(0.02 * camera.distance, 0.02);
    this.clearness = 9 + 2.4 * camera.distance + 0.02 * size;
    const projection = projectionMatrix(FIELD_OF_VIEW, width / height, this.near, this.reach * 1.5);
    this.toClip = product(projection, viewMatrix(this.eye, camera.target));
    this.scale = Math.max(1, (SMALLEST_VEHICLE * camera.distance) / this.replay.vehicle.hull.length);
  }

  use(name, values) {
    const gl = this.gl, { program, places } = this.programs[name];
    gl.useProgram(program);
    for (const [key, value] of Object.entries({ ...this.common, ...values })) {
      const at = places[key];
      if (at === undefined) continue;
      if (typeof value === "number") gl.uniform1f(at, value);
      else if (value.length === 16) gl.uniformMatrix4fv(at, false, value);
      else gl[`uniform${value.length}fv`](at, value);
    }
  }

  drawBackground() {
    const gl = this.gl;
    gl.disable(gl.DEPTH_TEST);
    this.use("background", { toWorld: inverse(this.toClip), tiles: BACKGROUND_TILES });
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 6 * BACKGROUND_TILES[0] * BACKGROUND_TILES[1]);
    gl.enable(gl.DEPTH_TEST);
  }

  drawGround(isBed) {
    const middle = [this.eye[0], this.eye[1], this.groundDepth];
    this.spacing = roundNumber(Math.max(this.distance / 5, 0.1));
    this.use(isBed ? "bed" : "grid", { middle, reach: this.reach, spacing: this.spacing });
    this.drawPlane(isBed);
  }

  drawSurface() {
    const middle = [this.eye[0], this.eye[1], 0];
    this.use(this.eye[2] < 0 ? "surfaceFromAbove" : "surfaceFromBelow", { middle, reach: this.reach, waveLength: 1.2 + 0.05 * this.distance });
    this.drawPlane(false);
  }

  drawPlane(isSolid) {
    const gl = this.gl;
    gl.depthMask(isSolid);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.depthMask(true);
  }

  drawMesh({ array, count }, toEarth, tint = [0, 0, 0, -1]) {
    this.use("solid", { toEarth, tint });
    this.gl.bindVertexArray(array);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, count);
  }

  visible(isGhost) {
    return this.replay.actors.filter((actor) => actor.isGhost === isGhost && !this.hidden.has(actor.name));
  }

  drawSolids(t) {
    for (const actor of this.visible(false)) {
      this.drawVehicle(actor, t);
      this.drawDrum(actor, t);
    }
  }

  /** First how near a ghost is, then its nearest side only: otherwise one would see its insides through its skin. */
  drawGhosts(t) {
    const gl = this.gl;
    for (const actor of this.visible(true)) {
      gl.colorMask(false, false, false, false);
      this.drawVehicle(actor, t, isReference(actor) ? WHITE_GHOST : GHOST);
      gl.colorMask(true, true, true, true);
      gl.depthFunc(gl.LEQUAL);
      this.drawVehicle(actor, t, isReference(actor) ? WHITE_GHOST : GHOST);
      gl.depthFunc(gl.LESS);
    }
  }

  /** A vehicle is enlarged about its tow point, so that the cable still ends where it is fixed. */
  drawVehicle(actor, t, tint) {
    const place = actor.place(t), { x, y, z } = this.replay.vehicle.tow_point;
    const pose = poseMatrix(place, ...actor.attitude(t));
    const tow = transformed(pose, [x, y, z]), towLarge = transformed(poseMatrix(place, ...actor.attitude(t), this.scale), [x, y, z]);
    const large = poseMatrix(add(place, subtract(tow, towLarge)), ...actor.attitude(t), this.scale);
    this.shown[actor.name] = { position: [pose[12], pose[13], pose[14]], middle: [large[12], large[13], large[14]] };
    const radians = (name) => (actor.at(name, t) * Math.PI) / 180;
    const { rudderAt, planesAt, propellerAt } = this.axes;
    const turned = (point, axis, angle) => product(large, turnAbout(point, axis, angle));
    this.drawMesh(this.meshes.hull, large, tint);
    // A positive rudder moves its trailing edge to starboard, positive stern-planes theirs up.
    this.drawMesh(this.meshes.rudder, turned(rudderAt, [0, 0, 1], -radians("rudder_angle")), tint);
    this.drawMesh(this.meshes.port, turned(planesAt, [0, 1, 0], -radians("stern_plane_port_angle")), tint);
    this.drawMesh(this.meshes.starboard, turned(planesAt, [0, 1, 0], -radians("stern_plane_starboard_angle")), tint);
    this.drawThrusters(actor, t, large, tint);
    const turns = (actor.propellerTurns(t) / PROPELLER_SLOWED) % 1;
    this.drawMesh(this.meshes.propeller, turned(propellerAt, [1, 0, 0], 2 * Math.PI * turns), tint);
  }

  /** Each thruster where it stands; an arrow is the push on the hull, at full command as long as the hull. */
  drawThrusters(actor, t, large, tint) {
    const size = this.replay.vehicle.hull.length, pushes = (this.shown[actor.name].pushes = {});
    for (const [name, one] of Object.entries(this.replay.vehicle.thrusters ?? {})) {
      const place = [one.x, one.y, one.z], ahead = [one.direction_x, one.direction_y, one.direction_z];
      this.drawMesh(this.meshes.duct, product(large, alongMatrix(place, ahead, DUCT * size, DUCT * size)), tint);
      const share = actor.has(`${name}_state`) ? actor.at(`${name}_state`, t) : 0;
      if (!(Math.abs(share) > LEAST_SHARE)) continue;
      pushes[name] = share;
      const push = scaled(unit(ahead), Math.sign(share)), tip = add(place, scaled(push, 0.6 * DUCT * size));
      this.drawMesh(this.meshes.arrow, product(large, alongMatrix(tip, push, ARROW * size * Math.abs(share), 0.6 * DUCT * size)), tint);
    }
  }

  drawDrum(actor, t) {
    const place = actor.cable?.drum(t);
    if (!place) return;
    const radius = Math.max(this.replay.drum_radius, 0.012 * this.distance), before = actor.cable.drum(t - 0.5) ?? place;
    const heading = actor.at("heading", 0);
    const course = length(subtract(place, before)) > 1e-3 ? (Math.atan2(place[1] - before[1], place[0] - before[0]) * 180) / Math.PI : 0;
    this.shown.drum = { position: place };
    const wound = -actor.at("cable_length", t) / this.replay.drum_radius;
    const pose = poseMatrix(place, 0, 0, this.replay.drum_on_vessel ? course : heading, radius);
    this.drawMesh(this.drum, product(pose, turnAbout([0, 0, 0], [0, 1, 0], wound)));
    if (this.replay.drum_on_vessel) {
      const size = Math.max(6, 0.12 * this.distance);
      this.drawMesh(this.vessel, poseMatrix([place[0], place[1], 0], 0, 0, course, size));
    } else {
      this.stand ??= this.mesh(standMesh(1));
      const height = Math.max(place[2], 0) + 2.2 * radius;
      const stretched = poseMatrix(place, 0, 0, heading, radius);
      for (let row = 0; row < 3; row++) stretched[8 + row] *= height / radius;
      this.drawMesh(this.stand, stretched);
    }
  }

  drawLines(t, width, height) {
    const pixels = this.pixelsPerPoint;
    const common = { screen: [width, height], nearest: this.near * 1.05, highest: this.replay.highestTension || 1 };
    if (this.measured && !this.hidden.has("measured")) this.drawLine(this.measured, { ...common, colour: DOTS, width: 1.2 * pixels, dash: 0.002 * this.distance + 0.01, opacity: 0.9 });
    for (const actor of this.visible(true)) {
      const dash = 0.012 * this.distance;
      this.drawLine(this.trackUntil(actor, t), { ...common, colour: isReference(actor) ? WHITE_TRACK : GHOST_TRACK, width: 1.3 * pixels, dash, opacity: 0.9 });
      this.drawCable(actor, t, { ...common, width: 2.2 * pixels, dash: 0, opacity: 0.4 });
    }
    for (const actor of this.visible(false)) {
      this.drawLine(this.trackUntil(actor, t), { ...common, colour: TRACK, width: 1.0 * pixels, dash: 0, opacity: 0.55 });
      const at = this.shown[actor.name].middle;
      this.drawLine(new Float32Array([...at, 0, at[0], at[1], 0, at[2]]), { ...common, colour: [1, 1, 1, 0.5], width: 0.7 * pixels, dash: 0.012 * this.distance, opacity: 0.8 });
      this.drawCable(actor, t, { ...common, width: 3.2 * pixels, dash: 0, opacity: 1 });
    }
  }

  drawCable(actor, t, look) {
    if (!actor.cable) return;
    if (!this.cablePoints.has(actor)) this.cablePoints.set(actor, new Float32Array(4 * actor.cable.points));
    const points = this.cablePoints.get(actor);
    if (actor.cable.fill(t, points)) this.drawLine(points, { ...look, colour: [0, 0, 0, -1] });
  }

  drawLine(points, look) {
    const gl = this.gl;
    if (points.length < 8) return;
    gl.depthMask(false);
    this.use("line", look);
    gl.bindVertexArray(this.lines.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lines.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, points, gl.STREAM_DRAW);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, points.length / 4 - 1);
    gl.depthMask(true);
  }

  trackUntil(actor, t) {
    const track = this.tracks.get(actor);
    let count = 0;
    while (count < actor.time.length && actor.time[count] < t) count++;
    const head = actor.place(t), until = new Float32Array(4 * (count + 1));
    until.set(track.subarray(0, 4 * count));
    const before = count ? track.subarray(4 * count - 4, 4 * count) : [...head, 0];
    until.set([...head, before[3] + Math.hypot(head[0] - before[0], head[1] - before[1], head[2] - before[2])], 4 * count);
    return until;
  }

  drawSpecks(height) {
    const gl = this.gl;
    gl.depthMask(false);
    this.use("specks", { middle: this.eye, side: 2.2 * this.distance, pixels: height / 2 });
    gl.bindVertexArray(this.specks);
    gl.drawArrays(gl.POINTS, 0, SPECKS);
    gl.depthMask(true);
  }

  /** Where a place is on the canvas, as shares of its width and height; null behind the eye. */
  onScreen(place) {
    const w = this.toClip[3] * place[0] + this.toClip[7] * place[1] + this.toClip[11] * place[2] + this.toClip[15];
    if (w < this.near) return null;
    const [x, y] = transformed(this.toClip, place);
    return [0.5 + (0.5 * x) / w, 0.5 - (0.5 * y) / w];
  }
}

/** The places of a vehicle, each with the length of the way to it. */
function trackOf(actor) {
  return withLength(["north", "east", "depth"].map((name) => actor.values(name)));
}

/** The places that were measured, as far as they are known; null if they were not. */
function measuredTrack(measured) {
  if (!measured || !["north", "east"].every((name) => measured.has(name))) return null;
  const [north, east] = ["north", "east"].map((name) => measured.values(name));
  const depth = measured.has("depth") ? measured.values("depth") : new Float64Array(north.length);
  const known = [...north.keys()].filter((i) => Number.isFinite(north[i] + east[i] + depth[i]));
  return withLength([north, east, depth].map((values) => known.map((i) => values[i])));
}

function withLength(columns) {
  const count = columns[0].length, track = new Float32Array(4 * count);
  let way = 0;
  for (let i = 0; i < count; i++) {
    if (i) way += Math.hypot(...columns.map((values) => values[i] - values[i - 1]));
    track.set([...columns.map((values) => values[i]), way], 4 * i);
  }
  return track;
}

/** Where the bed is not known, a grid lies a little below all that moves. */
function depthOfGrid([low, high]) {
  const size = Math.max(high[0] - low[0], high[1] - low[1], high[2] - Math.max(low[2], 0));
  return Math.ceil(Math.max(high[2], 0) + Math.max(1, 0.06 * size));
}

/** The inverse of a 4×4 matrix, by Gauss and Jordan. */
function inverse(A) {
  const rows = [0, 1, 2, 3].map((r) => [...[0, 1, 2, 3].map((c) => A[4 * c + r]), ...[0, 1, 2, 3].map((c) => +(c === r))]);
  for (let i = 0; i < 4; i++) {
    const pivot = rows.slice(i).reduce((best, row) => (Math.abs(row[i]) > Math.abs(best[i]) ? row : best));
    rows.splice(i, 0, ...rows.splice(rows.indexOf(pivot), 1));
    const leading = pivot[i];
    rows[i] = rows[i].map((value) => value / leading);
    for (let k = 0; k < 4; k++) if (k !== i) rows[k] = rows[k].map((value, c) => value - rows[i][c] * rows[k][i]);
  }
  return new Float64Array([0, 1, 2, 3].flatMap((c) => rows.map((row) => row[4 + c])));
}
