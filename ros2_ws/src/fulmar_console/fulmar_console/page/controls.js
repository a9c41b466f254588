// The panels: list of robots, the chosen one with goal, controller, simulation and driving by hand, and what happened.
const $ = (id) => document.getElementById(id);
const EVENTS = 60;
const RAD = Math.PI / 180;
const AXES = { x: "x [m]", y: "y [m]", z: "z [m]", roll: "roll [°]", pitch: "pitch [°]", yaw: "heading [°]" };
const FIELDS = {
  pose: ["x", "y", "yaw"], point: ["x", "y"], path: ["x", "y", "yaw"], pose3: ["x", "y", "z", "roll", "pitch", "yaw"], point3: ["x", "y", "z"],
  attitude: ["roll", "pitch", "yaw"], flight: ["z", "yaw"], velocity: ["ahead", "left", "turn"],
  velocity3: ["ahead", "left", "up", "roll rate", "pitch rate", "turn"],
};
const SPEEDS = { ahead: "ahead [m/s]", left: "left [m/s]", up: "up [m/s]", turn: "turn [°/s]", "roll rate": "roll [°/s]", "pitch rate": "pitch [°/s]" };
const HINTS = {
  pose: "Drag the green disc to set the goal, its knob to turn it. Esc gives up the drag.", point: "Drag the green disc to set the goal.",
  path: "Drag the green disc to set the goal.", pose3: "Pull the arrows to move the goal; press r to turn it, g to move it.",
  point3: "Pull the arrows to move the goal.", attitude: "Pull the rings to turn the goal.", flight: "Pull the arrow up or down, or give height and heading.",
  velocity: "Give the velocity that the robot shall keep.", velocity3: "Give the velocity that the robot shall keep.",
};

export function quatOf(roll, pitch, yaw) {
  const [cr, sr, cp, sp, cy, sy] = [roll, pitch, yaw].flatMap((angle) => [Math.cos(angle / 2), Math.sin(angle / 2)]);
  return [sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy];
}

export function eulerOf([x, y, z, w]) {
  const pitch = Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - z * x))));
  return [Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), pitch, Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))];
}

export function element(tag, attributes = {}, ...children) {
  const made = Object.assign(document.createElement(tag), attributes);
  made.append(...children);
  return made;
}

export class Controls {
  constructor(app) {
    this.app = app;
    this.built = "";
    $("stopone").onclick = () => app.stopping.stop(this.name);
    $("reset").onclick = () => this.release();
    $("start").onclick = () => this.ask("start");
    $("end").onclick = () => this.ask("stop");
    $("step").onclick = () => this.ask("step");
    $("pause").onclick = () => this.ask("pause", { paused: !app.health.get(this.name)?.paused });
    $("giveback").onclick = () => this.ask("give_back");
    $("controller").onchange = (event) => this.ask("controller", { controller: event.target.value });
    $("camera-image").addEventListener("toggle", () => this.lookThrough());
    for (const button of document.querySelectorAll("#camera button")) button.onclick = () => app.scene?.look(button.dataset.look);
  }

  get name() { return this.app.selected?.name; }

  ask(what, fields = {}) {
    return this.app.feed.send({ do: what, robot: this.name, ...fields }).then((answer) => {
      if (answer.words) this.say(answer.words, answer.accepted ? "" : "refused");
      return answer;
    });
  }

  say(words, kind) { this.addEvent({ robot: this.name || "console", kind, words, t_s: this.app.health.get(this.name)?.sim_time_s }); }

  // A question only where something begins to move again; a stop has none.
  async release() {
    $("question").textContent = `Release ${this.name}? It stays where it is until it gets a new goal. ${this.app.health.get(this.name)?.words || ""}`;
    $("ask").show(); // not modal: the e-stop stays within reach
    $("ask").onclose = async () => {
      if ($("ask").returnValue !== "yes") return;
      const answer = await this.ask("reset");
      $("words").textContent = answer.words;
    };
  }

  showList() {
    const rows = [...this.app.robots.values()].map((record) => {
      const health = this.app.health.get(record.name) || {};
      const state = health.estop ? "stopped" : health.level === "silent" ? "silent" : health.paused ? "paused" : health.mode || "starting";
      const dot = element("i");
      dot.style.background = record.color;
      const button = element("button", { onclick: () => this.app.select(record.index) }, dot, record.name, element("small", { textContent: state }));
      button.setAttribute("aria-pressed", record.index === this.app.selected?.index);
      return element("li", { className: health.estop ? "estop" : health.level || "" }, button);
    });
    const key = rows.map((row) => row.textContent + row.className).join() + this.app.selected?.index;
    if (key !== this.listed) $("list").replaceChildren(...rows);
    this.listed = key;
  }

  addEvent({ robot, kind, words, t_s }) {
    const at = Number.isFinite(t_s) ? `${t_s.toFixed(1)} s  ` : "";
    $("events").prepend(element("li", { className: kind, textContent: `${at}${robot}: ${words || kind}` }));
    while ($("events").children.length > EVENTS) $("events").lastChild.remove();
  }

  // What only changes with the robot; everything else is in `show`.
  build(record) {
    const info = record?.info;
    $("chosen").hidden = !record;
    const key = record && JSON.stringify([record.index, info?.started_ns, info?.task, info?.controllers, info?.controller]);
    if (!record || key === this.built) return;
    this.built = key;
    $("title").textContent = record.name;
    $("title").title = info?.title || "";
    $("stops").textContent = info?.stops ? `When it is stopped, ${info.stops}.` : "";
    $("controller").replaceChildren(...(info?.controllers || []).map((each) => new Option(each.name, each.name, false, each.name === info.controller)));
    $("controller").disabled = !info?.controllers?.length;
    $("camera-image").hidden = !info?.camera;
    $("simulation").hidden = !Object.keys(info?.disturbances || {}).length;
    for (const id of ["pause", "step"]) $(id).hidden = !info?.simulated;
    this.buildGoal(info);
    this.buildDisturbances(info?.disturbances || {});
    this.app.driving.build(info?.teleop?.axes || []);
  }

  buildGoal(info) {
    const form = info?.goal?.form || "";
    const names = FIELDS[form] || [];
    this.inputs = names.map((name) => [name, element("input", { type: "number", step: "any", value: "0", name })]);
    const rows = this.inputs.map(([name, input]) => element("label", { textContent: AXES[name] || SPEEDS[name] }, input));
    const send = element("button", { textContent: "Send goal", onclick: () => this.sendTyped(form) });
    const typed = element("details", { open: form.startsWith("velocity") }, element("summary", { textContent: "By numbers" }), ...rows, send);
    $("goal").replaceChildren(element("p", { className: "hint", textContent: HINTS[form] || "" }), ...(names.length ? [typed] : []));
  }

  // The numbers follow the handle while it is dragged, and the goal otherwise.
  fill(target) {
    const [roll, pitch, yaw] = eulerOf(target.slice(3)).map((angle) => angle / RAD);
    const values = { x: target[0], y: target[1], z: target[2], roll, pitch, yaw };
    for (const [name, input] of this.inputs || []) {
      if (name in values && document.activeElement !== input) input.value = values[name].toFixed(2);
    }
  }

  sendTyped(form) {
    const values = Object.fromEntries(this.inputs.map(([name, input]) => [name, Number(input.value)]));
    if (form.startsWith("velocity")) {
      const { ahead = 0, left = 0, up = 0, turn = 0 } = values;
      const twist = [ahead, left, up, (values["roll rate"] || 0) * RAD, (values["pitch rate"] || 0) * RAD, turn * RAD];
      return this.app.sendGoal(this.app.selected, null, twist);
    }
    const at = this.app.handle?.target || [0, 0, 0, 0, 0, 0, 1];
    const [roll, pitch, yaw] = eulerOf(at.slice(3));
    const angle = (name, before) => (name in values ? values[name] * RAD : before);
    const place = ["x", "y", "z"].map((name, i) => values[name] ?? at[i]);
    return this.app.sendGoal(this.app.selected, [...place, ...quatOf(angle("roll", roll), angle("pitch", pitch), angle("yaw", yaw))]);
  }

  buildDisturbances(choices) {
    const sets = Object.entries(choices).map(([what, { words, fields }]) => {
      const inputs = Object.entries(fields).map(([key, field]) => [key, field, inputOf(field)]);
      const rows = inputs.map(([key, field, input]) => element("label", { textContent: `${key.replaceAll("_", " ")}${field.unit && !key.includes("_") ? ` [${field.unit}]` : ""}`, title: field.words || "" }, input));
      const go = element("button", { textContent: what === "clear" ? "End all disturbances" : `${what.replaceAll("_", " ")}: ${words}` });
      go.onclick = () => this.ask("disturb", { what: { what, ...Object.fromEntries(inputs.map(([key, field, input]) => [key, valueOf(field, input)])) } });
      return element("fieldset", {}, ...rows, go);
    });
    const rate = element("select", { onchange: (event) => this.ask("rate", { rate: Number(event.target.value) }) });
    for (const each of [1, 0.5, 0.25, 0.1]) rate.add(new Option(`${each} ×`, each));
    $("disturb").replaceChildren(element("label", { textContent: "Speed of the simulation" }, rate), ...sets);
  }

  show() {
    this.showList();
    const health = this.app.health.get(this.name);
    if (!health) return;
    const { controller = {}, goal = {}, level, paused } = health;
    const silent = controller.level === "silent" ? "The controller is silent. " : "";
    const reason = health.level === "ok" && controller.words && controller.words !== controller.mode ? controller.words : "";
    $("words").textContent = health.estop ? stopWords(health) : silent + [health.words, reason].filter(Boolean).join(". ");
    $("words").className = silent ? "error" : level;
    $("reset").disabled = !health.estop;
    $("pause").textContent = paused ? "Go on" : "Pause";
    $("step").disabled = !paused;
    $("start").disabled = health.plant_mode === "running";
    $("end").disabled = health.plant_mode !== "running";
    $("giveback").hidden = health.commanded_by !== "person";
    if (controller.name && document.activeElement !== $("controller")) $("controller").value = controller.name;
    const more = [controller.fell_back && `fell back: ${controller.fell_back}`, controller.swap, controller.believed, health.failed_parts && `failed: ${health.failed_parts}`, health.disturbances && `disturbed: ${health.disturbances}`];
    $("believed").textContent = more.filter(Boolean).join(" · ");
    $("goalwords").textContent = health.estop ? "Release it first; then set a goal." : goalWords(goal);
  }

  lookThrough() {
    const open = $("camera-image").open && !$("camera-image").hidden;
    if (this.name) this.app.feed.send({ do: "look", robot: this.name, camera: open ? ["rgb", "depth"] : "" });
  }

  showImage({ index, kind, data }) {
    if (index !== this.app.selected?.index || kind > 1) return;
    const image = $(kind ? "depth" : "image");
    URL.revokeObjectURL(image.src);
    image.src = URL.createObjectURL(new Blob([data]));
  }
}

function stopWords({ words, estop_by: by }) {
  const said = words.replace(" Reset it: fulmar estop --reset", "");
  return `Stopped by the e-stop${by ? `, pressed by ${by.replace(/^\//, "")}` : ""}. ${said.replace(/^e-stop: pressed\.:? ?/, "")}`;
}

function goalWords(goal) {
  if (goal.refused && goal.refused_stamp_ns >= goal.stamp_ns) return `Goal refused: ${goal.refused}`;
  if (!goal.stamp_ns || goal.stamp_ns === "0") return "No goal yet.";
  const by = goal.by ? `, set by ${goal.by.replace(/^\//, "")}` : "";
  if (goal.at_goal) return `At the goal${by}.`;
  return goal.distance_m === undefined ? `On its way${by}.` : `${goal.distance_m.toFixed(2)} m from the goal${by}.`;
}

function inputOf(field) {
  if (field.kind === "choice") {
    const select = element("select");
    for (const each of field.choices) select.add(new Option(each, each));
    return select;
  }
  if (field.kind === "vector") return element("input", { type: "text", value: field.default.join(", ") });
  return element("input", { type: "number", step: "any", min: field.low, max: field.high, value: field.default });
}

function valueOf(field, input) {
  if (field.kind === "choice") return input.value;
  return field.kind === "vector" ? input.value.split(",").map(Number) : Number(input.value);
}
