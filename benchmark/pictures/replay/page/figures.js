// The figures of a moment, as the benchmark's own tracking has them, into the page's text.

const DASH = "\u2013";

function number(value, digits) {
  return Number.isFinite(value) ? value.toFixed(digits) : DASH;
}

function clock(seconds) {
  const whole = Math.floor(seconds + 1e-6);
  const two = (part) => String(part).padStart(2, "0");
  const hours = Math.floor(whole / 3600);
  const rest = `${two(Math.floor((whole % 3600) / 60))}:${two(whole % 60)}`;
  return hours ? `${hours}:${rest}` : rest;
}

class Figures {
  constructor(element, table, episode, order) {
    this.episode = episode;
    this.cells = {};
    for (const cell of element.querySelectorAll("[data-figure]")) this.cells[cell.dataset.figure] = cell;
    this.rows = [];
    for (const row of table.querySelectorAll("tr[data-row]")) {
      const [junction, movement] = row.dataset.row.split(".").map(Number);
      this.rows.push({ junction, movement, cell: row.querySelector(`[data-episode="${order}"]`) });
    }
  }

  // The summary of a step, over all junctions.
  at(step) {
    const { episode } = this;
    const of = (name) => episode.ground.junctions.map((_, junction) => episode[`${junction}.${name}`]);
    const sum = (values) => values.reduce((total, value) => total + value, 0);
    const mean = (name) => {
      const values = of(name).map((curve) => curve[step]).filter(Number.isFinite);
      return sum(values) / values.length; // NaN for none
    };
    const lanes = of("unregulated").map((free) => free.length / episode.steps);
    const free = of("unregulated").flatMap((rows, index) =>
      Array.from({ length: lanes[index] }, (_, row) => rows[row * episode.steps + step]),
    );
    return {
      vehicles: episode.starts[step + 1] - episode.starts[step],
      waiting: mean("waiting"),
      average: mean("average"),
      passed: sum(of("passed").map((curve) => curve[step])),
      collisions: episode.collisions.filter((one) => one.counted && one.first <= step).length,
      unregulated: sum(free),
      lanes: sum(lanes),
    };
  }

  show(step) {
    const now = this.at(step);
    const robots = this.episode.record.rate !== null;
    write(this.cells.average, Number.isFinite(now.average) ? `${number(now.average, 1)} s` : "warm-up");
    write(this.cells.waiting, `${number(now.waiting, 1)} s`);
    write(this.cells.vehicles, String(now.vehicles));
    write(this.cells.passed, String(now.passed));
    write(this.cells.collisions, String(now.collisions));
    write(this.cells.unregulated, robots ? `${now.unregulated} of ${now.lanes}` : DASH);
    for (const { junction, movement, cell } of this.rows) this.showMovement(cell, step, junction, movement);
  }

  showMovement(cell, step, junction, movement) {
    const at = movement * this.episode.steps + step;
    const vehicles = this.episode[`${junction}.movement_vehicles`][at];
    const waiting = this.episode[`${junction}.movement_waiting`][at];
    const [bar, words] = cell.children;
    bar.style.setProperty("--share", Math.min(1, (Number.isFinite(waiting) ? waiting : 0) / 60).toFixed(3));
    write(words, vehicles ? `${number(waiting, 0)} s · ${vehicles}` : DASH);
  }

  // A vehicle at a moment, in words.
  tell(step, name) {
    const { episode } = this;
    const vehicle = episode.index.get(name) ?? -1;
    const into = step - (vehicle < 0 ? 0 : episode.vehicles.first[vehicle]);
    if (vehicle < 0) return `${name} is not in this episode`;
    if (into < 0) return `${name} enters at ${clock(episode.start + episode.vehicles.first[vehicle] * episode.step)}`;
    if (into >= episode.vehicles.steps[vehicle]) return `${name} has left`;
    const at = episode.offsets[vehicle] + into;
    const parts = [
      episode.vehicles.robot[vehicle] ? "RV" : "HV",
      episode.classes[episode.vehicles.kind[vehicle]].name,
      episode.vehicles.movement[vehicle],
      `${number(episode.speed[at] * 3.6, 0)} km/h`,
      `waited ${number(episode.waited[at] * episode.step, 0)} s`,
    ];
    return `${name}: ${parts.filter(Boolean).join(", ")}${this.decision(at)}`;
  }

  decision(at) {
    const { told, acceleration, side } = this.episode;
    const words = { go: "Go", stop: "Stop", held: "Go, held back" }[TOLD[told[at]]];
    if (words) return `; ${words}`;
    if (TOLD[told[at]] !== "drive") return "";
    const lane = side[at] ? `, to the ${side[at] > 0 ? "left" : "right"}` : "";
    return `; ${acceleration[at] < 0 ? "\u2212" : "+"}${number(Math.abs(acceleration[at]), 1)} m/s\u00b2${lane}`;
  }
}

// Only what changes is written: layout costs more than the comparison.
function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
