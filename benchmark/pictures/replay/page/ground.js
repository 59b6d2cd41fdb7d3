// What does not move: asphalt, paint, zones. Drawn again only when the camera moves.

const COLOURS = {
  asphalt: "#3b4043",
  line: "rgba(255, 255, 255, 0.45)",
  middle: "#d8b13c",
  arrow: "rgba(255, 255, 255, 0.5)",
  stop: "#f4f4f0",
  control: "rgba(110, 175, 220, 0.13)",
  decision: "rgba(110, 175, 220, 0.24)",
};

// Paths in metres, built once.
function paved(ground) {
  return {
    asphalt: outlines(ground.asphalt, true),
    lines: outlines(ground.lane_lines, false),
    middle: outlines(ground.centre_lines, false),
    arrows: outlines(ground.arrows, true),
    stops: outlines(ground.stop_lines.filter((one) => !one.yields).map((one) => one.ends), false),
    yields: outlines(ground.stop_lines.filter((one) => one.yields).map((one) => one.ends), false),
    control: outlines(ground.control_zone, true),
    decision: outlines(ground.decision_zone, true),
    lanes: ground.junctions.map((one) => one.regulated_lanes.map((lane) => outlines([lane.outline], true))),
  };
}

// Outlines all run the same way round, or one would cut a hole where it overlaps another.
function outlines(shapes, closed) {
  const path = new Path2D();
  for (const shape of shapes) {
    const points = closed && isClockwise(shape) ? [...shape].reverse() : shape;
    points.forEach(([x, y], index) => (index ? path.lineTo(x, y) : path.moveTo(x, y)));
    if (closed) path.closePath();
  }
  return path;
}

function isClockwise(shape) {
  let area = 0;
  shape.forEach(([x, y], index) => {
    const [nextX, nextY] = shape[(index + 1) % shape.length];
    area += x * nextY - nextX * y;
  });
  return area < 0;
}

function drawGround(context, paths, look, shown) {
  context.fillStyle = look.field;
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.fillRect(0, 0, context.canvas.width, context.canvas.height);
  intoMetres(context, look);
  context.fillStyle = COLOURS.asphalt;
  context.fill(paths.asphalt, "nonzero");
  context.strokeStyle = COLOURS.asphalt; // seals what rounding leaves open between outlines
  context.lineWidth = 0.3;
  context.stroke(paths.asphalt);
  if (shown.zones) {
    context.fillStyle = COLOURS.control;
    context.fill(paths.control);
    context.fillStyle = COLOURS.decision;
    context.fill(paths.decision);
  }
  const thin = 1 / look.scale; // a pixel
  stroke(context, paths.lines, COLOURS.line, Math.max(0.12, thin * 0.8), [3, 4.5]);
  stroke(context, paths.middle, COLOURS.middle, Math.max(0.14, thin * 0.9), []);
  context.fillStyle = COLOURS.arrow;
  context.fill(paths.arrows);
  stroke(context, paths.yields, COLOURS.line, Math.max(0.35, thin), [0.6, 0.4]);
  stroke(context, paths.stops, COLOURS.stop, Math.max(0.45, thin * 1.2), []);
}

function stroke(context, path, colour, width, dashes) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.setLineDash(dashes);
  context.stroke(path);
  context.setLineDash([]);
}

// From here on a context takes metres, y to the north.
function intoMetres(context, { scale, x, y, ratio, width, height }) {
  const zoom = scale * ratio;
  context.setTransform(zoom, 0, 0, -zoom, (width / 2) * ratio - x * zoom, (height / 2) * ratio + y * zoom);
}
