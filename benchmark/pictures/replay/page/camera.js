// What part of the ground is shown: shared by all stages, so that they show the same.

const CLOSEST = 60; // pixels per metre
const FARTHEST = 0.3;

class Camera {
  constructor(ground) {
    const [first] = ground.junctions;
    this.home = { x: first.centre[0], y: first.centre[1], reach: first.radius + 55 }; // m
    this.reset();
  }

  reset() {
    this.x = this.home.x;
    this.y = this.home.y;
    this.zoom = 1; // times what shows the home's reach
  }

  // Pixels per metre on a stage.
  scale(width, height) {
    const fitting = Math.min(width, height) / (2 * this.home.reach);
    return Math.max(FARTHEST, Math.min(CLOSEST, fitting * this.zoom));
  }

  // Closer or farther, keeping what lies under a point of the stage where it is.
  zoomBy(factor, width, height, px = width / 2, py = height / 2) {
    const before = this.scale(width, height);
    const fitting = Math.min(width, height) / (2 * this.home.reach);
    this.zoom = Math.max(FARTHEST, Math.min(CLOSEST, before * factor)) / fitting;
    const after = this.scale(width, height);
    this.x += (px - width / 2) * (1 / before - 1 / after);
    this.y -= (py - height / 2) * (1 / before - 1 / after);
  }

  panBy(dx, dy, width, height) {
    const scale = this.scale(width, height);
    this.x -= dx / scale;
    this.y += dy / scale;
  }
}
