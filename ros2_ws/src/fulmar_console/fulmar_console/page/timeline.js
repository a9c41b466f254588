// Bags on the page: a time line with marks, play in both directions, and two bags beside each other.
import { element } from "./controls.js";
import { compare, fetchBag, last, partner } from "./tracks.js";
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
const FRAME_S = 0.04;
const HEALTH_MS = 200;
const IMAGE_MS = 100;
const TRAIL_S = 60; // of the trail that is drawn after a jump
const POINTS = 600; // of one curve
const LETTERS = ["A", "B"];
const GHOSTS = ["#f2a0c0", "#c8d860", "#e0b070"];

export async function openBags(app, hello, section) {
  const { feed } = app;
  section.hidden = false;
  // The server's own frames are only its sign of life: robots come from the bags.
  const takeText = feed.takeText.bind(feed);
  feed.takeBinary = () => {};
  feed.takeText = (message) => ["hello", "bye"].includes(message.type) && takeText(message);
  const refuse = async ({ do: what }) => ({ accepted: false, words: what === "look" ? "" : `'${what}' is for robots that run; this page plays bags` });
  feed.send = refuse;
  const words = element("p", { id: "reading", role: "status", textContent: "Reading the bags" });
  section.replaceChildren(words);
  const began = performance.now();
  const tell = ({ name, share, words: what }) => (words.textContent = `${name}: ${what}, ${Math.round(100 * share)} %`);
  try {
    const bags = await Promise.all(hello.bags.map(({ path }) => fetchBag(path, tell)));
    const timeline = new Timeline(app, bags, section);
    timeline.opened_ms = performance.now() - began;
    return timeline;
  } catch (error) {
    words.textContent = `The bag cannot be shown: ${error.message}.`;
    return { failed: error.message };
  }
}

class Timeline {
  constructor(app, bags, section) {
    Object.assign(this, { app, bags, section, speed: 1, direction: 0, t_s: 0, align: "start", healthAt: 0, imageAt: 0, shown: {}, plotted: null });
    this.robots = bags.flatMap((bag, number) => bag.robots.map((robot) => ({ robot, bag, number })));
    this.robots.forEach((each, index) => (each.index = index));
    this.records = this.robots.map(({ robot, number, index }) => {
      const { record } = robot;
      const name = bags.length > 1 ? `${LETTERS[number]}: ${record.name}` : record.name;
      const ghost = number > 0 ? { ghost: true, color: GHOSTS[record.index % GHOSTS.length] } : {};
      return { ...record, ...ghost, index, name };
    });
    this.build();
    this.setAlignment("start");
    app.feed.emit("robots", this.records);
    addEventListener("keydown", (event) => this.key(event));
    // Another robot is chosen while it stands: its plots and images.
    setInterval(() => !this.direction && this.plotted !== this.plotKey && this.emit(true), HEALTH_MS);
    this.seek(this.begin_s);
    this.emit(true);
    app.scene?.look("follow"); // a view of all would soon show an empty place
  }

  build() {
    const button = (id, text, title, onclick) => element("button", { id, textContent: text, title, onclick });
    this.play = button("play", "▶ Play", "Play or pause (space)", () => this.toggle(1));
    this.back = button("back", "◀", "Play backwards (b)", () => this.toggle(-1));
    const steps = [button("stepback", "−1", "One frame back (←)", () => this.step(-1)), button("stepon", "+1", "One frame on (→)", () => this.step(1))];
    this.speeds = element("select", { id: "speed", title: "Speed (+ and −)", onchange: () => (this.speed = Number(this.speeds.value)) }, ...SPEEDS.map((each) => new Option(`${each} ×`, each)));
    this.speeds.value = 1;
    this.clock = element("output", { id: "clock" });
    this.range = element("input", { id: "scrub", type: "range", step: "any", oninput: () => this.jump(Number(this.range.value)) });
    this.range.setAttribute("aria-label", "Time of the recording");
    this.lanes = this.bags.map((_, number) => element("div", { className: "lane", title: this.bags.length > 1 ? LETTERS[number] : "" }));
    this.said = element("p", { id: "marked", className: "hint" });
    this.section.replaceChildren(element("div", { className: "row player" }, this.back, steps[0], this.play, steps[1], this.speeds, this.clock, ...this.comparing()), this.range, ...this.lanes, this.said, ...this.notes());
  }

  // With one bag, how a second one is opened; with two, which is which and what they begin at.
  comparing() {
    if (this.bags.length < 2) {
      const hint = `Compare with another bag: fulmar console ${this.bags[0].name} OTHER`;
      const open = element("button", { id: "compare", textContent: "Compare…", onclick: () => (this.said.textContent = `${hint}   (both are then drawn in one scene, with their difference)`) });
      return [open];
    }
    const names = this.bags.map((bag, number) => element("span", { className: `bag bag${number}`, textContent: `${LETTERS[number]}: ${bag.name}` }));
    const select = element("select", { id: "align", title: "What the two bags begin at", onchange: () => (this.setAlignment(select.value), this.seek(this.begin_s), (this.plotted = null)) }, new Option("aligned at the start", "start"), new Option("aligned at the first goal", "goal"));
    return [...names, select];
  }

  notes() {
    const lines = this.bags.flatMap((bag) => bag.notes);
    const [first, second] = this.bags;
    const unlike = second && first.robots.filter((robot) => !partner(robot, second.robots));
    if (unlike?.length) {
      const kinds = this.bags.map((bag) => bag.robots.map((robot) => robot.record.info?.title || robot.record.name).join(", "));
      lines.unshift(`The bags hold different robots (${kinds.join("; ")}): both are drawn, and only robots of one type have a difference.`);
    }
    if (!lines.length) return [];
    const more = element("details", { id: "bagnotes", className: "hint" }, element("summary", { textContent: lines[0] }), ...lines.slice(1, 20).map((text) => element("p", { textContent: text })));
    return [more];
  }

  setAlignment(align) {
    this.align = align;
    this.shifts = this.bags.map((bag) => (align === "goal" ? bag.firstGoal_s : 0));
    this.begin_s = Math.min(...this.shifts.map((shift) => -shift));
    this.end_s = Math.max(...this.bags.map((bag, i) => bag.seconds - this.shifts[i]));
    [this.range.min, this.range.max] = [this.begin_s, this.end_s];
    this.lanes.forEach((lane, number) => lane.replaceChildren(...this.bags[number].marks.map((mark) => this.mark(mark, number))));
  }

  mark({ t_s, kind, robot, words }, number) {
    const at = t_s - this.shifts[number];
    const text = `${t_s.toFixed(1)} s  ${robot}: ${words || kind}`;
    const made = element("button", { className: `mark ${kind}`, title: text, onclick: () => (this.jump(at), (this.said.textContent = text)) });
    made.style.left = `${(100 * (at - this.begin_s)) / (this.end_s - this.begin_s || 1)}%`;
    made.onmouseenter = made.onfocus = () => (this.said.textContent = text);
    made.setAttribute("aria-label", text);
    made.tabIndex = -1;
    return made;
  }

  toggle(direction) {
    if (this.direction === direction) return this.pause();
    if (direction > 0 && this.t_s >= this.end_s) this.seek(this.begin_s);
    if (direction < 0 && this.t_s <= this.begin_s) this.seek(this.end_s);
    const waits = this.direction !== 0;
    this.direction = direction;
    this.showPlaying();
    this.at_ms = performance.now();
    if (!waits) requestAnimationFrame((now) => this.tick(now));
  }

  pause() {
    this.direction = 0;
    this.showPlaying();
    this.emit(true);
  }

  showPlaying() {
    this.play.textContent = this.direction > 0 ? "❚❚ Pause" : "▶ Play";
    this.back.textContent = this.direction < 0 ? "❚❚" : "◀";
  }

  tick(now) {
    if (!this.direction) return;
    const passed_s = Math.max(0, now - this.at_ms) / 1000;
    this.at_ms = Math.max(now, this.at_ms);
    const before = this.t_s;
    this.t_s = Math.min(Math.max(before + this.direction * this.speed * passed_s, this.begin_s), this.end_s);
    if (this.direction < 0) this.drawTrails();
    else this.tellMarks(before);
    this.emit();
    if (this.t_s === (this.direction > 0 ? this.end_s : this.begin_s)) this.pause();
    else requestAnimationFrame((then) => this.tick(then));
  }

  step(frames) { this.jump(this.t_s + frames * FRAME_S); }

  jump(t_s) {
    this.direction = 0;
    this.showPlaying();
    this.seek(t_s);
  }

  seek(t_s) {
    this.t_s = Math.min(Math.max(t_s, this.begin_s), this.end_s);
    this.drawTrails();
    this.emit(true);
  }

  // What happened while it played, for the list.
  tellMarks(before) {
    this.bags.forEach((bag, number) => {
      const from = last(bag.marks, before + this.shifts[number], (mark) => mark.t_s) + 1;
      for (let i = from; i < bag.marks.length && bag.marks[i].t_s <= this.t_s + this.shifts[number]; i++) {
        const mark = bag.marks[i];
        this.app.feed.emit("event", this.bags.length > 1 ? { ...mark, robot: `${LETTERS[number]}: ${mark.robot}` } : mark);
      }
    });
  }

  drawTrails() {
    if (!this.app.scene) return;
    this.app.scene.clearTrails();
    for (const { robot, number, index } of this.robots) {
      const drawn = this.app.scene.robots.get(index);
      const now = this.t_s + this.shifts[number];
      for (let t = Math.max(robot.begin_s, now - TRAIL_S); drawn && t <= Math.min(now, robot.end_s); t += TRAIL_S / 300) {
        const [x, y, z] = robot.pose(t);
        drawn.trail.add({ x, y, z }, t - this.shifts[number], 0.1 * (robot.record.info?.radius || 0.3));
      }
    }
  }

  // Hand the robots at this time to the page; health, plots and images less often unless it stands.
  emit(whole = false) {
    const now = performance.now();
    const samples = this.robots.map(({ robot, number, index }) => ({ index, ...robot.sample(this.t_s + this.shifts[number]) }));
    this.app.feed.emit("frame", { t_s: this.t_s, rosAge_s: 0, samples });
    this.range.value = this.t_s;
    this.clock.textContent = `${this.t_s.toFixed(2)} / ${this.end_s.toFixed(1)} s`;
    if (whole || now - this.healthAt > HEALTH_MS) {
      this.healthAt = now;
      this.app.feed.emit("health", Object.fromEntries(this.robots.map(({ robot, number, index }) => [this.records[index].name, robot.health(this.t_s + this.shifts[number])])));
      this.plot();
    }
    this.cursor();
    this.showImages(now, whole);
  }

  get chosen() { return this.robots[this.app.selected?.index ?? 0]; }

  get plotKey() { return `${this.chosen.index} ${this.align}`; }

  // Curves of the whole recording, once for each robot that is chosen.
  plot() {
    const { chosen, plotKey } = this;
    if (this.plotted === plotKey) return;
    this.plotted = plotKey;
    const { plots } = this.app;
    plots.clear();
    const finite = (values) => values.map((value) => (Number.isFinite(value) ? value : null));
    const other = this.bags.length > 1 && partner(chosen.robot, this.bags[1 - chosen.number].robots);
    if (other) {
      const pair = chosen.number ? [other, chosen.robot] : [chosen.robot, other];
      const found = compare(...pair, this.shifts, Math.max(FRAME_S, (this.end_s - this.begin_s) / POINTS));
      plots.setData("A and B apart [m]", found.xs, [{ label: "apart", ys: found.apart }]);
      plots.setData(chosen.robot.record.error, found.xs, [{ label: "A", ys: finite(found.first) }, { label: "B", color: GHOSTS[0], ys: finite(found.second) }]);
      return;
    }
    const { robot, number } = chosen;
    const step = Math.max(1, Math.ceil(robot.count / POINTS));
    const rows = Array.from({ length: Math.ceil(robot.count / step) }, (_, i) => i * step);
    const xs = rows.map((row) => robot.value(row, "t") - this.shifts[number]);
    plots.setData(robot.record.error, xs, [{ label: "error", ys: finite(rows.map((row) => robot.value(row, "error"))) }]);
    plots.setData("latency [ms]", xs, [{ label: "latency", ys: finite(rows.map((row) => robot.value(row, "latency"))) }]);
  }

  // The line of each plot that shows the time.
  cursor() {
    for (const { plot } of this.app.plots.charts.values()) {
      if (plot.data[0]?.length) plot.setCursor({ left: plot.valToPos(this.t_s, "x"), top: 10 }, false);
    }
  }

  showImages(now, whole) {
    const box = document.getElementById("camera-image");
    const { robot, bag, number, index } = this.chosen;
    box.hidden = !robot.images.length;
    if (box.hidden || !box.open || this.fetching || (!whole && now - this.imageAt < IMAGE_MS)) return;
    this.imageAt = now;
    for (const kind of [0, 1]) {
      const path = robot.image(this.t_s + this.shifts[number], kind);
      if (!path || this.shown[kind] === `${index} ${path}`) continue;
      this.shown[kind] = `${index} ${path}`;
      this.fetching = true;
      fetch(`${bag.path}/${path}`)
        .then((answer) => (answer.ok ? answer.arrayBuffer() : null))
        .then((data) => data && this.app.feed.emit("image", { index, kind, data: new Uint8Array(data) }))
        .catch(() => {})
        .finally(() => (this.fetching = false));
    }
  }

  key(event) {
    if (/SELECT|TEXTAREA/.test(event.target.tagName) || event.ctrlKey || event.metaKey || event.altKey) return;
    const faster = (way) => {
      this.speed = SPEEDS[Math.min(Math.max(SPEEDS.indexOf(this.speed) + way, 0), SPEEDS.length - 1)];
      this.speeds.value = this.speed;
    };
    const jump = event.shiftKey ? 25 : 1;
    const keys = {
      " ": () => this.toggle(1), b: () => this.toggle(-1), ArrowLeft: () => this.step(-jump), ArrowRight: () => this.step(jump),
      Home: () => this.seek(this.begin_s), End: () => this.seek(this.end_s), "+": () => faster(1), "-": () => faster(-1),
    };
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  }
}
