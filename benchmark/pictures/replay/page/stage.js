// One episode's place on the page: two canvases above each other, the lower for what does not move.

class Stage {
  constructor(element, episode, camera) {
    this.element = element;
    this.episode = episode;
    this.camera = camera;
    const [ground, traffic] = element.querySelectorAll("canvas");
    this.ground = ground.getContext("2d", { alpha: false });
    this.traffic = traffic.getContext("2d");
    this.canvas = traffic;
    this.paths = paved(episode.ground);
    this.cast = new Traffic(episode, this.paths);
    this.drawn = ""; // the view that the lower canvas shows
    this.centre = null; // of a stage that follows a vehicle
    this.resize();
  }

  resize() {
    this.width = this.element.clientWidth;
    this.height = this.element.clientHeight;
    this.ratio = Math.min(window.devicePixelRatio || 1, 2);
    for (const { canvas } of [this.ground, this.traffic]) {
      canvas.width = Math.round(this.width * this.ratio);
      canvas.height = Math.round(this.height * this.ratio);
    }
    this.drawn = "";
  }

  look() {
    const { x, y } = this.centre || this.camera;
    const { width, height, ratio } = this;
    return { x, y, width, height, ratio, scale: this.camera.scale(width, height), field: this.field() };
  }

  field() {
    return getComputedStyle(this.element).backgroundColor;
  }

  follow(step, vehicle) {
    const pose = this.cast.pose;
    if (vehicle < 0) this.centre = null;
    else if (poseAt(this.episode, vehicle, step, pose)) this.centre = { x: pose.x, y: pose.y };
  }

  draw(step, shown, name) {
    const vehicle = this.vehicle(name);
    this.follow(step, vehicle);
    const look = this.look();
    const view = [look.x, look.y, look.scale, look.field, this.width, this.height, shown.zones].join();
    if (view !== this.drawn) {
      drawGround(this.ground, this.paths, look, shown);
      this.drawn = view;
    }
    this.cast.settle(step);
    this.cast.draw(this.traffic, look, step, shown, vehicle);
  }

  vehicle(name) {
    return this.episode.index.get(name) ?? -1;
  }

  // The vehicle's name at a point of the canvas, or "".
  pick(px, py) {
    const { x, y, scale } = this.look();
    const found = this.cast.at(x + (px - this.width / 2) / scale, y - (py - this.height / 2) / scale, 8 / scale);
    return found < 0 ? "" : this.episode.vehicles.id[found];
  }
}
