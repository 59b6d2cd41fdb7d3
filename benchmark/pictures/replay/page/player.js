// The one clock of all stages: what is shown, and when.

const GLANCE = 200; // ms between two looks at the figures while it plays

class Player extends EventTarget {
  constructor(stages, camera) {
    super();
    this.stages = stages;
    this.camera = camera;
    [this.episode] = stages.map((stage) => stage.episode);
    this.last = this.episode.steps - 1;
    this.step = 0; // with a fraction between two steps
    this.speed = 4; // seconds of the episode in a second
    this.playing = false;
    this.followed = "";
    this.shown = { zones: true, decisions: true, unregulated: true };
    this.told = -Infinity; // ms, when figures were last written
    this.asked = false;
    this.frame = this.frame.bind(this);
  }

  time() {
    return this.episode.start + this.step * this.episode.step;
  }

  stepAt(time) {
    return (time - this.episode.start) / this.episode.step;
  }

  knows(name) {
    return this.stages.some((stage) => stage.vehicle(name) >= 0);
  }

  play() {
    if (this.step >= this.last) this.step = 0;
    this.playing = true;
    this.before = null;
    this.ask();
    this.say("state");
  }

  pause() {
    this.playing = false;
    this.ask();
    this.say("state");
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  seek(step) {
    this.step = Math.max(0, Math.min(this.last, step));
    this.ask();
  }

  skip(seconds) {
    this.seek(this.step + seconds / this.episode.step);
  }

  follow(name) {
    this.followed = name;
    const stage = this.stages.find((one) => one.vehicle(name) >= 0);
    if (stage && !this.stages.some((one) => poseAt(one.episode, one.vehicle(name), this.step, one.cast.pose))) {
      this.seek(stage.episode.vehicles.first[stage.vehicle(name)]);
    }
    if (!name) for (const one of this.stages) this.release(one);
    this.ask();
    this.say("state");
  }

  // Where a vehicle was last followed is where the camera stays.
  release(stage) {
    if (stage.centre) Object.assign(this.camera, stage.centre);
    stage.centre = null;
  }

  // Draw soon, once.
  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(this.frame);
  }

  frame(now) {
    this.asked = false;
    if (this.playing) {
      const passed = this.before === null ? 0 : Math.min(250, now - this.before); // a tab that slept goes on
      this.before = now;
      this.step += (passed / 1000) * (this.speed / this.episode.step);
      if (this.step >= this.last) {
        this.step = this.last;
        this.playing = false;
        this.say("state");
      }
    }
    for (const stage of this.stages) stage.draw(this.step, this.shown, this.followed);
    if (!this.playing || now - this.told > GLANCE) {
      this.told = now;
      this.say("moment");
    }
    if (this.playing) this.ask();
  }

  say(what) {
    this.dispatchEvent(new Event(what));
  }
}
