// The lamp's volume: decoding it, and the light vector by it. The format and the formulas are those
// of docs/web.md. Everything is in metres, in the luminaire's frame. Needs no page: it runs in any
// JavaScript with atob and DecompressionStream.

export const LUMINANCE = [0.2126, 0.7152, 0.0722]; // of linear Rec. 709 (ITU-R BT.709-6, 3.2)

// What the tables of a lamp may state together (docs/web.md, "The codes"): 32 MB as float32.
const MOST_CODES = 2 ** 23;

const refusal = (problem) => new Error(`${problem}; export the lamp again with 'luxfield export'`);

const codeCount = ({ nodes: [x, y, w], steps }) => (x + 2) * (y + 2) * (w + 2) * steps.length;

// Throws an Error that names the first key of a lamp's JSON that is not as docs/web.md says.
function checkStated(stated) {
  const must = (holds, key, rule) => {
    if (!holds) throw refusal(`${key} must be ${rule}`);
  };
  const isList = (list, length) => Array.isArray(list) && list.length === length && list.every(Number.isFinite);
  must(stated !== null && typeof stated === 'object', 'the lamp', 'an object');
  must(stated.delta_m > 0 && Number.isFinite(stated.delta_m), 'delta_m', 'a positive number');
  must(stated.channels === 1 || stated.channels === 3, 'channels', '1 or 3');
  for (const key of ['on_f', 'on_i']) must(isList(stated[key], 4), key, 'four numbers');
  const zones = stated.zones ?? [];
  must(Array.isArray(zones) && zones.every((zone) => ['z_first_m', 'z_last_m', 'stated_error'].every(
    (key) => Number.isFinite(zone?.[key]))), 'zones', 'a list of ranges with their errors');
  const { tables } = stated;
  must(Array.isArray(tables) && tables.length >= 1, 'tables', 'a list of tables');
  let codes = 0;
  tables.forEach((table, k) => {
    const where = `tables[${k}]`;
    must(table !== null && typeof table === 'object', where, 'an object');
    must(table.side === 'front' || table.side === 'between', `${where}.side`, "'front' or 'between'");
    must(Number.isFinite(table.first) && table.first >= 0 && table.last > table.first
      && Number.isFinite(table.last), `${where}.first and last`, 'an ascending range');
    must(isList(table.nodes, 3) && table.nodes.every((n) => Number.isInteger(n) && n >= 4),
      `${where}.nodes`, 'three whole numbers of at least 4');
    for (const key of ['knees', 'steps'])
      must(isList(table[key], 3 * stated.channels), `${where}.${key}`, `${3 * stated.channels} numbers`);
    codes += codeCount(table);
    must(codes <= MOST_CODES, `${where}.nodes`, `so few that all tables have ${MOST_CODES} codes at most`);
  });
}

function bytesOfBase64(text) {
  let characters;
  try {
    characters = atob(text);
  } catch {
    throw refusal('the codes of a table are no base64');
  }
  const bytes = new Uint8Array(characters.length);
  for (let k = 0; k < bytes.length; ++k) bytes[k] = characters.charCodeAt(k);
  return bytes;
}

// Unpacks a zlib stream of `length` bytes, and stops reading where it is longer.
async function inflate(packed, length, where) {
  const damaged = () => refusal(`${where}: the codes are no zlib stream of the ${length} bytes that 'nodes' states`);
  const bytes = new Uint8Array(length);
  let filled = 0;
  const reader = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate')).getReader();
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (done) break;
      if (filled + value.length > length) throw damaged();
      bytes.set(value, filled);
      filled += value.length;
    }
  } catch {
    reader.cancel().catch(() => {});
    throw damaged();
  }
  if (filled !== length) throw damaged();
  return bytes;
}

// Codes from their differences to what the neighbours before them say, low bytes before high bytes.
function codesOfBytes(bytes, line, lines) {
  const count = bytes.length / 2;
  const codes = new Int16Array(count);
  for (let k = 0; k < count; ++k) {
    const number = bytes[k] + 256 * bytes[count + k];
    const difference = number & 1 ? -(number + 1) / 2 : number / 2;
    const hasLeft = k % line > 0, hasBelow = Math.floor(k / line) % lines > 0;
    const left = hasLeft ? codes[k - 1] : 0;
    const below = hasBelow ? codes[k - line] : 0;
    const both = hasLeft && hasBelow ? codes[k - line - 1] : 0;
    codes[k] = difference + left + below - both;
  }
  return codes;
}

async function decodeTable(stated, packed, where) {
  const [x, y] = stated.nodes;
  const total = codeCount(stated), count = total / stated.steps.length;
  const codes = codesOfBytes(await inflate(packed, 2 * total, where), x + 2, y + 2);
  const coefficients = new Float32Array(codes.length);
  stated.steps.forEach((step, component) => {
    const knee = stated.knees[component];
    for (let k = component * count; k < (component + 1) * count; ++k)
      coefficients[k] = knee * Math.sinh(step * codes[k]);
  });
  const table = { front: stated.side === 'front', first: stated.first, last: stated.last,
    nodes: stated.nodes, count, coefficients };
  table.brightest = brightestOfSlices(table, stated.steps.length / 3);
  return table;
}

// The longest (K_x, K_y, K_z) of each slice of the spline, as luminance weighs the channels.
function brightestOfSlices(table, channels) {
  const [x, y, w] = table.nodes;
  const slice = (x + 2) * (y + 2);
  const brightest = new Float64Array(w + 2);
  for (let l = 0; l < w + 2; ++l)
    for (let channel = 0; channel < channels; ++channel) {
      const first = channel * 3 * table.count + l * slice;
      let longest = 0;
      for (let k = first; k < first + slice; ++k)
        longest = Math.max(longest, Math.hypot(table.coefficients[k],
          table.coefficients[k + table.count], table.coefficients[k + 2 * table.count]));
      brightest[l] += (channels === 1 ? 1 : LUMINANCE[channel]) * longest;
    }
  return brightest;
}

// Where x, counted in nodes, lies on an axis: the first of four coefficients, and their weights.
function stencil(x, nodes) {
  const first = Math.min(Math.max(Math.floor(x), 0), nodes - 2);
  const f = x - first, g = 1 - f;
  return { first, weights: [g * g * g / 6, 2 / 3 - f * f * (1 - f / 2), 2 / 3 - g * g * (1 - g / 2),
    f * f * f / 6] };
}

export class LampVolume {
  // `stated` is a page's JSON, or a light of LUXFIELD_light_field; `packed` gives the zlib stream of
  // one of its tables.
  static async decode(stated, packed = (table) => bytesOfBase64(table.codes)) {
    checkStated(stated);
    const volume = new LampVolume();
    Object.assign(volume, { delta: stated.delta_m, channels: stated.channels, onF: stated.on_f,
      onI: stated.on_i, zones: stated.zones ?? [], floorShare: stated.floor_share ?? NaN });
    volume.tables = [];
    for (const [k, table] of stated.tables.entries())
      volume.tables.push(await decodeTable(table, packed(table), `tables[${k}]`));
    return volume;
  }

  // Where height z lies: w is tau in front of I, zeta between the planes.
  place(z) {
    const front = z >= this.delta;
    const w = front ? this.delta / z : z / this.delta;
    return { front, w, scale: front ? w : 1 };
  }

  tableAt({ front, w }) {
    return this.tables.find((one) => one.front === front && w >= one.first && w <= one.last);
  }

  // Middle and half side of the light's footprint, along axis 0 or 1.
  footprint(axis, { front, w }) {
    const mF = this.onF[axis], hF = this.onF[2 + axis], mI = this.onI[axis], hI = this.onI[2 + axis];
    return front ? [mI - (1 - w) * mF, hI + (1 - w) * hF]
      : [w * mI + (1 - w) * mF, w * hI + (1 - w) * hF];
  }

  // (K_x, K_y, K_z) of each channel by the spline of one table; null outside.
  lookUp(table, qx, qy, w) {
    if (!(Math.abs(qx) <= 1 && Math.abs(qy) <= 1)) return null;
    const [nx, ny, nw] = table.nodes;
    const x = stencil(0.5 * (qx + 1) * (nx - 1), nx), y = stencil(0.5 * (qy + 1) * (ny - 1), ny);
    const k = stencil((w - table.first) / (table.last - table.first) * (nw - 1), nw);
    const line = nx + 2, slice = (ny + 2) * line;
    const sums = new Float64Array(3 * this.channels);
    for (let l = 0; l < 4; ++l)
      for (let j = 0; j < 4; ++j) {
        const weight = k.weights[l] * y.weights[j];
        const first = (k.first + l) * slice + (y.first + j) * line + x.first;
        for (let c = 0; c < sums.length; ++c) {
          const at = c * table.count + first;
          sums[c] += weight * (x.weights[0] * table.coefficients[at]
            + x.weights[1] * table.coefficients[at + 1] + x.weights[2] * table.coefficients[at + 2]
            + x.weights[3] * table.coefficients[at + 3]);
        }
      }
    return sums;
  }

  // J(p), three numbers for each channel, W m^-2 or lm m^-2.
  lightVector([px, py, pz]) {
    const dark = new Float64Array(3 * this.channels);
    const at = this.place(pz), table = pz > 0 && this.tableAt(at);
    if (!table) return dark;
    const [mx, hx] = this.footprint(0, at), [my, hy] = this.footprint(1, at);
    const k = this.lookUp(table, (at.scale * px - mx) / hx, (at.scale * py - my) / hy, at.w);
    return k ? k.map((value) => value * at.scale * at.scale) : dark;
  }

  // The same of a point lamp in the middle of the light on F that has the lamp's intensities.
  farFieldLightVector([px, py, pz]) {
    const dark = new Float64Array(3 * this.channels);
    if (!(pz > 0)) return dark;
    const infinity = { front: true, w: 0 }, slope = this.delta / pz;
    const q = [px, py].map((p, axis) => {
      const [middle, half] = this.footprint(axis, infinity);
      return (slope * (p - this.onF[axis]) - middle) / half;
    });
    const k = this.lookUp(this.tableAt(infinity), q[0], q[1], 0);
    return k ? k.map((value) => value * slope * slope) : dark;
  }

  // How many corners of the rectangle with all light on F lie before the receiver's horizon, of 4.
  cornersBefore([px, py, pz], [nx, ny, nz]) {
    let before = 0;
    for (const x of [-1, 1])
      for (const y of [-1, 1]) {
        const u = this.onF[0] + x * this.onF[2], v = this.onF[1] + y * this.onF[3];
        before += nx * (u - px) + ny * (v - py) - nz * pz >= 0;
      }
    return before;
  }

  // n . J as luminance weighs the channels; 0 where all of F is behind the horizon.
  illuminance(p, n, farField = false) {
    const before = this.cornersBefore(p, n);
    if (before === 0) return 0;
    const j = farField ? this.farFieldLightVector(p) : this.lightVector(p);
    let sum = 0;
    for (let channel = 0; channel < this.channels; ++channel)
      sum += (this.channels === 1 ? 1 : LUMINANCE[channel])
        * (n[0] * j[3 * channel] + n[1] * j[3 * channel + 1] + n[2] * j[3 * channel + 2]);
    return before < 4 || farField ? Math.max(0, sum) : sum;
  }

  // About the largest illuminance at that height.
  brightestAt(z) {
    const at = this.place(z), table = z > 0 && this.tableAt(at);
    if (!table) return 0;
    const position = (at.w - table.first) / (table.last - table.first) * (table.nodes[2] - 1);
    return at.scale * at.scale * table.brightest[Math.round(position) + 1];
  }

  // The stated error of the zone of height z; of the farthest zone beyond it, NaN before the nearest
  // or where the file states none.
  statedErrorAt(z) {
    if (!(z >= this.zones[0]?.z_first_m)) return NaN;
    const zone = this.zones.find((one) => z <= one.z_last_m) || this.zones[this.zones.length - 1];
    return zone.stated_error;
  }

  // By how much illuminance(p, n) may be off.
  uncertainty(p, n) {
    return this.statedErrorAt(p[2])
      * Math.max(Math.abs(this.illuminance(p, n)), this.floorShare * this.brightestAt(p[2]));
  }
}
