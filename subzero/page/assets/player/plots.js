// Channels over time, drawn by uPlot: a click moves the replay, a drag zooms in, a double click shows all again.

const COLOURS = { tethered: "#0072b2", untethered: "#d55e00", nominal: "#7b868c", 0: "#0072b2", 1: "#d55e00", 2: "#009e73", 3: "#aa4499" };
const DARK_COLOURS = { tethered: "#56b4e9", untethered: "#ff8c42", nominal: "#9aa7ad", 0: "#56b4e9", 1: "#ff8c42", 2: "#3fc79a", 3: "#d98ccf" };
const FIRST_SHOWN = [
  "surge_speed", "heading", "depth", "cable_tension", "cable_length", "rudder_angle", "propeller_speed", "pitch", "roll_angle",
];
const HEIGHT = document.body.classList.contains("bare") ? Math.min(Math.max(innerHeight / 4 - 40, 80), 160) : 132;  // inside another page four fill its frame

/** Whether the reader's screen is set to dark. */
export const isDark = () => matchMedia("(prefers-color-scheme: dark)").matches;

export class Plots {
  /** @param seek called with a time when somebody clicks at it. */
  constructor(holder, replay, seek) {
    this.holder = holder;
    this.replay = replay;
    this.seek = seek;
    this.plots = [];
    this.synchronised = uPlot.sync("replay");
    const names = Object.keys(replay.channels);
    const known = FIRST_SHOWN.filter((name) => names.includes(name) && this.isWorthALook(name));
    for (const name of known.length ? known : names.slice(0, 4)) this.add(name);
    this.offerOthers(names);
    new ResizeObserver(() => this.resize()).observe(holder);
  }

  /** A channel that is zero throughout is not drawn unless it is asked for. */
  isWorthALook(name) {
    const isFlat = (values) => values.every((value) => !(Math.abs(value) > 1e-9));
    return this.replay.actors.some((actor) => actor.has(name) && !isFlat(actor.values(name)));
  }

  offerOthers(names) {
    const choice = document.getElementById("add-plot");
    for (const name of names) choice.append(new Option(`${spaced(name)} [${this.replay.channels[name].unit}]`, name));
    choice.addEventListener("change", () => {
      if (choice.value) this.add(choice.value);
      choice.value = "";
    });
  }

  add(name) {
    const { unit, words } = this.replay.channels[name];
    const figure = document.createElement("figure"), caption = document.createElement("figcaption");
    const title = document.createElement("span");
    title.textContent = `${spaced(name)} [${unit}]`;
    title.title = words;
    caption.append(title);
    figure.className = "plot";
    figure.append(caption);
    this.holder.append(figure);
    const lines = this.linesOf(name), values = lines.map((one) => this.readout(caption, one));
    const plot = new uPlot(this.optionsOf(lines), joined(lines), figure);
    plot.root.setAttribute("role", "img");
    plot.root.setAttribute("aria-label", `${words}, over time`);
    const now = document.createElement("div");
    now.className = "now";
    plot.over.append(now);
    plot.over.addEventListener("click", (event) => {
      if (!plot.wasDragged) this.seek(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
    });
    this.plots.push({ name, plot, now, lines, values, width: plot.over.clientWidth });
    this.showTime(this.time ?? 0);
  }

  linesOf(name) {
    const colours = isDark() ? DARK_COLOURS : COLOURS, { actors, measured } = this.replay;
    const isDots = (actor) => actor.name === "measured" && measured?.has(name);
    const lines = actors.filter((actor) => actor.has(name) && !isDots(actor)).map((actor) => ({
      label: actor.name, source: actor, name, stroke: colours[actor.name] ?? colours[actors.indexOf(actor)], dash: actor.isGhost ? [6, 4] : [],
    }));
    if (measured?.has(name)) lines.push({ label: "measured", source: measured, name, stroke: isDark() ? "#ddd" : "#333", dots: true });
    return lines;
  }

  /** Take other runs of the same names; the same channels stay drawn, over the whole time. */
  show(replay) {
    this.replay = replay;
    for (const one of this.plots) {
      one.lines = this.linesOf(one.name);
      one.plot.setData(joined(one.lines));
    }
  }

  readout(caption, { label, stroke }) {
    const value = document.createElement("output");
    value.style.color = stroke;
    value.title = label;
    caption.append(value);
    return value;
  }

  optionsOf(lines) {
    const ink = isDark() ? "#b9c7cc" : "#44525a", faint = isDark() ? "#2b3940" : "#e4eaec";
    const axis = { stroke: ink, grid: { stroke: faint, width: 1 }, ticks: { stroke: faint }, font: "11px system-ui, sans-serif" };
    return {
      width: Math.max(this.holder.clientWidth, 200),
      height: HEIGHT,
      legend: { show: false },
      scales: { x: { time: false } },
      axes: [{ ...axis, size: 26, values: (_, ticks) => ticks.map((tick) => `${tick} s`) }, { ...axis, size: 54 }],
      cursor: { sync: { key: "replay" }, drag: { x: true, y: false, dist: 4 }, points: { size: 5 } },
      hooks: { setSelect: [(plot) => this.remember(plot)] },
      series: [{}, ...lines.map((one) => ({
        label: one.label, stroke: one.stroke, dash: one.dash, width: one.dots ? 0 : 1.6, spanGaps: true,
        points: { show: Boolean(one.dots), size: 3.5, fill: one.stroke },
      }))],
    };
  }

  /** A drag ends with a click: that one does not move the replay. */
  remember(plot) {
    plot.wasDragged = plot.select.width > 0;
    setTimeout(() => (plot.wasDragged = false), 50);
  }

  resize() {
    const width = Math.max(this.holder.firstElementChild?.clientWidth ?? 0, 200);
    for (const one of this.plots) {
      one.plot.setSize({ width, height: HEIGHT });
      one.width = one.plot.over.clientWidth;
    }
    this.showTime(this.time ?? 0);
  }

  /** Move the line of the present, and say what holds then. */
  showTime(t) {
    this.time = t;
    for (const { plot, now, lines, values, width } of this.plots) {
      const x = plot.valToPos(t, "x");
      now.hidden = x < 0 || x > width;  // kept since the last resize: to ask the page in every frame would be slow
      now.style.transform = `translateX(${x}px)`;
      values.forEach((value, i) => (value.textContent = inShort(lines[i].source.at(lines[i].name, t))));
    }
  }
}

/** Lines with times of their own as one table. */
function joined(lines) {
  const tables = lines.map(({ source, name }) => [source.time, Array.from(source.values(name), (x) => (Number.isFinite(x) ? x : null))]);
  return uPlot.join(tables);
}

export const spaced = (name) => name.replaceAll("_", " ");

/** A number in four digits. */
export function inShort(value) {
  if (!Number.isFinite(value)) return "–";
  const digits = Math.max(0, 3 - Math.max(0, Math.floor(Math.log10(Math.abs(value) || 1))));
  return (Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value).toFixed(digits);
}
