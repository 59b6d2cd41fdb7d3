// A document of benchmark.pictures.replay.document -> an episode with its numbers in typed arrays.

const NONE = -1; // in place of nan
const WITH_GAPS = new Set(["average", "waiting", "movement_waiting"]);

async function unpack(document) {
  const packed = await inflated(document.data);
  const columns = {};
  let place = 0;
  for (const column of document.columns) {
    const values = new (column.name === "x" || column.name === "y" ? Float64Array : Float32Array)(column.count);
    place = decode(packed, place, column, values);
    columns[column.name] = values;
  }
  return { ...document, ...columns, data: null, ...byStep(document) };
}

async function inflated(base64) {
  const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Seven bits in each byte, the sign in the lowest bit, differences of neighbours added up again.
function decode(bytes, start, column, values) {
  const gaps = WITH_GAPS.has(column.name.split(".").pop());
  let place = start;
  let whole = 0;
  let slope = 0;
  for (let index = 0; index < column.count; index += 1) {
    let number = 0;
    let weight = 1;
    while (bytes[place] > 127) {
      number += (bytes[place] & 127) * weight;
      weight *= 128;
      place += 1;
    }
    number += bytes[place] * weight;
    place += 1;
    const difference = number % 2 ? -(number + 1) / 2 : number / 2;
    if (column.order === 2) {
      slope += difference;
      whole += slope;
    } else {
      whole += difference;
    }
    values[index] = gaps && whole === NONE ? NaN : whole * column.unit;
  }
  return place;
}

// Where each vehicle's entries begin, and who is on the road in each step.
function byStep({ steps, vehicles }) {
  const offsets = new Int32Array(vehicles.id.length + 1);
  const starts = new Int32Array(steps + 1);
  vehicles.steps.forEach((count, vehicle) => {
    offsets[vehicle + 1] = offsets[vehicle] + count;
    for (let step = vehicles.first[vehicle]; step < vehicles.first[vehicle] + count; step += 1) starts[step + 1] += 1;
  });
  for (let step = 0; step < steps; step += 1) starts[step + 1] += starts[step];
  const present = new Int32Array(starts[steps]);
  const next = starts.slice();
  vehicles.steps.forEach((count, vehicle) => {
    for (let step = vehicles.first[vehicle]; step < vehicles.first[vehicle] + count; step += 1) {
      present[next[step]] = vehicle;
      next[step] += 1;
    }
  });
  const index = new Map(vehicles.id.map((name, vehicle) => [name, vehicle]));
  return { offsets, starts, present, index };
}
