// Vectors and 4×4 matrices, as WebGL wants them: column by column. All places are [north, east, down].

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scaled = (a, factor) => [a[0] * factor, a[1] * factor, a[2] * factor];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
export const unit = (a) => scaled(a, 1 / (length(a) || 1));
export const mixed = (a, b, share) => a.map((value, i) => value + (b[i] - value) * share);

/** The product A B. */
export function product(A, B) {
  const C = new Float64Array(16);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++)
      for (let k = 0; k < 4; k++) C[4 * column + row] += A[4 * k + row] * B[4 * column + k];
  return C;
}

/** A x for a point x: [x, y, z, w]. */
export function transformed(A, [x, y, z]) {
  return [0, 1, 2, 3].map((row) => A[row] * x + A[4 + row] * y + A[8 + row] * z + A[12 + row]);
}

/** From body axes to the earth's: turned by roll, pitch and heading [degree] (z-y-x), enlarged, and moved to a place. */
export function poseMatrix(place, roll, pitch, heading, scale = 1) {
  const [cr, cp, ch] = [roll, pitch, heading].map((angle) => Math.cos((angle * Math.PI) / 180));
  const [sr, sp, sh] = [roll, pitch, heading].map((angle) => Math.sin((angle * Math.PI) / 180));
  const columns = [
    [ch * cp, sh * cp, -sp],
    [ch * sp * sr - sh * cr, sh * sp * sr + ch * cr, cp * sr],
    [ch * sp * cr + sh * sr, sh * sp * cr - ch * sr, cp * cr],
  ];
  return new Float64Array([...columns.flatMap((column) => [...scaled(column, scale), 0]), ...place, 1]);
}

/** Turned about an axis through a point, by an angle [rad]. */
export function turnAbout(point, axis, angle) {
  const [x, y, z] = axis, c = Math.cos(angle), s = Math.sin(angle), k = 1 - c;
  const columns = [
    [c + x * x * k, y * x * k + z * s, z * x * k - y * s],
    [x * y * k - z * s, c + y * y * k, z * y * k + x * s],
    [x * z * k + y * s, y * z * k - x * s, c + z * z * k],
  ];
  const moved = point.map((value, i) => value - columns.reduce((sum, column, j) => sum + column[i] * point[j], 0));
  return new Float64Array([...columns.flatMap((column) => [...column, 0]), ...moved, 1]);
}

/** From the earth's axes to the camera's, for an eye that looks at a target; up is −down. */
export function viewMatrix(eye, target) {
  const back = unit(subtract(eye, target)), right = unit(cross([0, 0, -1], back)), up = cross(back, right);
  const rows = [right, up, back];
  const columns = [0, 1, 2].flatMap((axis) => [...rows.map((row) => row[axis]), 0]);
  return new Float64Array([...columns, ...rows.map((row) => -dot(row, eye)), 1]);
}

/** Perspective; the angle [rad] is the vertical field of view. */
export function projectionMatrix(angle, aspect, near, far) {
  const f = 1 / Math.tan(angle / 2), d = 1 / (near - far);
  return new Float64Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (near + far) * d, -1, 0, 0, 2 * near * far * d, 0]);
}

/** The forward axis laid along a direction from a place, `long` for 1, and `wide` across it. */
export function alongMatrix(place, direction, long, wide) {
  const ahead = unit(direction), aside = Math.abs(ahead[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
  const across = unit(cross(aside, ahead)), third = cross(ahead, across);
  const columns = [scaled(ahead, long), scaled(across, wide), scaled(third, wide)];
  return new Float64Array([...columns.flatMap((column) => [...column, 0]), ...place, 1]);
}
