// The e-stop, and what is known about it: "stopped" is said only once the plants say so.
const CONFIRM_MS = 500;
const NOT_CONFIRMED = "NOT CONFIRMED: use the button at the robot";

export class Stopping {
  constructor(app, { button, state }) {
    Object.assign(this, { app, button, state, asked: new Map() }); // asked: name -> when, of stops that are not confirmed
    button.addEventListener("click", () => this.stop("*"));
    setInterval(() => this.show(), 100);
  }

  // At once, without a question: for one robot, or "*" for all.
  stop(robot) {
    const names = robot === "*" ? [...this.app.health.keys()] : [robot];
    for (const name of names) if (!this.app.health.get(name)?.estop) this.asked.set(name, performance.now());
    if (!names.length) this.asked.set("*", performance.now());
    this.app.feed.send({ do: "estop", robot }).then((answer) => {
      this.failed = answer.accepted ? "" : answer.words;
      if (answer.accepted) for (const name of [...names, "*"]) this.asked.delete(name);
      this.show();
    });
    this.show();
  }

  show() {
    const { health } = this.app;
    for (const name of this.asked.keys()) if (health.get(name)?.estop) this.asked.delete(name);
    const waiting = [...this.asked.values()];
    const late = waiting.some((at) => performance.now() - at > CONFIRM_MS);
    const stopped = [...health].filter(([, each]) => each.estop).map(([name]) => name);
    if (this.app.stale && !waiting.length) this.say("bad", `${this.app.stale}: what is shown is old`);
    else if (late) this.say("bad", NOT_CONFIRMED + (this.failed ? ` (${this.failed})` : ""));
    else if (waiting.length) this.say("wait", "Stopping…");
    else if (!health.size) this.say("", "Waiting for robots");
    else if (this.app.silent.length) this.say("bad", `Silent: ${this.app.silent.join(", ")}`);
    else if (stopped.length === health.size) this.say("stopped", stopped.length > 1 ? `All ${stopped.length} robots stopped` : "Stopped");
    else if (stopped.length) this.say("stopped", `Stopped: ${stopped.join(", ")}`);
    else this.say("ok", health.size > 1 ? `All ${health.size} robots answer` : "The robot answers");
  }

  say(kind, words) {
    if (this.state.textContent !== words) this.state.textContent = words;
    this.state.className = kind;
  }
}
