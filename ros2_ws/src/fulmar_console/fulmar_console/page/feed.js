// Where a page's robots come from. `LiveFeed` (wire.js) and the bags (timeline.js) emit the same events:
//   hello   {version, session, mode, controls, bags}; robots  [{index, name, color, info}]; health  {name: HEALTH}
//   frame   {t_s, rosAge_s, samples: [{index, age_s, pose: [x y z qx qy qz qw], shares: [-1..1]}]}
//   event   {robot, t_s, kind, words}; image  {index, kind, data: Uint8Array}
//   link    {open, words}; answer  {id, accepted, words}
export class Feed {
  constructor() {
    this.listeners = {};
    this.mode = "live";
  }

  on(kind, listener) { (this.listeners[kind] ||= []).push(listener); }
  emit(kind, value) { for (const listener of this.listeners[kind] || []) listener(value); }

  // What can't be commanded says so; a live feed overrides it.
  async send(command) { return { accepted: false, words: `'${command.do}' is for robots that run, not for bags` }; }
}
