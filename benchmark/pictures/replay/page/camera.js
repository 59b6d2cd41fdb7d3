// What part of the ground is shown, all junctions at first: shared by all stages, so that they show the same.

const CLOSEST = 60; // pixels per metre
const FARTHEST = 0.3;
const AROUND = 55; // m of road around the junctions

class Camera {
  constructor(ground) {
    const sides = [0, 1].map((axis) => {
      const ends = ground.junctions.flatMap(({ centre, radius }) => [-1, 1].map((side) => centre[axis] + side * (radius + AROUND)));
      return [Math.min(...ends), Math.max(...ends)];
    });
    const [x, y] = sides.map(([low, high]) => (low + high) / 2);
    this.home = { x, y, reach: Math.max(...sides.map(([low, high]) => high - low)) / 2 }; // m
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
