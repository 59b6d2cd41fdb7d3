// Where vehicles are between two steps; benchmark/motion.py does the same for films.

const STANDS = 0.05; // m in a step, below which nobody moves
const SIDEWAYS = 1.0; // m to the side in a step, from which it is a change of lanes
const LEAN = 0.35; // rad, the most that a vehicle turns aside while it changes lanes
const RAD = Math.PI / 180;

// The velocities at each entry and what happens until the next, as motion.py has them.
function prepare(episode) {
  const { x, y, angle, offsets } = episode;
  const tangentX = new Float32Array(x.length);
  const tangentY = new Float32Array(x.length);
  const turn = new Float32Array(x.length);
  const lean = new Float32Array(x.length);
  for (let vehicle = 0; vehicle + 1 < offsets.length; vehicle += 1) {
    const first = offsets[vehicle];
    const last = offsets[vehicle + 1] - 1;
    for (let at = first; at < last; at += 1) lean[at] = leaning(episode, at);
    for (let at = first; at <= last; at += 1) {
      const before = at > first ? at - 1 : at;
      const after = at < last ? at + 1 : at;
      if (before === after) continue;
      if (at === first || at === last) {
        tangentX[at] = x[after] - x[before];
        tangentY[at] = y[after] - y[before];
        turn[at] = angle[after] - angle[before];
        continue;
      }
      turn[at] = harmonic(angle[at] - angle[before], angle[after] - angle[at]);
      const intoX = x[at] - x[before];
      const intoY = y[at] - y[before];
      const outX = x[after] - x[at];
      const outY = y[after] - y[at];
      const into = Math.hypot(intoX, intoY);
      const out = Math.hypot(outX, outY);
      if (into < STANDS || out < STANDS) continue;
      let aheadX = intoX / into + outX / out;
      let aheadY = intoY / into + outY / out;
      if (lean[before] || lean[at]) {
        aheadX = Math.sin(angle[at] * RAD);
        aheadY = Math.cos(angle[at] * RAD);
      }
      const length = Math.hypot(aheadX, aheadY);
      if (length < 1e-6) continue;
      const speed = harmonic(into, out);
      tangentX[at] = (aheadX / length) * speed;
      tangentY[at] = (aheadY / length) * speed;
    }
  }
  return Object.assign(episode, { tangentX, tangentY, turn, lean });
}

// 0 where the signs differ, so that nothing goes farther than its neighbours
function harmonic(one, other) {
  return one * other > 0 ? (2 * one * other) / (one + other) : 0;
}

// How far a vehicle turns aside on its way to the next entry, as it changes lanes; or 0.
function leaning({ x, y, angle }, at) {
  const heading = ((angle[at] + angle[at + 1]) / 2) * RAD;
  const east = x[at + 1] - x[at];
  const north = y[at + 1] - y[at];
  const aside = east * Math.cos(heading) - north * Math.sin(heading);
  if (Math.abs(aside) < SIDEWAYS) return 0;
  const ahead = east * Math.sin(heading) + north * Math.cos(heading);
  return Math.max(-LEAN, Math.min(LEAN, Math.atan2(aside, Math.max(ahead, 3))));
}

// Write into ``pose`` where a vehicle is: the middle of its front bumper [m] and its heading [rad
// clockwise from north]; false where it is not on the road.
function poseAt(episode, vehicle, step, pose) {
  const whole = Math.floor(step);
  const share = step - whole;
  const first = episode.vehicles.first[vehicle];
  const into = whole - first;
  const last = episode.vehicles.steps[vehicle] - 1;
  if (into < 0 || into > last || (into === last && share > 0)) return false;
  const at = episode.offsets[vehicle] + into;
  pose.entry = at;
  if (share === 0) {
    pose.x = episode.x[at];
    pose.y = episode.y[at];
    pose.heading = episode.angle[at] * RAD;
    return true;
  }
  const rest = 1 - share;
  const start = rest * rest * (1 + 2 * share);
  const out = rest * rest * share;
  const end = share * share * (3 - 2 * share);
  const arrive = -share * share * rest;
  const { x, y, angle, tangentX, tangentY, turn, lean } = episode;
  pose.x = start * x[at] + out * tangentX[at] + end * x[at + 1] + arrive * tangentX[at + 1];
  pose.y = start * y[at] + out * tangentY[at] + end * y[at + 1] + arrive * tangentY[at + 1];
  const degrees = start * angle[at] + out * turn[at] + end * angle[at + 1] + arrive * turn[at + 1];
  pose.heading = degrees * RAD + lean[at] * Math.sin(Math.PI * share) ** 2;
  return true;
}
