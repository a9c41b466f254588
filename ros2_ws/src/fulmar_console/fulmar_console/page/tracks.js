// A bag in the page: fetched once, then asked for any time. No request is made while it plays.
const POSE = ["x", "y", "z", "qx", "qy", "qz", "qw"];
const WAIT_MS = 200;

// Fetch the document of a bag once the server has read it, and its columns; `tell` shows how far it is.
export async function fetchBag(path, tell) {
  for (;;) {
    const answer = await fetch(`${path}.json`);
    if (!answer.ok) throw new Error("the console's server does not have this bag any more");
    const document = await answer.json();
    if (document.ready) return new Bag(path, document, await (await fetch(`${path}.bin`)).arrayBuffer());
    tell(document);
    await new Promise((resolve) => setTimeout(resolve, WAIT_MS));
  }
}

// Index of the last entry that is not above a value; -1 where all are.
export function last(list, value, key = (each) => each) {
  let [low, high] = [0, list.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (key(list[middle]) <= value) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

export class Bag {
  constructor(path, document, buffer) {
    Object.assign(this, { path, name: document.name, seconds: document.seconds, hz: document.hz, marks: document.marks, notes: document.notes });
    const numbers = new Float32Array(buffer);
    this.robots = document.robots.map((record, i) => {
      const track = document.tracks[i];
      const { changes, targets } = document.health[i];
      const columns = Object.fromEntries(track.fields.map((name, column) => [name, column]));
      const table = numbers.subarray(track.offset, track.offset + track.count * track.fields.length);
      const images = document.images.filter((each) => each.index === i);
      return new RecordedRobot(record, { ...track, columns, table, changes, targets, images, hz: document.hz });
    });
  }

  // Time of the first goal; the begin where there is none [s].
  get firstGoal_s() { return this.marks.find((mark) => mark.kind === "goal")?.t_s ?? 0; }
}

class RecordedRobot {
  constructor(record, parts) {
    Object.assign(this, parts, { record, width: parts.fields.length });
    this.shares = parts.fields.flatMap((name, column) => (name.startsWith("share:") ? [column] : []));
    this.things = parts.fields.flatMap((name, column) => (name.endsWith(":x") ? [[name.slice(0, -2), column]] : []));
    this.begin_s = this.table[0];
    this.end_s = this.table[this.width * (this.count - 1)];
  }

  value(row, name) { return this.table[row * this.width + this.columns[name]]; }

  // Row at a time, and how far the time is towards the next one.
  place(t_s) {
    const at = Math.min(Math.max((t_s - this.begin_s) * this.hz, 0), this.count - 1);
    const row = Math.floor(at + 1e-4);
    return [row, row + 1 < this.count ? Math.max(0, at - row) : 0];
  }

  pose(t_s, first = this.columns.x) {
    const [row, share] = this.place(t_s);
    const from = row * this.width + first;
    const to = share ? from + this.width : from;
    const turn = POSE.slice(3).reduce((sum, _, i) => sum + this.table[from + 3 + i] * this.table[to + 3 + i], 0) < 0 ? -1 : 1;
    const mixed = POSE.map((_, i) => (1 - share) * this.table[from + i] + share * (i > 2 ? turn : 1) * this.table[to + i]);
    const norm = Math.hypot(...mixed.slice(3)) || 1;
    return mixed.map((each, i) => (i > 2 ? each / norm : each));
  }

  // As a live frame has it; what lies beyond the recording is old, and so drawn faint.
  sample(t_s) {
    const [row] = this.place(t_s);
    const beyond = Math.max(0, t_s - this.end_s, this.begin_s - t_s);
    const shares = beyond ? this.shares.map(() => 0) : this.shares.map((column) => this.table[row * this.width + column]);
    return { pose: this.pose(t_s), shares, age_s: this.value(row, "age") + beyond };
  }

  // As the live page gets it: the newest change, with what changes all the time.
  health(t_s) {
    const known = this.changes[last(this.changes, t_s, ([at]) => at)]?.[1] ?? { mode: "starting", level: "ok", words: "" };
    const [row] = this.place(t_s);
    const error = this.value(row, "error");
    const health = { ...known, sim_time_s: Math.max(0, t_s), latency_ms: this.value(row, "latency") };
    const things = this.things.map(([name, column]) => ({ name, pose: this.pose(t_s, column) }));
    if (things.length) health.things = things;
    if (!known.goal) return health;
    const distance = Number.isFinite(error) && this.record.error.startsWith("distance") ? { distance_m: error } : {};
    return { ...health, goal: { stamp_ns: "1", ...known.goal, ...distance, targets: this.targets[known.goal.targets] } };
  }

  // Newest image of a kind at a time: {path, key}, or null.
  image(t_s, kind) {
    const images = this.images.find((each) => each.kind === kind);
    const number = images ? last(images.t_s, t_s + 0.5 / this.hz) : -1;
    return number < 0 ? null : `image/${this.record.index}/${kind}/${number}`;
  }
}

// How two recordings of one robot differ on a common time line: rows of {t, apart, first, second}.
export function compare(first, second, shifts, step_s) {
  const begin = Math.max(first.begin_s - shifts[0], second.begin_s - shifts[1]);
  const end = Math.min(first.end_s - shifts[0], second.end_s - shifts[1]);
  const found = { xs: [], apart: [], first: [], second: [] };
  for (let t = begin; t <= end; t += step_s) {
    const [a, b] = [first.pose(t + shifts[0]), second.pose(t + shifts[1])];
    found.xs.push(t);
    found.apart.push(Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
    found.first.push(first.value(first.place(t + shifts[0])[0], "error"));
    found.second.push(second.value(second.place(t + shifts[1])[0], "error"));
  }
  return found;
}

// The robot of the other bag that a robot is compared with: of its name and type, else the only one of its type.
export function partner(robot, others) {
  const type = robot.record.info?.type;
  const alike = others.filter((each) => each.record.info?.type === type);
  return alike.find((each) => each.record.name === robot.record.name) || (alike.length === 1 ? alike[0] : null);
}
