// Mean waiting over the whole episode above the slider, with the warm-up and the collisions.

const LINES = ["--series-0", "--series-1", "--series-2", "--series-3"];

function drawTimeline(canvas, episodes) {
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  const colour = (name) => getComputedStyle(canvas).getPropertyValue(name).trim();
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const [{ steps, step, start, warm_up: warmUp }] = episodes;
  const across = (index) => (index / Math.max(1, steps - 1)) * width;
  context.fillStyle = colour("--tint");
  context.fillRect(0, 0, across(Math.max(0, (warmUp - start) / step)), height);
  const curves = episodes.map((one) => one["0.waiting"]);
  const highest = Math.max(1, ...curves.map(peak));
  curves.forEach((curve, order) => {
    context.beginPath();
    let joined = false;
    curve.forEach((value, index) => {
      if (Number.isNaN(value)) {
        joined = false;
        return;
      }
      const y = height - 3 - (value / highest) * (height - 8);
      if (joined) context.lineTo(across(index), y);
      else context.moveTo(across(index), y);
      joined = true;
    });
    context.strokeStyle = colour(LINES[order]);
    context.lineWidth = 1.6;
    context.stroke();
  });
  episodes.forEach((one, order) => {
    context.fillStyle = colour(LINES[order]);
    for (const { first } of one.collisions) {
      context.beginPath();
      context.moveTo(across(first), 9);
      context.lineTo(across(first) - 4.5, 0);
      context.lineTo(across(first) + 4.5, 0);
      context.fill();
    }
  });
  return highest;
}

function peak(curve) {
  let highest = 0;
  for (const value of curve) if (value > highest) highest = value;
  return highest;
}
