// A robot's body from its `look`, and what its actuators show: plumes, spinning and turning parts.
import * as THREE from "./vendor.js";
const TURNS = new Set(["surface", "steer"]); // kinds that stand at an angle; all others spin
const SPIN = 25; // rad/s at full command
const PLUME = { nozzle: "#ffb066", fan: "#9fd8ff", propeller: "#bfe8ff", throttle: "#bfe8ff" };
const LEAST = 0.03; // share below which no plume is drawn
const UP = new THREE.Vector3(0, 0, 1);

export const AT_ORIGIN = [0, 0, 0, 0, 0, 0, 1];

// Put something at a pose: x, y, z and a quaternion with w last.
export function posed(object, pose) {
  object.position.fromArray(pose);
  object.quaternion.fromArray(pose, 3);
  return object;
}

const numbers = (text, Kind) => new Kind(Uint8Array.from(atob(text), (each) => each.charCodeAt(0)).buffer);

function triangles({ points, corners }) {
  const made = new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(numbers(points, Float32Array), 3));
  const flat = made.setIndex(new THREE.BufferAttribute(numbers(corners, Uint16Array), 1)).toNonIndexed();
  flat.computeVertexNormals();
  return flat;
}

function geometry({ shape, size, mesh }) {
  const [a, b, c] = size;
  if (mesh) return triangles(mesh);
  if (shape === "box") return new THREE.BoxGeometry(a, b, c);
  if (shape === "sphere") return new THREE.SphereGeometry(a / 2, 24, 16);
  const round = {
    cylinder: () => new THREE.CylinderGeometry(a / 2, a / 2, b, 28),
    cone: () => new THREE.ConeGeometry(a / 2, b, 24),
    capsule: () => new THREE.CapsuleGeometry(a / 2, Math.max(b - a, 0.001), 8, 20),
  }[shape];
  return round().rotateX(Math.PI / 2); // three's stand along y, ours along z
}

function material(color, own) {
  const [r, g, b, opacity] = color === "own" ? [...new THREE.Color(own).toArray(), 1] : color;
  const made = new THREE.MeshStandardMaterial({ roughness: 0.55, metalness: 0.1, transparent: opacity < 1, opacity });
  if (color === "own") made.color.set(own);
  else made.color.setRGB(r, g, b, THREE.SRGBColorSpace);
  return made;
}

// A plain body, for a robot of which nothing is known yet.
const UNKNOWN = [{ shape: "cylinder", size: [0.4, 0.2], at: [0, 0, 0], quat: [0, 0, 0, 1], color: "own" }];

export class Body {
  constructor(record) {
    this.group = new THREE.Group();
    this.movers = [];
    this.plumes = [];
    const info = record.info || {};
    const actuators = info.actuators || [];
    for (const part of info.look?.length ? info.look : UNKNOWN) this.addPart(part, actuators, record.color);
    const reach = 1.3 * (info.radius || 0.3);
    actuators.forEach((actuator, index) => this.addPlume(actuator, index, reach));
  }

  addPart(part, actuators, own) {
    const mesh = posed(new THREE.Mesh(geometry(part), material(part.color, own)), [...part.at, ...part.quat]);
    mesh.castShadow = true;
    this.group.add(mesh);
    const index = actuators.findIndex((each) => each.name === part.moves);
    if (index < 0) return;
    const { kind, full } = actuators[index];
    const about = new THREE.Vector3(...part.about).normalize();
    const still = mesh.quaternion.clone();
    this.movers.push({ mesh, index, about, still, gain: part.gain, turns: TURNS.has(kind), full, angle: 0 });
  }

  addPlume({ kind, position, direction }, index, reach) {
    const color = PLUME[kind];
    if (!color || !direction?.some(Boolean)) return;
    const cone = new THREE.ConeGeometry(0.09 * reach, reach, 14, 1, true).rotateX(-Math.PI / 2).translate(0, 0, -reach / 2);
    const light = { transparent: true, opacity: 0.75, blending: THREE.AdditiveBlending, depthWrite: false, side: THREE.DoubleSide };
    const glow = new THREE.MeshBasicMaterial({ color, ...light });
    const mesh = new THREE.Mesh(cone, glow);
    mesh.position.set(...position);
    // It begins at the nozzle, and ends against the push.
    mesh.quaternion.setFromUnitVectors(UP, new THREE.Vector3(...direction).normalize());
    mesh.visible = false;
    this.group.add(mesh);
    this.plumes.push({ mesh, index, at: mesh.quaternion.clone() });
  }

  // What actuators do now; `dt` since the last call [s].
  move(shares, dt) {
    for (const plume of this.plumes) {
      const share = shares[plume.index] || 0;
      plume.mesh.visible = Math.abs(share) > LEAST;
      plume.mesh.scale.set(1, 1, Math.sign(share) * (0.25 + 0.75 * Math.abs(share)) || 1);
    }
    for (const mover of this.movers) {
      const share = shares[mover.index] || 0;
      mover.angle = mover.turns ? mover.gain * share * mover.full : mover.angle + mover.gain * share * SPIN * dt;
      const turn = new THREE.Quaternion().setFromAxisAngle(mover.about, mover.angle);
      mover.mesh.quaternion.copy(mover.still).multiply(turn);
    }
  }

  // Half-transparent: the second bag's robots, and robots that are silent.
  fade(opacity) {
    this.group.traverse((each) => {
      if (!each.material || this.plumes.some((plume) => plume.mesh === each)) return;
      each.userData.opacity ??= each.material.opacity;
      each.material.opacity = each.userData.opacity * opacity;
      each.material.transparent = each.material.opacity < 1;
    });
  }

  dispose() {
    this.group.traverse((each) => {
      each.geometry?.dispose();
      each.material?.dispose();
    });
  }
}

// Things in space: parts with half sizes, as MuJoCo takes them, and poses with w first.
export function structure({ parts }) {
  const group = new THREE.Group();
  for (const { shape, size, pose, color } of parts) {
    const [a, b] = size;
    const full = { box: size.map((half) => 2 * half), sphere: [2 * a], cylinder: [2 * a, 2 * b], capsule: [2 * a, 2 * (a + b)] };
    const mesh = new THREE.Mesh(geometry({ shape, size: full[shape] }), material([...color, 1]));
    const [x, y, z, qw, ...rest] = pose;
    group.add(posed(mesh, [x, y, z, ...rest, qw]));
  }
  return group;
}
