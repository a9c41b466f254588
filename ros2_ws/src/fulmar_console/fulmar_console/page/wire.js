// The websocket to the console's server: frames and news in, commands out.
import { Feed } from "./feed.js";
const FRAME = 1;
const IMAGE = 2;
const FRAME_HEAD = 24; // bytes before the first robot of a frame
const FULL = 127; // of an actuator's share
const RETRY_MS = [250, 500, 1000, 2000];
const ANSWER_MS = 8000; // after which a command counts as unanswered

export class LiveFeed extends Feed {
  constructor(address) {
    super();
    this.address = address;
    this.pending = new Map();
    this.retries = 0;
    this.number = 0;
    this.session = "";
    this.clock = null; // {server_s, at_ms} of the newest frame
    this.lastMessage = -Infinity;
    this.connect();
  }

  connect() {
    const socket = new WebSocket(this.address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.retries = 0;
      this.number = 0;
      this.emit("link", { open: true, words: "" });
    };
    socket.onmessage = (message) => this.take(message.data);
    socket.onclose = () => this.closed();
    this.socket = socket;
  }

  // Whatever waited for an answer has failed: nothing is sent again after a reconnect.
  closed() {
    for (const answer of this.pending.values()) answer({ accepted: false, words: "the console's server has gone" });
    this.pending.clear();
    this.clock = null;
    this.emit("link", { open: false, words: "the console's server does not answer; trying again" });
    const wait = RETRY_MS[Math.min(this.retries++, RETRY_MS.length - 1)];
    setTimeout(() => this.connect(), wait);
  }

  get open() { return this.socket.readyState === WebSocket.OPEN; }

  // Silence of the server [s].
  get silence_s() { return (performance.now() - this.lastMessage) / 1000; }

  take(data) {
    this.lastMessage = performance.now();
    if (typeof data === "string") this.takeText(JSON.parse(data));
    else this.takeBinary(data);
  }

  takeText(message) {
    const { type } = message;
    if (type === "hello") {
      this.session = message.session;
      this.mode = message.mode;
    }
    if (type === "answer") this.settle(message);
    this.emit(type, type === "robots" || type === "health" ? message.robots : message);
  }

  takeBinary(buffer) {
    const view = new DataView(buffer);
    const kind = view.getUint8(0);
    if (kind === FRAME) {
      const frame = readFrame(view);
      this.clock = { server_s: frame.t_s, at_ms: performance.now() };
      this.emit("frame", frame);
    } else if (kind === IMAGE) {
      const image = { index: view.getUint16(2, true), kind: view.getUint8(1), data: new Uint8Array(buffer, 8) };
      this.emit("image", image);
    }
  }

  settle(message) {
    this.pending.get(message.id)?.(message);
    this.pending.delete(message.id);
  }

  // The server's clock now [s]; null without a frame.
  now_s() { return this.clock && this.clock.server_s + (performance.now() - this.clock.at_ms) / 1000; }

  // Ask for something; resolves with {accepted, words}, and never rejects. Nothing waits for a reconnect.
  send(command) {
    if (!this.open) return Promise.resolve({ accepted: false, words: "not sent: the console's server does not answer" });
    const id = ++this.number;
    const at = this.now_s() ?? Date.now() / 1000;
    this.socket.send(JSON.stringify({ id, session: this.session, at, ...command }));
    return new Promise((resolve) => {
      this.pending.set(id, resolve);
      setTimeout(() => this.settle({ id, accepted: false, words: `no answer to '${command.do}' within 8 s` }), ANSWER_MS);
    });
  }

  // Ask for something that comes many times a second, where an answer is of no use.
  push(command) {
    if (!this.open) return;
    const at = this.now_s() ?? Date.now() / 1000;
    this.socket.send(JSON.stringify({ id: ++this.number, session: this.session, at, ...command }));
  }
}

// One binary frame, little endian: see protocol.pack_frame.
export function readFrame(view) {
  const count = view.getUint16(2, true);
  const frame = { t_s: view.getFloat64(8, true), rosAge_s: view.getFloat32(16, true), samples: [] };
  let at = FRAME_HEAD;
  for (let robot = 0; robot < count; robot++) {
    const actuators = view.getUint16(at + 2, true);
    const sample = { index: view.getUint16(at, true), age_s: view.getFloat32(at + 4, true), pose: [], shares: [] };
    for (let i = 0; i < 7; i++) sample.pose.push(view.getFloat32(at + 8 + 4 * i, true));
    for (let i = 0; i < actuators; i++) sample.shares.push(view.getInt8(at + 36 + i) / FULL);
    frame.samples.push(sample);
    at += 36 + actuators + ((4 - (actuators % 4)) % 4);
  }
  return frame;
}
