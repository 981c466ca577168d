// An eye that circles around a target: it follows the first vehicle, turns with it, or stays.

import { add, length, mixed, subtract } from "./vectors.js";

const STEEPEST_DOWN = -1.45, STEEPEST_UP = 1.45;         // of the angle above the horizontal [rad]

export class Camera {
  constructor(extent) {
    this.extent = extent;
    this.mode = "follow";
    this.azimuth = 0;       // direction in which it looks, clockwise from north [rad]
    this.elevation = 0.3;   // how far above its target it is [rad]
    this.distance = 4;
    this.target = [0, 0, 0];
  }

  eye() {
    const level = Math.cos(this.elevation) * this.distance;
    const back = [-Math.cos(this.azimuth) * level, -Math.sin(this.azimuth) * level, -Math.sin(this.elevation) * this.distance];
    return add(this.target, back);
  }

  /** Look from behind and beside a vehicle of this length and heading [degree]. */
  besideVehicle(hullLength, heading) {
    this.azimuth = (heading * Math.PI) / 180 - 0.7;
    this.elevation = 0.14;
    this.distance = 2.7 * hullLength;
  }

  /** See all of it, from above and beside. */
  wholeScene() {
    const [low, high] = this.extent, size = length(subtract(high, low));
    this.mode = "stay";
    this.target = mixed(low, high, 0.5);
    this.distance = Math.max(1.1 * size, 3);
    this.elevation = 0.5;
    this.azimuth = Math.atan2(high[1] - low[1], high[0] - low[0]) - 1.0;
  }

  /** Keep to a vehicle that is now at a place, heading so [degree]. */
  keepTo(place, heading) {
    if (this.mode === "stay") return;
    if (this.mode === "turn" && this.heading !== undefined) this.azimuth += ((heading - this.heading) * Math.PI) / 180;
    this.heading = heading;
    this.target = place;
  }

  orbit(right, up) {
    this.azimuth -= right;
    this.elevation = Math.min(Math.max(this.elevation + up, STEEPEST_DOWN), STEEPEST_UP);
  }

  zoom(factor) {
    const [low, high] = this.extent;
    this.distance = Math.min(Math.max(this.distance * factor, 0.8), 6 * length(subtract(high, low)) + 30);
  }

  /** Move the target across the picture, by shares of its height; then it stays. */
  shift(right, up) {
    const step = 0.8 * this.distance, c = Math.cos(this.azimuth), s = Math.sin(this.azimuth);
    this.mode = "stay";
    this.target = add(this.target, [-s * right * step, c * right * step, -up * step]);
  }

  /** Let a mouse, fingers and a wheel on an element turn, shift and zoom it. */
  listenTo(element, changed) {
    const fingers = new Map();
    element.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, event);
      element.setPointerCapture(event.pointerId);
    });
    for (const end of ["pointerup", "pointercancel"]) element.addEventListener(end, (event) => fingers.delete(event.pointerId));
    element.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const size = element.clientHeight, dx = (event.clientX - before.clientX) / size, dy = (event.clientY - before.clientY) / size;
      if (fingers.size === 2) this.pinch(fingers, event);
      else if (event.shiftKey || event.buttons & 2) this.shift(-dx, dy);
      else this.orbit(-dx * 3.5, dy * 3);
      fingers.set(event.pointerId, event);
      changed();
    });
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.0012 * Math.max(-300, Math.min(300, event.deltaY))));
      changed();
    }, { passive: false });
  }

  pinch(fingers, moved) {
    const [other] = [...fingers.values()].filter((one) => one.pointerId !== moved.pointerId);
    const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
    this.zoom(apart(fingers.get(moved.pointerId)) / apart(moved));
  }
}
