// Goals, limits and obstacles in the view, and the handles by which a person sets a goal.
import { AT_ORIGIN, posed } from "./look.js";
import * as THREE from "./vendor.js";
const GREEN = "#59d185";
const ROUND = 64;
const PLANE_FORMS = new Set(["pose", "point", "path"]);

function circle(radius, axes = "xy") {
  const points = [];
  for (let i = 0; i <= ROUND; i++) {
    const a = (2 * Math.PI * i) / ROUND;
    const [c, s] = [radius * Math.cos(a), radius * Math.sin(a)];
    points.push(axes === "xy" ? new THREE.Vector3(c, s, 0) : axes === "xz" ? new THREE.Vector3(c, 0, s) : new THREE.Vector3(0, c, s));
  }
  return new THREE.BufferGeometry().setFromPoints(points);
}

function lineOf(points, color) {
  const geometry = new THREE.BufferGeometry().setFromPoints(points.map((each) => new THREE.Vector3(...each)));
  return new THREE.Line(geometry, new THREE.LineBasicMaterial({ color }));
}

// The goal that the controller follows, what is allowed around it, and what is in the way, of one robot.
export function extrasOf(record, health, dragged) {
  const group = new THREE.Group();
  const info = record.info || {};
  const radius = info.radius || 0.3;
  const goal = health?.goal;
  const targets = goal?.targets?.filter((each) => each.length === 7) || [];
  const current = targets[(goal?.done || 0) % targets.length];
  if (current && !dragged) group.add(marker(current, info, record.color));
  if (targets.length > 1) group.add(lineOf([...targets, targets[0]].map((each) => each.slice(0, 3)), "#6ea8ff"));
  if (current && info.geofence && info.geofence < 500) {
    const fence = new THREE.LineLoop(circle(info.geofence), new THREE.LineBasicMaterial({ color: "#c95757", transparent: true, opacity: 0.6 }));
    fence.position.set(...current.slice(0, 3));
    group.add(fence);
  }
  const own = posed(new THREE.Group(), info.origin || AT_ORIGIN); // of its `odom`; goals are in `map`
  group.add(own);
  if (info.area?.length >= 4) {
    const [x0, x1, y0, y1] = info.area;
    const z = info.area[4] ?? 0;
    own.add(lineOf([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z], [x0, y0, z]], "#f0a54a"));
  }
  for (const [x, y, r] of health?.obstacles || []) {
    const geometry = new THREE.CylinderGeometry(r, r, 0.5, 32).rotateX(Math.PI / 2);
    const mesh = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color: "#a9503f" }));
    mesh.position.set(x, y, 0);
    own.add(mesh);
  }
  for (const { pose } of health?.things || []) {
    const mesh = new THREE.Mesh(new THREE.BoxGeometry(1.2 * radius, 1.2 * radius, 0.25), new THREE.MeshStandardMaterial({ color: "#b58a4c" }));
    own.add(posed(mesh, pose));
  }
  return group;
}

// A disc or a ball as wide as the tolerance, with an arrow or three axes.
function marker(target, info, color) {
  const group = posed(new THREE.Group(), target);
  const inSpace = info.goal?.reach === "3d";
  const wide = Math.max(info.tolerance?.position_m || 0, 0.25 * (info.radius || 0.3));
  const geometry = inSpace ? new THREE.SphereGeometry(wide, 20, 14) : new THREE.CylinderGeometry(wide, wide, 0.01, 40).rotateX(Math.PI / 2);
  group.add(new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: GREEN, transparent: true, opacity: 0.35, depthWrite: false })));
  const ring = new THREE.LineLoop(circle(Math.max(wide, info.radius || 0.3)), new THREE.LineBasicMaterial({ color }));
  group.add(ring);
  const long = 1.6 * (info.radius || 0.3);
  if (info.goal?.faces && inSpace) group.add(new THREE.AxesHelper(long));
  else if (info.goal?.faces) group.add(new THREE.ArrowHelper(new THREE.Vector3(1, 0, 0), new THREE.Vector3(), long, GREEN, 0.35 * long, 0.2 * long));
  return group;
}

// The handle of the selected robot. On a plane it is dragged over the ground and turned by its knob; in space, and for
// attitudes and flight, arrows and rings do it. A goal is sent at release; Escape gives up.
export class GoalHandle {
  constructor(scene, send) {
    this.scene = scene;
    this.send = send;
    this.dragging = this.scene.holds = false;
    this.group = new THREE.Group();
    this.group.visible = false;
    scene.scene.add(this.group);
    this.controls = new THREE.TransformControls(scene.camera, scene.canvas);
    this.controls.setSize(0.8);
    this.controls.addEventListener("change", () => scene.redraw());
    this.controls.addEventListener("dragging-changed", ({ value }) => this.dragged(value));
    scene.scene.add(this.controls.getHelper());
    const { canvas } = scene;
    canvas.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
    addEventListener("pointermove", (event) => this.pull(event));
    addEventListener("pointerup", () => this.release());
  }

  get planar() { return PLANE_FORMS.has(this.form); }

  // Put the handle where the robot's goal is, or the robot itself.
  attach(record, target) {
    this.record = record;
    this.form = record?.info?.goal?.form || "";
    const movable = record && this.form && !this.form.startsWith("velocity");
    if (this.dragging) return;
    this.group.clear();
    this.group.visible = Boolean(movable);
    this.controls.detach();
    if (!movable) return this.scene.redraw();
    this.place(target);
    if (this.planar) this.addFlat();
    else {
      this.group.add(new THREE.AxesHelper(1.5 * (record.info.radius || 0.3)));
      this.controls.attach(this.group);
      this.setMode(this.form === "attitude" ? "rotate" : "translate");
    }
    this.scene.redraw();
  }

  addFlat() {
    const { radius, goal } = this.record.info;
    const shape = new THREE.CylinderGeometry(radius, radius, 0.03, 40).rotateX(Math.PI / 2);
    const disc = new THREE.Mesh(shape, new THREE.MeshBasicMaterial({ color: GREEN, transparent: true, opacity: 0.45, depthTest: false }));
    disc.renderOrder = 5;
    this.group.add(disc);
    this.knob = null;
    if (!goal.faces) return;
    const long = 1.9 * radius;
    const arrow = new THREE.ArrowHelper(new THREE.Vector3(1, 0, 0), new THREE.Vector3(), long, GREEN, 0.5 * radius, 0.35 * radius);
    this.knob = new THREE.Mesh(new THREE.SphereGeometry(0.32 * radius, 16, 12), new THREE.MeshBasicMaterial({ color: GREEN, depthTest: false }));
    this.knob.position.x = long;
    this.knob.renderOrder = 6;
    this.group.add(arrow, this.knob);
  }

  place(target) { posed(this.group, target); }

  // What flies on for ever takes the handle of its height along.
  flyAlong(at) {
    if (this.form === "flight" && at && !this.dragging) this.group.position.set(at.x, at.y, this.group.position.z);
  }

  setMode(mode) {
    this.controls.setMode(mode);
    this.controls.setSpace(mode === "rotate" ? "local" : "world");
    const flight = this.form === "flight";
    this.controls.showX = this.controls.showY = !flight || mode === "translate" ? !flight : false;
    this.controls.showZ = true;
  }

  press(event) {
    if (!this.group.visible || !this.planar || event.button) return;
    const ray = this.scene.ray(event.clientX, event.clientY);
    const hit = ray.intersectObject(this.group, true)[0];
    if (!hit) return;
    event.stopPropagation();
    this.scene.orbit.enabled = false;
    this.turning = hit.object === this.knob;
    this.begin();
  }

  begin() {
    this.dragging = this.scene.holds = true;
    this.before = [this.group.position.clone(), this.group.quaternion.clone()];
  }

  pull(event) {
    if (!this.dragging || !this.planar) return;
    const ground = new THREE.Plane(new THREE.Vector3(0, 0, 1), -this.group.position.z);
    const at = this.scene.ray(event.clientX, event.clientY).ray.intersectPlane(ground, new THREE.Vector3());
    if (!at) return;
    if (this.turning) {
      const heading = Math.atan2(at.y - this.group.position.y, at.x - this.group.position.x);
      this.group.quaternion.setFromAxisAngle(new THREE.Vector3(0, 0, 1), heading);
    } else this.group.position.copy(at);
    this.scene.redraw();
  }

  release() {
    if (!this.dragging || !this.planar) return;
    this.scene.orbit.enabled = true;
    this.dragging = this.scene.holds = false;
    this.submit();
  }

  // Of the arrows and rings.
  dragged(begins) {
    this.scene.orbit.enabled = !begins;
    if (begins) this.begin();
    else if (this.dragging) {
      this.dragging = this.scene.holds = false;
      this.submit();
    }
  }

  giveUp() {
    if (!this.dragging) return false;
    this.dragging = this.scene.holds = false;
    this.scene.orbit.enabled = true;
    this.group.position.copy(this.before[0]);
    this.group.quaternion.copy(this.before[1]);
    this.controls.reset?.();
    this.scene.redraw();
    return true;
  }

  get target() {
    const { position, quaternion } = this.group;
    return [...position.toArray(), ...quaternion.toArray()];
  }

  submit() { this.send(this.record, this.target); }
}
