// The room that the lamp stands in: y is up, metres. Rays, lamps' poses and shadows; the shader of
// room.glsl does the same.

const ROOM = { half: 4, wallZ: -3, wallHeight: 3, mesh: null };  // mesh.js
const SPHERE = { centre: [-0.55, 0.3, -1.2], radius: 0.3 };
const BOX = { centre: [0.6, 0.25, -1.5], half: [0.25, 0.25, 0.2] };
const SHADOW_RAYS = 3; // per side of the rectangle with all light on F

// ---- shapes: triangles as corners of seven numbers, place, normal and which surface it is ----

function rectangle(centre, side, up, normal, surface) {
  return [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]].map(([x, y]) =>
    [...add(add(centre, side, x), up, y), ...normal, surface]);
}

// Seen from outside, the corners of each triangle go round against the clock.
function box({ centre, half }, surface) {
  return [0, 1, 2].flatMap((k) => [-1, 1].flatMap((sign) => {
    const unit = (axis, length) => [0, 1, 2].map((i) => (i === axis ? length : 0));
    const next = (k + 1) % 3, last = (k + 2) % 3;
    return rectangle(add(centre, unit(k, sign * half[k])), unit(next, half[next]),
      unit(last, sign * half[last]), unit(k, sign), surface);
  }));
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const add = (a, b, k = 1) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0]];
const normalised = (a) => a.map((x) => x / Math.hypot(...a));

// Axes u, v and z of a lamp that is turned by yaw to its left and by pitch upwards from -z of the
// room, in the room's frame.
function lampAxes({ yaw, pitch }) {
  const axis = [-Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch), -Math.cos(yaw) * Math.cos(pitch)];
  const up = [Math.sin(yaw) * Math.sin(pitch), Math.cos(pitch), Math.cos(yaw) * Math.sin(pitch)];
  return [cross(up, axis), up, axis];
}

const toLamp = (axes, v) => axes.map((axis) => dot(axis, v));
const fromLamp = (axes, v) => [0, 1, 2].map((k) => axes[0][k] * v[0] + axes[1][k] * v[1]
  + axes[2][k] * v[2]);

const UNIT_CUBE = box({ centre: [0, 0, 0], half: [1, 1, 1] }, 0);
const FLAT_SURFACES = [
  ...box(BOX, 3),
  ...rectangle([0, 0, ROOM.wallZ + ROOM.half], [ROOM.half, 0, 0], [0, 0, -ROOM.half], [0, 1, 0], 0),
  ...rectangle([0, 0.5 * ROOM.wallHeight, ROOM.wallZ], [ROOM.half, 0, 0], [0, 0.5 * ROOM.wallHeight, 0],
    [0, 0, 1], 1)];

// ---- rays: distance, Infinity where nothing is hit ----

function hitSphere(origin, direction, { centre, radius }) {
  const to = add(origin, centre, -1);
  const b = dot(to, direction), c = dot(to, to) - radius * radius, root = b * b - c;
  return root > 0 && -b - Math.sqrt(root) > 1e-4 ? -b - Math.sqrt(root) : Infinity;
}

// Where a ray's line is within a box: [near, far], near > far where it misses.
function spanInBox(origin, direction, lo, hi) {
  let near = -Infinity, far = Infinity;
  for (let k = 0; k < 3; ++k) {
    const a = lo[k] - origin[k], b = hi[k] - origin[k];
    if (direction[k] === 0) {
      if (a > 0 || b < 0) return [Infinity, -Infinity];
      continue;
    }
    near = Math.max(near, Math.min(a / direction[k], b / direction[k]));
    far = Math.min(far, Math.max(a / direction[k], b / direction[k]));
  }
  return [near, far];
}

function hitBox(origin, direction, { centre, half }) {
  const [near, far] = spanInBox(origin, direction, add(centre, half, -1), add(centre, half));
  return near < far && near > 1e-4 ? near : Infinity;
}

function boxNormal(p, { centre, half }) {
  const at = p.map((x, k) => (x - centre[k]) / half[k]);
  const most = at.reduce((best, x, k) => (Math.abs(x) > Math.abs(at[best]) ? k : best), 0);
  return [0, 1, 2].map((k) => (k === most ? Math.sign(at[most]) : 0));
}

// What a ray hits of the room: { name, p, n, facet, distance }, or null. The plane of the surface has
// the normal `facet`; n, which the light is read by, differs from it on smooth meshes.
function hitRoom(origin, direction) {
  let best = { distance: Infinity };
  const take = (distance, name, normal) => {
    if (distance < best.distance) best = { distance, name, p: add(origin, direction, distance), normal };
  };
  const floor = -origin[1] / direction[1], wall = (ROOM.wallZ - origin[2]) / direction[2];
  const onFloor = add(origin, direction, floor), onWall = add(origin, direction, wall);
  if (floor > 1e-4 && Math.abs(onFloor[0]) < ROOM.half && onFloor[2] > ROOM.wallZ
    && onFloor[2] < ROOM.wallZ + 2 * ROOM.half) take(floor, 'floor', () => [0, 1, 0]);
  if (wall > 1e-4 && Math.abs(onWall[0]) < ROOM.half && onWall[1] > 0
    && onWall[1] < ROOM.wallHeight) take(wall, 'wall', () => [0, 0, 1]);
  take(hitSphere(origin, direction, SPHERE), 'sphere',
    (p) => normalised(add(p, SPHERE.centre, -1)));
  take(hitBox(origin, direction, BOX), 'box', (p) => boxNormal(p, BOX));
  const onMesh = ROOM.mesh && hitMesh(origin, direction, ROOM.mesh, best.distance);
  if (onMesh)
    return { name: 'mesh', p: add(origin, direction, onMesh.distance), distance: onMesh.distance,
      ...meshNormals(onMesh, direction, ROOM.mesh) };
  if (best.distance === Infinity) return null;
  const n = best.normal(best.p);
  return { name: best.name, p: best.p, n, facet: n, distance: best.distance };
}

// SHADOW_RAYS x SHADOW_RAYS points on F of a lamp with these axes.
function pointsOnF(volume, lamp, axes) {
  const [mx, my, hx, hy] = volume.onF;
  const at = (k) => (2 * k + 1) / SHADOW_RAYS - 1;
  return Array.from({ length: SHADOW_RAYS ** 2 }, (_, k) => add(lamp.position, fromLamp(axes,
    [mx + at(k % SHADOW_RAYS) * hx, my + at(Math.floor(k / SHADOW_RAYS)) * hy, 0])));
}

// The share of the points on F that a place of the room sees. Of the mesh, as of the box, points behind
// the horizon are left to the irradiance.
function visibleShare(volume, lamp, { p, n, facet, name }) {
  const points = pointsOnF(volume, lamp, lampAxes(lamp));
  const seen = points.filter((point) => {
    const to = add(point, p, -1), distance = Math.hypot(...to), direction = to.map((k) => k / distance);
    if (name !== 'sphere' && hitSphere(p, direction, SPHERE) < distance) return false;
    if (name !== 'box' && hitBox(p, direction, BOX) < distance) return false;
    if (!ROOM.mesh || (name === 'mesh' && Math.min(dot(n, to), dot(facet, to)) <= 0)) return true;
    return !hitMesh(p, direction, ROOM.mesh, distance);
  });
  return seen.length / points.length;
}

// The reading at a place of the room: illuminance by all lamps, by how much it may be off, and what
// point lamps would give.
function readingAt(volume, lamps, hit) {
  const { p, n } = hit;
  const reading = { illuminance: 0, uncertainty: 0, farField: 0, shadowed: false, estimate: false };
  for (const lamp of lamps) {
    const axes = lampAxes(lamp);
    const inLamp = toLamp(axes, add(p, lamp.position, -1)), normal = toLamp(axes, n);
    const before = volume.cornersBefore(inLamp, normal);
    if (inLamp[2] <= 0 || before === 0) continue;
    const share = visibleShare(volume, lamp, hit);
    const scale = share * lamp.level;
    reading.illuminance += scale * Math.max(0, volume.illuminance(inLamp, normal));
    reading.farField += scale * volume.illuminance(inLamp, normal, true);
    reading.uncertainty += scale * volume.uncertainty(inLamp, normal);
    reading.shadowed ||= share < 1;
    reading.estimate ||= (share > 0 && share < 1) || before < 4 || Number.isNaN(reading.uncertainty);
  }
  return reading;
}
