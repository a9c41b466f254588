// Start of the page: choose the feed, keep what is known of each robot, and hand it to view, panels and plots.
import { Controls } from "./controls.js";
import { Driving } from "./driving.js";
import { extrasOf, GoalHandle } from "./goal.js";
import { Plots } from "./plots.js";
import { Scene } from "./scene.js";
import { Stopping } from "./stopping.js";
import { LiveFeed } from "./wire.js";
const $ = (id) => document.getElementById(id);
const SILENT_S = 1;
const scheme = location.protocol === "https:" ? "wss" : "ws";
const feed = new LiveFeed(`${scheme}://${location.host}/socket`);
const version = document.querySelector("meta[name=version]").content;
// What the other modules share; bags emit on `feed` as the live server does, with indices of their own across bags.
const app = { feed, scene: null, handle: null, robots: new Map(), health: new Map(), selected: null, stale: "", silent: [], ages: new Map(), frames: 0 };

app.driving = new Driving(app);
app.controls = new Controls(app);
app.plots = new Plots($("charts"));
app.stopping = new Stopping(app, { button: $("estop"), state: $("stopstate") });
try {
  app.scene = new Scene($("canvas"), $("labels"), { plain: location.search.includes("plain") });
  app.handle = new GoalHandle(app.scene, (record, target) => app.sendGoal(record, target));
  app.scene.listeners.push(() => app.handle.flyAlong(app.scene.positionOf(app.selected?.index)));
  app.scene.listeners.push(() => app.handle.dragging && app.controls.fill(app.handle.target));
} catch (error) {
  app.lasting = notice(`This browser draws no 3-D (WebGL is off: ${error.message}). Stopping, goals by numbers and plots work all the same.`);
}

function notice(words, button) {
  $("notice").textContent = words;
  if (button) $("notice").append(" ", button);
  $("notice").hidden = !words;
  return words;
}

app.select = (index) => {
  app.selected = app.robots.get(index) || null;
  if (app.scene) app.scene.selected = index;
  app.plots.clear();
  app.controls.build(app.selected);
  app.controls.lookThrough();
  app.placed = "";
  placeHandle();
  app.scene?.look(app.scene.mode === "top" ? "top" : "follow");
  refresh();
};

app.sendGoal = async (record, target, velocity) => {
  const answer = await app.controls.ask("goal", velocity ? { velocity } : { targets: [target] });
  $("goalwords").textContent = answer.accepted ? "The controller follows it." : `Goal refused: ${answer.words}`;
  if (!answer.accepted) placeHandle(true);
};

// The handle goes where the goal is, once a robot is chosen and whenever another goal counts; never while it is dragged.
function placeHandle(again = false) {
  if (!app.handle || app.handle.dragging) return;
  const record = app.selected;
  const goal = app.health.get(record?.name)?.goal;
  const target = goal?.targets?.[(goal.done || 0) % goal.targets.length];
  const at = app.scene.positionOf(record?.index);
  const placed = JSON.stringify([record?.index, record?.info?.goal?.form, target || Boolean(at && app.scene.robots.get(record.index).placed)]);
  if (placed === app.placed && !again) return;
  app.placed = placed;
  const here = at ? [...at.toArray(), ...app.scene.robots.get(record.index).body.group.quaternion.toArray()] : [0, 0, 0, 0, 0, 0, 1];
  const shown = target?.length === 7 ? target : here;
  app.handle.attach(controlled() ? record : null, shown);
  app.controls.fill(shown);
}
function controlled() { return feed.mode === "live" && app.allowed !== false; }
function refresh() {
  app.controls.show();
  app.stopping.show();
  if (!app.scene) return;
  const handled = controlled() && app.handle.group.visible && app.handle.planar;
  if (app.selected) app.scene.setExtras(extrasOf(app.selected, app.health.get(app.selected.name), handled));
  placeHandle();
}
function plot(frame) {
  const { selected } = app;
  const health = app.health.get(selected?.name);
  const sample = frame.samples.find((each) => each.index === selected?.index);
  if (!health || !sample) return;
  app.zero ??= frame.t_s;
  const t_s = frame.t_s - app.zero;
  if (health.goal?.distance_m !== undefined) app.plots.add("distance to the goal [m]", t_s, ["distance"], [health.goal.distance_m]);
  const names = (selected.info?.actuators || []).map((each) => each.name);
  if (names.length) app.plots.add("actuators [share]", t_s, names, sample.shares);
  if (health.latency_ms !== undefined) app.plots.add("latency p99 [ms]", t_s, ["latency"], [health.latency_ms]);
}

feed.on("hello", async (hello) => {
  app.allowed = hello.controls;
  feed.mode = hello.mode;
  document.body.classList.toggle("bags", hello.mode === "bags");
  if (hello.version !== version) {
    const reload = Object.assign(document.createElement("button"), { textContent: "Reload", onclick: () => location.reload() });
    notice("This page is of another version than the console that serves it.", reload);
  } else if (!hello.controls) notice("Without the token this page can only stop robots.");
  if (hello.mode !== "bags" || app.timeline) return;
  $("stopping").hidden = true;
  const { openBags } = await import("./timeline.js");
  app.timeline = await openBags(app, hello, $("timeline"));
});

feed.on("robots", (records) => {
  const before = app.robots.size;
  app.robots = new Map(records.map((record) => [record.index, record]));
  const names = new Set(records.map(({ name }) => name));
  for (const name of app.health.keys()) if (!names.has(name)) app.health.delete(name);
  app.scene?.setRobots(records);
  if (app.selected) app.selected = app.robots.get(app.selected.index) || null;
  app.controls.build(app.selected);
  if (!app.selected && records.length) app.select(records[0].index);
  if (!before && records.length > 1) app.scene?.look("fit");
  refresh();
});

feed.on("health", (health) => {
  for (const [name, each] of Object.entries(health)) app.health.set(name, each);
  refresh();
});

feed.on("frame", (frame) => {
  app.frames += 1;
  app.rosAge_s = frame.rosAge_s;
  for (const { index, age_s } of frame.samples) app.ages.set(index, age_s);
  app.scene?.see(frame);
  if (app.frames % 5 === 0 && feed.mode === "live") plot(frame);
  if (app.frames === 2 && app.scene) app.scene.look(app.robots.size > 1 ? "fit" : "follow");
});

for (const [kind, take] of [["event", "addEvent"], ["image", "showImage"]]) feed.on(kind, (each) => app.controls[take](each));
feed.on("bye", ({ words }) => notice(words));
feed.on("link", ({ open }) => open && !$("notice").querySelector("button") && notice(app.lasting || ""));

// Old data must not look alive: server, ROS side and robots are each watched.
function staleness() {
  if (feed.mode !== "live") return "";
  if (!feed.open) return "The console's server does not answer";
  if (feed.silence_s > SILENT_S) return "The console's server is silent";
  if (app.rosAge_s > SILENT_S) return "The console's ROS side is silent";
  app.silent = [...app.robots.values()].filter(isSilent).map(({ name }) => name);
  return app.silent.length && app.silent.length === app.robots.size ? `${app.silent.join(", ")}: silent` : "";
}

// A robot that is paused or has not begun says nothing either, and may.
function isSilent({ index, name }) {
  const { paused, plant_mode: mode, level } = app.health.get(name) || {};
  return level === "silent" || (mode === "running" && !paused && app.ages.get(index) > SILENT_S);
}

setInterval(() => {
  app.stale = staleness();
  document.body.classList.toggle("stale", Boolean(app.stale));
}, 100);

addEventListener("keydown", (event) => {
  if (event.key === "Escape") {
    event.preventDefault();
    $("ask").close("no");
    if (!app.handle?.giveUp() && feed.mode === "live") app.stopping.stop("*");
  }
  if (/INPUT|SELECT|TEXTAREA/.test(event.target.tagName) || $("drive").open) return;
  const looks = { f: "follow", a: "fit", t: "top" };
  if (looks[event.key]) app.scene?.look(looks[event.key]);
  if (event.key === "r" && !["flight"].includes(app.handle?.form)) app.handle?.setMode("rotate");
  if (event.key === "g" && app.handle?.form !== "attitude") app.handle?.setMode("translate");
});

let pressed = null;
$("canvas").onpointerdown = (event) => (pressed = [event.clientX, event.clientY]);
$("canvas").addEventListener("pointerup", (event) => {
  const still = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 4;
  const index = still && app.scene ? app.scene.robotAt(event.clientX, event.clientY) : -1;
  if (index >= 0) app.select(index);
});
for (const panel of document.querySelectorAll("#robots > details, #chosen > details")) panel.open = innerWidth > 900;

window.fulmar = app; // for tests, which wait for counters and aim by `app.scene.screen`
