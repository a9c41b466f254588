// Driving by hand: held keys, held buttons and a gamepad. The page is the dead-man switch: it says nothing, the robot stops.
const PERIOD_MS = 50;
const DEAD_BAND = 0.12;
const [STOP_BUTTON, DEADMAN_BUTTON] = [1, 4]; // of an Xbox pad: B, and the left shoulder as `fulmar teleop` has it
const $ = (id) => document.getElementById(id);

export class Driving {
  constructor(app) {
    this.app = app;
    this.axes = [];
    this.held = new Set(); // keys and buttons, each a character
    this.drives = false;
    addEventListener("keydown", (event) => this.press(event, true));
    addEventListener("keyup", (event) => this.press(event, false));
    for (const name of ["blur", "pagehide"]) addEventListener(name, () => this.held.clear());
    document.addEventListener("visibilitychange", () => document.hidden && this.held.clear());
    setInterval(() => this.send(), PERIOD_MS);
  }

  build(axes) {
    this.axes = axes;
    this.held.clear();
    $("drive").hidden = !axes.length;
    $("keys").textContent = axes.map(({ keys, words }) => `${keys.split("").join("/")} ${words}`).join(" · ");
    $("pad").replaceChildren(...axes.flatMap(({ keys, name }) => [...keys].map((key, i) => this.button(key, `${name} ${i ? "−" : "+"}`))));
  }

  button(key, words) {
    const made = Object.assign(document.createElement("button"), { textContent: `${words} (${key})` });
    made.onpointerdown = (event) => {
      made.setPointerCapture(event.pointerId);
      this.held.add(key);
    };
    made.onpointerup = made.onpointercancel = made.onlostpointercapture = () => this.held.delete(key);
    return made;
  }

  // Keys drive only while their panel is open: else a w in a text field would.
  press(event, down) {
    const typing = /INPUT|SELECT|TEXTAREA/.test(event.target.tagName);
    const key = event.key.toLowerCase(); // with Shift pressed meanwhile, a w is let go as W
    if (!down) this.held.delete(key);
    else if ($("drive").open && !typing && !event.repeat && this.axes.some(({ keys }) => keys.includes(key))) this.held.add(key);
  }

  get pad() { return (navigator.getGamepads?.() || []).find(Boolean); }

  // Whether its robot is chosen or not: once a press.
  stopByPad() {
    const pressed = Boolean(this.pad?.buttons[STOP_BUTTON]?.pressed);
    if (pressed && !this.stops && this.app.feed.mode === "live") this.app.stopping.stop("*");
    this.stops = pressed;
  }

  get share() {
    const { pad } = this;
    const stick = (i) => (Math.abs(pad?.axes[i] || 0) > DEAD_BAND ? -pad.axes[i] : 0);
    const deadman = pad?.buttons[DEADMAN_BUTTON]?.pressed;
    const sticks = deadman ? [stick(1), stick(0), stick(3)] : [0, 0, 0];
    const keys = this.axes.map(({ keys }) => (this.held.has(keys[0]) ? 1 : 0) - (this.held.has(keys[1]) ? 1 : 0));
    return { share: keys.map((key, i) => key || sticks[i] || 0), deadman: deadman || this.held.size > 0 };
  }

  send() {
    this.stopByPad();
    if (!this.axes.length || !$("drive").open || !this.app.selected) return;
    const { share, deadman } = this.share;
    if (!deadman) return; // silence is the dead-man switch let go
    this.app.feed.push?.({ do: "teleop", robot: this.app.selected.name, share });
  }
}
