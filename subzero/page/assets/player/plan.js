// The replay where there is no WebGL: seen from above, north up, and from the side, in two halves of a flat canvas.

import { roundNumber } from "./data.js";

const PLAN_COLOURS = { solid: "#56b4e9", ghost: "#e69f00", ink: "#dfeef2", water: "#0d3b4f", cable: "#ffd166" };

export class PlanView {
  constructor(canvas, replay) {
    this.canvas = canvas;
    this.paper = canvas.getContext("2d");
    this.hidden = new Set();
    this.show(replay);
  }

  /** Take other runs. */
  show(replay) {
    this.replay = replay;
    this.shown = {};
  }

  draw(t) {
    const { canvas, paper } = this, { width, height } = canvas, half = width / 2;
    paper.fillStyle = PLAN_COLOURS.water;
    paper.fillRect(0, 0, width, height);
    const [low, high] = this.replay.extent;
    const deep = Math.max(high[2] * 1.1, this.replay.sea_bed ?? 0, 1), [ahead, way] = alongCourse(low, high);
    this.half(t, 0, half, "from above, north up", (p) => [p[1], -p[0]], [low[1], -high[0], high[1], -low[0]]);
    this.half(t, half, half, "from the side, depth down", (p) => [ahead(p), p[2]], [...way.slice(0, 1), -0.1 * deep, way[1], deep]);
  }

  half(t, left, width, words, project, [x0, y0, x1, y1]) {
    const { paper, canvas } = this, edge = 0.09 * canvas.height;
    const scale = Math.min((width - 2 * edge) / Math.max(x1 - x0, 1), (canvas.height - 2.6 * edge) / Math.max(y1 - y0, 1));
    const at = (place) => {
      const [x, y] = project(place);
      return [left + width / 2 + (x - (x0 + x1) / 2) * scale, canvas.height / 2 + (y - (y0 + y1) / 2) * scale];
    };
    paper.save();
    paper.beginPath();
    paper.rect(left, 0, width, canvas.height);
    paper.clip();
    for (const actor of this.replay.actors) if (!this.hidden.has(actor.name)) this.drawActor(actor, t, at);
    paper.restore();
    const metre = roundNumber((0.3 * width) / scale), size = Math.round(canvas.height / 30);
    paper.fillStyle = paper.strokeStyle = PLAN_COLOURS.ink;
    paper.font = `${size}px system-ui, sans-serif`;
    paper.fillText(words, left + edge / 2, canvas.height - edge / 2);
    paper.fillText(`${metre} m`, left + width - edge / 2 - metre * scale, canvas.height - 0.8 * edge);
    paper.fillRect(left + width - edge / 2 - metre * scale, canvas.height - 0.7 * edge, metre * scale, 2);
    paper.strokeRect(left, 0, width, canvas.height);
  }

  drawActor(actor, t, at) {
    const { paper } = this, colour = actor.name === "measured" ? PLAN_COLOURS.ink : actor.isGhost ? PLAN_COLOURS.ghost : PLAN_COLOURS.solid;
    const [north, east, depth] = ["north", "east", "depth"].map((name) => actor.values(name));
    const track = [...actor.time].flatMap((time, i) => (time <= t ? [[north[i], east[i], depth[i]]] : []));
    this.polyline([...track, actor.place(t)].map(at), colour, actor.isGhost);
    const shape = new Float32Array(4 * (actor.cable?.points ?? 0));
    if (actor.cable?.fill(t, shape)) {
      const points = [...Array(actor.cable.points).keys()].map((i) => [...shape.subarray(4 * i, 4 * i + 3)]);
      this.polyline(points.map(at), PLAN_COLOURS.cable, false, 3);
    }
    const place = actor.place(t), [x, y] = at(place);
    this.shown[actor.name] = { position: place, middle: place };
    paper.fillStyle = colour;
    paper.beginPath();
    paper.arc(x, y, this.canvas.height / 90, 0, 2 * Math.PI);
    paper.fill();
  }

  polyline(points, colour, isDashed, width = 2) {
    const { paper } = this;
    paper.strokeStyle = colour;
    paper.lineWidth = width;
    paper.setLineDash(isDashed ? [8, 5] : []);
    paper.beginPath();
    points.forEach(([x, y], i) => (i ? paper.lineTo(x, y) : paper.moveTo(x, y)));
    paper.stroke();
    paper.setLineDash([]);
  }
}

/** How far along the longer horizontal side of a box a place lies, and where that begins and ends. */
function alongCourse(low, high) {
  const axis = high[0] - low[0] >= high[1] - low[1] ? 0 : 1;
  return [(place) => place[axis], [low[axis], high[axis]]];
}
