// What moves: vehicles and what they were told, lights, lanes without an RV, collisions.

const TOLD = ["nothing", "go", "stop", "held", "drive"];
const KINDS = { hv: "#f5f5f1", rv: "#e0352b", glass: "rgba(20, 26, 30, 0.72)" };
const RINGS = { go: "#4fd37f", stop: "#ffb224", held: "#c08bff", faster: "#4cc9f0", slower: "#ffb224", even: "#9fb0b8" };
const LIGHTS = { G: "#3ddc74", g: "#3ddc74", s: "#ffb224", y: "#ffd23f", u: "#ffd23f", r: "#ff5a4a" };
const ARROWS = "Ggs"; // s: right on red, after a stop
const UNREGULATED = "rgba(255, 190, 40, 0.3)";
const AFTERGLOW = 4; // s that a collision stays marked
const EVEN = 0.05; // m/s2, within which a Drive holds its speed

class Traffic {
  constructor(episode, paths) {
    this.episode = episode;
    this.paths = paths;
    this.pose = { x: 0, y: 0, heading: 0, entry: 0 };
    this.count = 0;
    this.places = new Float64Array(4 * episode.vehicles.id.length); // x, y, heading, entry
    this.shown = new Int32Array(episode.vehicles.id.length);
  }

  // Where everybody is at a moment, in steps.
  settle(step) {
    const { episode, pose } = this;
    const whole = Math.floor(step);
    this.count = 0;
    for (let at = episode.starts[whole]; at < episode.starts[whole + 1]; at += 1) {
      const vehicle = episode.present[at];
      if (!poseAt(episode, vehicle, step, pose)) continue;
      this.shown[this.count] = vehicle;
      this.places.set([pose.x, pose.y, pose.heading, pose.entry], 4 * this.count);
      this.count += 1;
    }
  }

  draw(context, look, step, shown, followed) {
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, context.canvas.width, context.canvas.height);
    intoMetres(context, look);
    const whole = Math.floor(step);
    if (shown.unregulated && this.episode.record.rate !== null) this.drawUnregulated(context, whole);
    this.drawHeads(context, look, whole);
    this.drawBodies(context, look, false);
    this.drawBodies(context, look, true);
    this.drawGlass(context, look);
    if (shown.decisions) this.drawDecisions(context, look);
    if (followed >= 0) this.drawFollowed(context, look, followed);
    this.drawCollisions(context, look, step);
  }

  drawUnregulated(context, step) {
    context.fillStyle = UNREGULATED;
    this.paths.lanes.forEach((lanes, junction) => {
      const free = this.episode[`${junction}.unregulated`];
      lanes.forEach((lane, row) => {
        if (free[row * this.episode.steps + step]) context.fill(lane);
      });
    });
  }

  // A light's colour has a shape of its own too: an arrow, a dot, a bar.
  drawHeads(context, look, step) {
    this.episode.ground.junctions.forEach((junction, index) => {
      const states = this.episode.states[index];
      if (!states.length) return;
      const state = states[this.episode[`${index}.light`][step]];
      for (const head of junction.heads) this.drawHead(context, look, head, state[head.link]);
    });
  }

  drawHead(context, look, head, letter) {
    const heading = head.angle * RAD;
    const size = Math.max(head.width * 0.42, 2.2 / look.scale);
    const at = (aside, ahead) => [
      head.place[0] + aside * Math.cos(heading) + ahead * Math.sin(heading),
      head.place[1] - aside * Math.sin(heading) + ahead * Math.cos(heading),
    ];
    const middle = at(0, 1.4);
    context.fillStyle = "#15191b";
    context.beginPath();
    context.arc(...middle, size * 1.25, 0, 2 * Math.PI);
    context.fill();
    context.fillStyle = LIGHTS[letter] || "#8a8f92";
    context.beginPath();
    if (ARROWS.includes(letter)) {
      polygon(context, [at(0, 1.4 + size), at(size * 0.85, 1.4 - size * 0.7), at(-size * 0.85, 1.4 - size * 0.7)]);
    } else if (letter === "y") {
      context.arc(...middle, size * 0.62, 0, 2 * Math.PI);
    } else {
      polygon(context, [
        at(-size, 1.4 - size * 0.4), at(size, 1.4 - size * 0.4), at(size, 1.4 + size * 0.4), at(-size, 1.4 + size * 0.4),
      ]);
    }
    context.fill();
  }

  drawBodies(context, look, robots) {
    const { classes, vehicles } = this.episode;
    context.beginPath();
    for (let slot = 0; slot < this.count; slot += 1) {
      const vehicle = this.shown[slot];
      if (vehicles.robot[vehicle] !== robots || !this.visible(look, slot)) continue;
      const { length, width } = classes[vehicles.kind[vehicle]];
      const half = width / 2;
      const corner = Math.min(0.28 * width, 0.12 * length);
      this.trace(context, slot, [
        [half - corner, 0], [half, -corner * 1.4], [half, -length + corner], [half - corner, -length],
        [corner - half, -length], [-half, -length + corner], [-half, -corner * 1.4], [corner - half, 0],
      ]);
    }
    context.fillStyle = robots ? KINDS.rv : KINDS.hv;
    context.fill();
  }

  // The windscreen shows which way a vehicle looks.
  drawGlass(context, look) {
    if (look.scale < 2) return;
    const { classes, vehicles } = this.episode;
    context.beginPath();
    for (let slot = 0; slot < this.count; slot += 1) {
      if (!this.visible(look, slot)) continue;
      const { length, width } = classes[vehicles.kind[this.shown[slot]]];
      const from = -Math.min(0.24 * length, 1.3);
      const half = 0.39 * width;
      this.trace(context, slot, [[half * 0.85, from], [half, from - 0.65], [-half, from - 0.65], [-half * 0.85, from]]);
    }
    context.fillStyle = KINDS.glass;
    context.fill();
  }

  visible(look, slot) {
    const x = this.places[4 * slot];
    const y = this.places[4 * slot + 1];
    const reach = 20; // m, longer than any vehicle
    return Math.abs(x - look.x) * look.scale < look.width / 2 + reach * look.scale
      && Math.abs(y - look.y) * look.scale < look.height / 2 + reach * look.scale;
  }

  // A shape in a vehicle's own metres, [to the right, ahead of the front bumper].
  trace(context, slot, shape) {
    const at = 4 * slot;
    const sine = Math.sin(this.places[at + 2]);
    const cosine = Math.cos(this.places[at + 2]);
    for (let index = 0; index < shape.length; index += 1) {
      const [right, ahead] = shape[index];
      const x = this.places[at] + right * cosine + ahead * sine;
      const y = this.places[at + 1] - right * sine + ahead * cosine;
      if (index) context.lineTo(x, y);
      else context.moveTo(x, y);
    }
    context.closePath();
  }

  // A ring in a colour and a sign of its own on the roof: one path for each kind of decision.
  drawDecisions(context, look) {
    const { told, acceleration, side, vehicles, classes } = this.episode;
    const rings = {};
    const signs = [];
    for (let slot = 0; slot < this.count; slot += 1) {
      const entry = this.places[4 * slot + 3];
      if (!told[entry] || !this.visible(look, slot)) continue;
      const { length, width } = classes[vehicles.kind[this.shown[slot]]];
      const what = spoken(told[entry], acceleration[entry]);
      (rings[what] ||= []).push([slot, length, width]);
      signs.push([slot, sign(what, acceleration[entry], side[entry], length, width, look.scale)]);
    }
    context.lineWidth = Math.max(0.3, 1.6 / look.scale);
    for (const [what, ringed] of Object.entries(rings)) {
      context.beginPath();
      for (const [slot, length, width] of ringed) {
        const half = width / 2 + 0.15;
        this.trace(context, slot, [[half, 0.15], [half, -length - 0.15], [-half, -length - 0.15], [-half, 0.15]]);
      }
      context.strokeStyle = RINGS[what];
      context.stroke();
    }
    context.beginPath();
    for (const [slot, shapes] of signs) for (const shape of shapes) this.trace(context, slot, shape);
    context.fillStyle = "#ffffff";
    context.fill();
  }

  drawFollowed(context, look, vehicle) {
    for (let slot = 0; slot < this.count; slot += 1) {
      if (this.shown[slot] !== vehicle) continue;
      const { length } = this.episode.classes[this.episode.vehicles.kind[vehicle]];
      const heading = this.places[4 * slot + 2];
      context.beginPath();
      context.arc(
        this.places[4 * slot] - (Math.sin(heading) * length) / 2,
        this.places[4 * slot + 1] - (Math.cos(heading) * length) / 2,
        Math.max(length * 0.85, 9 / look.scale), 0, 2 * Math.PI,
      );
      context.strokeStyle = "#ffffff";
      context.lineWidth = 2.2 / look.scale;
      context.stroke();
    }
  }

  // A cross where two vehicles touch, and for a while where they did.
  drawCollisions(context, look, step) {
    const { collisions, step: seconds } = this.episode;
    for (const one of collisions) {
      if (step < one.first || step > one.last + AFTERGLOW / seconds) continue;
      const place = this.meeting(one, Math.min(step, one.last));
      if (!place) continue;
      const size = Math.max(2.2, 9 / look.scale);
      context.globalAlpha = Math.max(0.25, 1 - (Math.max(0, step - one.last) * seconds) / AFTERGLOW);
      for (const [colour, width] of [["#15191b", 5], ["#ff4fd8", 3]]) {
        context.strokeStyle = colour;
        context.lineWidth = Math.max(width / look.scale, width * 0.12);
        context.beginPath();
        context.arc(place[0], place[1], size, 0, 2 * Math.PI);
        context.moveTo(place[0] - size, place[1] - size);
        context.lineTo(place[0] + size, place[1] + size);
        context.moveTo(place[0] - size, place[1] + size);
        context.lineTo(place[0] + size, place[1] - size);
        context.stroke();
      }
      context.globalAlpha = 1;
    }
  }

  meeting({ vehicles, first }, step) {
    for (const moment of [step, Math.floor(step), first]) {
      const places = [];
      for (const vehicle of vehicles) {
        if (!poseAt(this.episode, vehicle, moment, this.pose)) continue;
        const { length } = this.episode.classes[this.episode.vehicles.kind[vehicle]];
        const back = length / 2;
        places.push([this.pose.x - back * Math.sin(this.pose.heading), this.pose.y - back * Math.cos(this.pose.heading)]);
      }
      if (places.length === 2) return [(places[0][0] + places[1][0]) / 2, (places[0][1] + places[1][1]) / 2];
    }
    return null;
  }

  // The vehicle at a place [m], or -1.
  at(x, y, reach) {
    let nearest = -1;
    let closest = reach;
    for (let slot = 0; slot < this.count; slot += 1) {
      const { length } = this.episode.classes[this.episode.vehicles.kind[this.shown[slot]]];
      const heading = this.places[4 * slot + 2];
      const apart = Math.hypot(
        this.places[4 * slot] - (Math.sin(heading) * length) / 2 - x,
        this.places[4 * slot + 1] - (Math.cos(heading) * length) / 2 - y,
      );
      if (apart < closest + length / 3) {
        closest = apart - length / 3;
        nearest = this.shown[slot];
      }
    }
    return nearest;
  }
}

function polygon(context, points) {
  points.forEach((point, index) => (index ? context.lineTo(...point) : context.moveTo(...point)));
  context.closePath();
}

function spoken(told, acceleration) {
  if (TOLD[told] !== "drive") return TOLD[told];
  if (Math.abs(acceleration) <= EVEN) return "even";
  return acceleration > 0 ? "faster" : "slower";
}

// What stands on the roof: an arrow for Go, a bar for Stop, both for a Go that is held back; an
// acceleration as a beam ahead or back as long as it is strong, a change of lanes as an arrow aside.
function sign(what, acceleration, side, length, width, scale) {
  const middle = -0.62 * length;
  const half = Math.max(0.3 * width, 2 / scale);
  const arrow = (low, high) => [[0, high], [half, low], [-half, low]];
  const bar = (low, high) => [[half, high], [half, low], [-half, low], [-half, high]];
  const shapes = [];
  if (what === "go") shapes.push(arrow(middle - half, middle + half));
  if (what === "stop") shapes.push(bar(middle - half * 0.4, middle + half * 0.4));
  if (what === "held") shapes.push(arrow(middle - half * 1.5, middle), bar(middle + half * 0.4, middle + half));
  if (what === "faster" || what === "slower") {
    const end = middle + Math.sign(acceleration) * Math.min(0.36 * length, 0.3 + 0.5 * Math.abs(acceleration));
    const thin = half * 0.4;
    shapes.push([[thin, end], [thin, middle], [-thin, middle], [-thin, end]]);
  }
  if (side) {
    const tip = -Math.sign(side) * (width / 2 + half * 1.6); // 1 is to the left
    const foot = -Math.sign(side) * width * 0.5;
    shapes.push([[tip, middle], [foot, middle + half * 1.3], [foot, middle - half * 1.3]]);
  }
  return shapes;
}
