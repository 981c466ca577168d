// Triangles of everything solid, in body axes [forward, starboard, down]: nine numbers a corner, place, normal, colour.

import { cross, subtract, unit } from "./vectors.js";

const YELLOW = [0.98, 0.74, 0.08], DARK = [0.13, 0.15, 0.18], BLUE = [0.0, 0.45, 0.7], RED = [0.83, 0.2, 0.12];
const BRONZE = [0.78, 0.6, 0.33], STEEL = [0.62, 0.66, 0.7], ORANGE = [0.95, 0.45, 0.1], WOOD = [0.55, 0.4, 0.26], WHITE = [0.93, 0.94, 0.93];
const AROUND = 24;  // sides of a hull: at 100 pixels across it is round to half a pixel

/** A body of revolution about the forward axis; `rings` are [x, radius, colour of the ring at an angle]. */
function revolved(rings, around = AROUND) {
  const corners = [];
  const normalAt = (i, angle) => {
    const before = rings[Math.max(i - 1, 0)], after = rings[Math.min(i + 1, rings.length - 1)];
    const slope = [after[1] - before[1], before[0] - after[0]];
    return unit([slope[0], slope[1] * Math.cos(angle), slope[1] * Math.sin(angle)]);
  };
  const corner = (i, angle) => {
    const [x, radius, colour] = rings[i];
    corners.push(x, radius * Math.cos(angle), radius * Math.sin(angle), ...normalAt(i, angle), ...colour(angle));
  };
  for (let i = 0; i + 1 < rings.length; i++)
    for (let k = 0; k < around; k++) {
      const a = (2 * Math.PI * k) / around, b = (2 * Math.PI * (k + 1)) / around;
      corner(i, a), corner(i + 1, a), corner(i, b);
      corner(i + 1, a), corner(i + 1, b), corner(i, b);
    }
  return corners;
}

/** Flat faces: each a list of points around it, seen from outside against the clock or with it: both sides are lit. */
function faces(polygons, colour) {
  const corners = [];
  for (const points of polygons) {
    const normal = unit(cross(subtract(points[1], points[0]), subtract(points[2], points[0])));
    for (let i = 1; i + 1 < points.length; i++)
      for (const point of [points[0], points[i], points[i + 1]]) corners.push(...point, ...normal, ...colour);
  }
  return corners;
}

function box([x0, y0, z0], [x1, y1, z1], colour) {
  const p = (x, y, z) => [x ? x1 : x0, y ? y1 : y0, z ? z1 : z0];
  return faces(
    [
      [p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0)], [p(1, 0, 0), p(1, 1, 0), p(1, 1, 1), p(1, 0, 1)],
      [p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1)], [p(0, 1, 0), p(0, 1, 1), p(1, 1, 1), p(1, 1, 0)],
      [p(0, 0, 0), p(0, 1, 0), p(1, 1, 0), p(1, 0, 0)], [p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)],
    ],
    colour,
  );
}

/** The radius of the Myring hull at a distance behind the tip of its nose, as in `vehicle/geometry.py`. */
function hullRadius(hull, aft) {
  const D = hull.diameter, a = hull.nose_length, c = hull.tail_length, tan = Math.tan(hull.tail_angle);
  const s = aft - (hull.length - c);
  if (aft < a) return (D / 2) * Math.max(1 - ((aft - a) / a) ** 2, 0) ** (1 / hull.nose_exponent);
  if (s <= 0) return D / 2;
  return Math.max(D / 2 - ((1.5 * D) / c ** 2 - tan / c) * s ** 2 + (D / c ** 3 - tan / c ** 2) * s ** 3, 0);
}

function hullMesh(hull) {
  const shares = [...Array(10).keys()].map((i) => 1 - Math.cos((Math.PI * i) / 20));
  const nose = shares.map((share) => share * hull.nose_length);
  const bands = [0.26, 0.261, 0.3, 0.301, 0.55].map((share) => share * hull.length);
  const tail = [...Array(10).keys()].map((i) => hull.length - hull.tail_length * (1 - i / 9));
  const colourAt = (aft) => (angle) => {
    if (aft < 0.55 * hull.nose_length) return DARK;
    if (aft > 0.2605 * hull.length && aft < 0.3005 * hull.length) return BLUE;
    return Math.sin(angle) < -0.97 ? RED : YELLOW; // a stripe along the back shows the roll
  };
  const aft = [...new Set([...nose, hull.nose_length, ...bands, ...tail])].sort((a, b) => a - b);
  const rings = aft.map((x) => [hull.nose_station - x, hullRadius(hull, x), colourAt(x)]);
  return revolved(rings);
}

/** A thruster's duct about the forward axis, of radius 1. */
function ductMesh() {
  const rings = [[-0.6, 0.8], [-0.6, 1], [0.6, 1], [0.6, 0.8], [-0.6, 0.8]].map(([x, r]) => [x, r, () => DARK]);
  const hub = [[0.5, 0], [0.3, 0.25], [-0.6, 0.25], [-0.6, 0]].map(([x, r]) => [x, r, () => BRONZE]);
  return [...revolved(rings, 20), ...revolved(hub, 12)];
}

/** An arrow along the forward axis, from 0 to 1, its shaft of radius 0.25. */
function arrowMesh() {
  const colour = () => ORANGE;
  return revolved([[0, 0, colour], [0, 0.25, colour], [0.65, 0.25, colour], [0.65, 0.6, colour], [1, 0, colour]], 16);
}

/** One fin whose root lies on the hull: from a leading to a trailing edge along a span, thick in between. */
function fin(section, root, across, colour) {
  if (!section.area) return [];
  const span = Math.sqrt((section.aspect_ratio * section.area) / 2), chord = section.area / span;
  const thick = cross([1, 0, 0], across);
  const point = (x, out, t) => [0, 1, 2].map((i) => (i === 0 ? section.station + x : 0) + across[i] * (root + out) + thick[i] * t);
  const outline = (out, size) => {
    const c = chord * size, t = 0.06 * c;
    return [point(0.45 * c, out, 0), point(0.15 * c, out, t), point(-0.55 * c, out, 0), point(0.15 * c, out, -t)];
  };
  const low = outline(0, 1.1), high = outline(span, 0.8);
  const sides = low.map((_, i) => [low[i], low[(i + 1) % 4], high[(i + 1) % 4], high[i]]);
  return faces([...sides, high], colour);
}

function propeller(diameter) {
  const radius = diameter / 2, blade = [];
  for (const side of [1, -1]) {
    const strip = [...Array(7).keys()].map((i) => {
      const r = radius * (0.12 + (0.88 * i) / 6), width = radius * 0.34 * Math.sin(0.5 + (2.4 * i) / 6);
      const twist = Math.atan2(0.55 * radius, r), dx = width * Math.sin(twist), dy = width * Math.cos(twist);
      return [[dx, dy * side, r * side], [-dx, -dy * side, r * side]];
    });
    for (let i = 0; i + 1 < strip.length; i++) blade.push([strip[i][0], strip[i][1], strip[i + 1][1], strip[i + 1][0]]);
  }
  const hub = [[0.25, 0], [0.2, 0.14], [-0.1, 0.16], [-0.35, 0]].map(([x, r]) => [x * radius, r * radius, () => DARK]);
  return [...faces(blade, BRONZE), ...revolved(hub, 16)];
}

/** The parts of a vehicle: what is fixed, and what turns about an axis through a point. */
export function vehicleMeshes({ hull, rudder, stern_planes: planes, propeller: screw }) {
  const rootOf = (section) => 0.85 * hullRadius(hull, hull.nose_station - section.station);
  const stern = hull.nose_station - hull.length;
  return {
    hull: hullMesh(hull),
    rudder: [...fin(rudder, rootOf(rudder), [0, 0, 1], RED), ...fin(rudder, rootOf(rudder), [0, 0, -1], RED)],
    port: fin(planes, rootOf(planes), [0, -1, 0], DARK),
    starboard: fin(planes, rootOf(planes), [0, 1, 0], DARK),
    propeller: screw.thrust_constant ? propeller(screw.diameter) : [],
    duct: ductMesh(),
    arrow: arrowMesh(),
    rudderAt: [rudder.station, 0, 0],
    planesAt: [planes.station, 0, 0],
    propellerAt: [stern, 0, 0],
  };
}

/** A drum of radius 1 about the starboard axis, with flanges and spokes so that it is seen to turn. */
export function drumMesh() {
  const turned = ([x, y, z]) => [y, x, z];
  const rings = [
    [-0.62, 0.15], [-0.62, 1.35], [-0.52, 1.35], [-0.5, 0.98], [0.5, 0.98], [0.52, 1.35], [0.62, 1.35], [0.62, 0.15],
  ].map(([x, r], i) => [x, r, (angle) => (i > 2 && i < 5 ? DARK : Math.cos(3 * angle) > 0.6 ? RED : STEEL)]);
  const corners = revolved(rings, 48), out = [];
  for (let i = 0; i < corners.length; i += 9)
    out.push(...turned(corners.slice(i, i + 3)), ...turned(corners.slice(i + 3, i + 6)), ...corners.slice(i + 6, i + 9));
  return out;
}

/** Two posts that hold a drum of radius 1, up to a height above it. */
export function standMesh(height) {
  const post = (y) => box([-0.12, y - 0.07, -height], [0.12, y + 0.07, 0.15], WOOD);
  return [...post(-0.8), ...post(0.8), ...box([-0.9, -1.2, -height - 0.12], [0.9, 1.2, -height], WOOD)];
}

/** A small vessel, 1 long, that floats with its waterline at depth 0. */
export function vesselMesh() {
  const outline = [[0.5, 0], [0.3, 0.13], [-0.1, 0.16], [-0.5, 0.14], [-0.5, -0.14], [-0.1, -0.16], [0.3, -0.13]];
  const deck = outline.map(([x, y]) => [x, y, -0.1]), keel = outline.map(([x, y]) => [x * 0.85, y * 0.6, 0.07]);
  const sides = outline.map((_, i) => [deck[i], deck[(i + 1) % 7], keel[(i + 1) % 7], keel[i]]);
  return [
    ...faces([...sides, keel], [0.7, 0.16, 0.13]), ...faces([deck], WOOD),
    ...box([-0.05, -0.09, -0.24], [0.17, 0.09, -0.1], WHITE), ...box([0.03, -0.07, -0.31], [0.14, 0.07, -0.24], DARK),
  ];
}
