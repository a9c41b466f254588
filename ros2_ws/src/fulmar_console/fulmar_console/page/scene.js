// The 3-D view: robots with trails and labels, goals, limits, obstacles, and the camera. Drawn only when something changed.
import { AT_ORIGIN, Body, posed, structure } from "./look.js";
import * as THREE from "./vendor.js";
const TRAIL = 900; // points of one trail
const TRAIL_S = 0.1; // between two of them at least
const SLOW_MS = 40; // a frame that takes longer costs shadows first, then sharpness
const SILENT_S = 1;
THREE.Object3D.DEFAULT_UP.set(0, 0, 1);

export class Scene {
  constructor(canvas, labels, { plain = false } = {}) {
    this.canvas = canvas;
    this.labels = labels;
    this.robots = new Map(); // by index
    this.draws = 0;
    this.mode = "follow";
    this.selected = -1;
    this.listeners = [];
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !plain, powerPreference: "low-power" });
    this.renderer.shadowMap.enabled = !plain;
    this.sharpness = plain ? 1 : Math.min(devicePixelRatio, 2);
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color("#0d1319");
    this.scene.fog = new THREE.Fog("#0d1319", 60, 400);
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.05, 3000);
    this.camera.position.set(-4, -5, 3.5);
    this.orbit = new THREE.OrbitControls(this.camera, canvas);
    this.orbit.addEventListener("change", () => this.redraw());
    this.addLight(plain);
    this.extras = new THREE.Group(); // goals and limits
    this.scene.add(this.extras);
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }

  addLight(plain) {
    this.scene.add(new THREE.HemisphereLight("#dbe9ff", "#2b2f38", 1.6));
    const sun = new THREE.DirectionalLight("#ffffff", 2.2);
    sun.position.set(-6, -4, 12);
    sun.castShadow = !plain;
    sun.shadow.mapSize.set(1024, 1024);
    Object.assign(sun.shadow.camera, { left: -8, right: 8, top: 8, bottom: -8, far: 60 });
    this.sun = sun;
    this.scene.add(sun, sun.target);
  }

  // The ground by where robots move: floor, water, far grid of aircraft, or stars.
  setGround(spaces) {
    const key = [...spaces].sort().join();
    if (key === this.groundKey) return;
    this.groundKey = key;
    if (this.ground) this.scene.remove(this.ground);
    this.ground = new THREE.Group();
    const flat = ["plane", "water", "flight"].some((each) => spaces.has(each));
    if (!flat) this.ground.add(stars());
    if (flat) this.ground.add(floor(spaces.has("water") || spaces.has("flight") ? "#0f3047" : "#1a222b"));
    if (spaces.has("flight")) this.ground.add(grid(2000, 100, "#2d6080", "#1d4258"));
    else if (spaces.has("water")) this.ground.add(grid(40, 40, "#4d87a8", "#2c5d7c"));
    else this.ground.add(grid(40, 40, flat ? "#41505f" : "#26323f", flat ? "#2a3642" : "#19222b"));
    this.scene.add(this.ground);
    this.redraw();
  }

  setRobots(records) {
    const seen = new Set();
    for (const record of records) {
      seen.add(record.index);
      const known = this.robots.get(record.index);
      const key = JSON.stringify([record.name, record.color, record.info?.started_ns, record.info?.look?.length]);
      if (known?.key !== key) this.addRobot(record, key);
      else known.record = record;
    }
    for (const index of this.robots.keys()) if (!seen.has(index)) this.removeRobot(index);
    this.setGround(new Set(records.map((each) => each.info?.space || "plane")));
    this.redraw();
  }

  addRobot(record, key) {
    const before = this.robots.get(record.index);
    if (before) this.removeRobot(record.index);
    const body = new Body(record);
    if (record.ghost) body.fade(0.35);
    const label = document.createElement("span");
    label.textContent = record.name;
    label.style.borderColor = record.color;
    this.labels.append(label);
    const trail = new Trail(record.color);
    const things = posed(new THREE.Group(), record.info?.origin || AT_ORIGIN);
    for (const each of record.info?.structures || []) things.add(structure(each));
    this.scene.add(body.group, trail.line, things);
    this.robots.set(record.index, { key, record, body, label, trail, things, shares: [], age_s: Infinity, placed: false });
  }

  removeRobot(index) {
    const { body, label, trail, things } = this.robots.get(index);
    body.dispose();
    this.scene.remove(body.group, trail.line, things);
    label.remove();
    this.robots.delete(index);
  }

  // One frame of samples, all drawn together.
  see(frame) {
    for (const { index, pose, shares, age_s } of frame.samples) {
      const robot = this.robots.get(index);
      if (!robot) continue;
      robot.shares = shares;
      robot.age_s = age_s;
      if (!Number.isFinite(age_s)) continue;
      robot.placed = true;
      posed(robot.body.group, pose);
      robot.trail.add(robot.body.group.position, frame.t_s, robot.record.info?.radius || 0.3);
    }
    this.redraw();
  }

  clearTrails() { for (const { trail } of this.robots.values()) trail.clear(); }

  // Shapes beside the robots, built by goal.js; replaced as a whole.
  setExtras(group) {
    this.scene.remove(this.extras);
    this.extras.traverse((each) => {
      each.geometry?.dispose();
      each.material?.dispose?.();
    });
    this.extras = group;
    this.scene.add(group);
    this.redraw();
  }

  positionOf(index) { return this.robots.get(index)?.body.group.position; }

  // Where a point of the world is on the page [px]; for labels, and for tests that drag.
  screen(point) {
    const seen = new THREE.Vector3(...point).project(this.camera);
    const box = this.canvas.getBoundingClientRect();
    return { x: box.left + ((seen.x + 1) / 2) * box.width, y: box.top + ((1 - seen.y) / 2) * box.height, behind: seen.z > 1 };
  }

  ray(x, y) {
    const box = this.canvas.getBoundingClientRect();
    const at = new THREE.Vector2(((x - box.left) / box.width) * 2 - 1, 1 - ((y - box.top) / box.height) * 2);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, this.camera);
    return ray;
  }

  robotAt(x, y) {
    const ray = this.ray(x, y);
    const groups = [...this.robots.values()].map(({ body }) => body.group);
    const hit = ray.intersectObjects(groups, true)[0]?.object;
    for (const [index, { body }] of this.robots) {
      let node = hit;
      while (node && node !== body.group) node = node.parent;
      if (node) return index;
    }
    return -1;
  }

  look(mode) {
    this.mode = mode;
    const points = [...this.robots.values()].filter(({ placed }) => placed).map(({ body }) => body.group.position);
    const box = new THREE.Box3().setFromPoints(points.length ? points : [new THREE.Vector3()]);
    const middle = mode === "follow" ? this.positionOf(this.selected) || box.getCenter(new THREE.Vector3()) : box.getCenter(new THREE.Vector3());
    const radius = this.robots.get(this.selected)?.record.info?.radius || 0.5;
    const far = mode === "follow" ? Math.max(2.5, 7 * radius) : Math.max(3.5, 1.2 * box.getSize(new THREE.Vector3()).length());
    this.orbit.target.copy(middle);
    const narrow = Math.max(1, 1 / this.camera.aspect); // a telephone sees less to the sides than up and down
    const way = mode === "top" ? new THREE.Vector3(0, -0.001, 1) : new THREE.Vector3(-0.62, -0.62, 0.48);
    this.camera.position.copy(middle).addScaledVector(way.normalize(), narrow * (mode === "top" ? 1.3 * far : far));
    this.last = middle.clone();
    this.orbit.update();
    this.redraw();
  }

  followRobot() {
    const at = this.positionOf(this.selected);
    if (this.mode !== "follow" || !at || this.holds) return; // a drag has the camera stand
    const moved = at.clone().sub(this.last || at);
    this.camera.position.add(moved);
    this.orbit.target.add(moved);
    this.last = at.clone();
    this.orbit.update();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (!width || !height) return;
    this.renderer.setPixelRatio(this.sharpness);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.redraw();
  }

  redraw() {
    if (this.waits) return;
    this.waits = true;
    requestAnimationFrame((now) => this.draw(now));
  }

  draw(now) {
    this.waits = false;
    const began = performance.now();
    const dt = Math.min(0.1, (now - (this.drawn_ms || now)) / 1000);
    this.drawn_ms = now;
    for (const { body, shares, age_s, record } of this.robots.values()) {
      body.move(shares, dt);
      const silent = age_s > SILENT_S;
      if (silent !== body.silent && !record.ghost) body.fade((body.silent = silent) ? 0.45 : 1);
    }
    this.followRobot();
    const { target } = this.orbit;
    this.sun.target.position.copy(target);
    this.sun.position.copy(target).add(new THREE.Vector3(-6, -4, 12));
    if (this.groundKey?.includes("flight")) this.ground.position.set(20 * Math.round(target.x / 20), 20 * Math.round(target.y / 20), 0);
    for (const listener of this.listeners) listener();
    this.renderer.render(this.scene, this.camera);
    this.placeLabels();
    this.draws += 1;
    this.adapt(performance.now() - began);
  }

  adapt(took_ms) {
    this.cost_ms = 0.9 * (this.cost_ms || 0) + 0.1 * took_ms;
    if (this.draws < 30 || this.cost_ms < SLOW_MS) return;
    if (this.renderer.shadowMap.enabled) {
      this.renderer.shadowMap.enabled = this.sun.castShadow = false;
      this.scene.traverse((each) => each.material && (each.material.needsUpdate = true));
    } else if (this.sharpness > 1) {
      this.sharpness = 1;
      this.resize();
    }
    this.cost_ms = 0;
  }

  placeLabels() {
    const frame = this.canvas.getBoundingClientRect();
    for (const { body, label, record, placed } of this.robots.values()) {
      const { x, y, z } = body.group.position;
      const at = this.screen([x, y, z + 1.1 * (record.info?.radius || 0.3)]);
      label.hidden = at.behind || !placed;
      label.style.transform = `translate(${at.x - frame.left}px, ${at.y - frame.top}px) translate(-50%, -130%)`;
      label.classList.toggle("chosen", record.index === this.selected);
    }
  }
}

class Trail {
  constructor(color) {
    this.points = new Float32Array(3 * TRAIL);
    const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(this.points, 3));
    this.line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ color, transparent: true, opacity: 0.8 }));
    this.line.frustumCulled = false;
    this.clear();
  }

  clear() {
    this.count = 0;
    this.t_s = -Infinity;
    this.line.geometry.setDrawRange(0, 0);
  }

  // By time and distance, so that a slow robot and a fast one both leave one that can be seen.
  add(at, t_s, radius) {
    const i = 3 * (this.count - 1);
    const far = this.count ? Math.hypot(at.x - this.points[i], at.y - this.points[i + 1], at.z - this.points[i + 2]) : Infinity;
    if (t_s < this.t_s) this.clear();
    if (t_s - this.t_s < TRAIL_S || far < 0.1 * radius) return;
    if (this.count === TRAIL) {
      this.points.copyWithin(0, 3 * (TRAIL / 3)); // the oldest third goes
      this.count -= TRAIL / 3;
    }
    this.points.set([at.x, at.y, at.z], 3 * this.count++);
    this.t_s = t_s;
    this.line.geometry.setDrawRange(0, this.count);
    this.line.geometry.attributes.position.needsUpdate = true;
  }
}

function floor(color) {
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(4000, 4000), new THREE.MeshStandardMaterial({ color, roughness: 0.9, depthWrite: false }));
  mesh.renderOrder = -2; // below the grid, which would flicker in it by depth alone
  mesh.position.z = -0.24;
  mesh.receiveShadow = true;
  return mesh;
}

function grid(size, cells, strong, weak) {
  const made = new THREE.GridHelper(size, cells, strong, weak);
  made.rotation.x = Math.PI / 2;
  made.position.z = -0.235;
  made.renderOrder = -1;
  return made;
}

function stars() {
  const places = [];
  for (let i = 0; i < 1200; i++) {
    // An even sphere, the same each time.
    const z = 1 - (2 * (i + 0.5)) / 1200;
    const turn = i * 2.399963 + 0.7 * Math.sin(i * 12.9898);
    const across = Math.sqrt(1 - z * z);
    places.push(800 * across * Math.cos(turn), 800 * across * Math.sin(turn), 800 * z);
  }
  const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
  return new THREE.Points(geometry, new THREE.PointsMaterial({ color: "#8fa3b8", size: 1.6, sizeAttenuation: false, fog: false }));
}
