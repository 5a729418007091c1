// A mesh that is dropped in: a Wavefront .obj file as triangles that stand on the floor, and what rays
// hit of them. Metres; its triangles are about the middle of its box, which lies at `position`.

const MESH_LIMITS = { bytes: 20e6, triangles: 50000, least: 0.05, most: 1.5, height: 0.6 };
const MESH_PLACE = [0, -0.7];  // x and z of the room where it is dropped
const LEAF_TRIANGLES = 4;

// ---- the file: refused by an Error of one sentence ----

const zUpToYUp = ([x, y, z]) => [x, z, -y];

function readVector(words, line, what) {
  const vector = words.slice(1, 4).map(Number);
  if (vector.length < 3 || !vector.every(Number.isFinite))
    throw new Error(`line ${line} holds no three finite numbers of a ${what}`);
  return vector;
}

// The element that a one-based or negative index of the file means.
function readIndex(word, count, line, what) {
  const index = Number(word), at = index < 0 ? count + index : index - 1;
  if (!Number.isInteger(index) || at < 0 || at >= count)
    throw new Error(`line ${line} asks for ${what} ${word} of ${count}`);
  return at;
}

// { places, normals, corners }: corners are three to a triangle, [place, normal or -1]; polygons are
// cut into fans.
function readObj(text) {
  const places = [], normals = [], corners = [];
  text.replace(/\\\r?\n/g, ' ').split('\n').forEach((row, k) => {
    const words = row.trim().split(/\s+/), line = k + 1;
    if (words[0] === 'v') places.push(readVector(words, line, 'vertex'));
    if (words[0] === 'vn') normals.push(readVector(words, line, 'normal'));
    if (words[0] !== 'f') return;
    const face = words.slice(1).map((word) => {
      const [place, , normal] = word.split('/');
      return [readIndex(place, places.length, line, 'vertex'),
        normal ? readIndex(normal, normals.length, line, 'normal') : -1];
    });
    if (face.length < 3) throw new Error(`the face of line ${line} has fewer than 3 corners`);
    for (let last = 2; last < face.length; ++last) corners.push(face[0], face[last - 1], face[last]);
    if (corners.length > 3 * MESH_LIMITS.triangles)
      throw new Error(`it has more than ${MESH_LIMITS.triangles} triangles`);
  });
  if (corners.length === 0) throw new Error('it has no faces; a Wavefront .obj file with faces is asked for');
  return { places, normals, corners };
}

function boundsOf(places) {
  const lo = [Infinity, Infinity, Infinity], hi = [-Infinity, -Infinity, -Infinity];
  for (const p of places)
    for (let k = 0; k < 3; ++k) {
      lo[k] = Math.min(lo[k], p[k]);
      hi[k] = Math.max(hi[k], p[k]);
    }
  return { lo, hi };
}

// By how much it is scaled: to a height of 0.6 m where its longest side is below 5 cm or above 1.5 m,
// to no longer side than 1.5 m.
function meshScale(sides) {
  const longest = Math.max(...sides);
  if (!(longest > 1e-9 && longest < 1e9))
    throw new Error(`its longest side is ${longest} m; from 1e-9 to 1e9 m can be shown`);
  if (longest >= MESH_LIMITS.least && longest <= MESH_LIMITS.most) return 1;
  return Math.min(MESH_LIMITS.height / sides[1], MESH_LIMITS.most / longest);
}

// The mesh of a file's text: { name, position, half, radius, scale, count, places, facets, smooths,
// nodes }. `places`, `facets` and `smooths` hold nine numbers a triangle: corners, the normal of its
// plane and the normals at its corners, those of the file where it has them.
function makeMesh(text, name, { zUp = false, at = MESH_PLACE } = {}) {
  if (text.length > MESH_LIMITS.bytes) throw new Error('it is larger than 20 MB');
  const file = readObj(text), turned = zUp ? zUpToYUp : (v) => v;
  const used = file.corners.map(([place]) => turned(file.places[place]));
  const { lo, hi } = boundsOf(used), sides = add(hi, lo, -1), scale = meshScale(sides);
  const middle = add(lo, sides, 0.5), half = sides.map((side) => 0.5 * scale * side);
  const places = [], facets = [], smooths = [];
  for (let k = 0; k < used.length; k += 3) {
    const [a, b, c] = used.slice(k, k + 3).map((p) => add(p, middle, -1).map((x) => scale * x));
    const across = cross(add(b, a, -1), add(c, a, -1)), size = Math.hypot(...across);
    if (!(size > 0)) continue;  // of no area
    const facet = across.map((x) => x / size);
    places.push(...a, ...b, ...c);
    for (const [, normal] of file.corners.slice(k, k + 3)) {
      const given = normal < 0 ? [0, 0, 0] : turned(file.normals[normal]);
      facets.push(...facet);
      smooths.push(...(Math.hypot(...given) > 0 ? normalised(given) : facet));
    }
  }
  if (places.length === 0) throw new Error('none of its faces has an area');
  const mesh = { name, scale, half, radius: Math.hypot(...half), count: places.length / 9, places, facets,
    smooths, position: [at[0], Math.max(half[1], 1e-3), at[1]] };
  mesh.nodes = meshTree(mesh);
  return mesh;
}

// ---- rays ----

// A tree of boxes over triangles, halved along the longest side of their middles: { lo, hi, first,
// second } or, of a leaf, { lo, hi, triangles }.
function meshTree({ places, count }) {
  const corner = (k) => places.slice(3 * k, 3 * k + 3);
  const middles = Array.from({ length: count }, (_, t) =>
    add(add(corner(3 * t), corner(3 * t + 1)), corner(3 * t + 2)));
  const node = (triangles) => {
    const box = boundsOf(triangles.flatMap((t) => [corner(3 * t), corner(3 * t + 1), corner(3 * t + 2)]));
    if (triangles.length <= LEAF_TRIANGLES) return { ...box, triangles };
    const { lo, hi } = boundsOf(triangles.map((t) => middles[t])), sides = add(hi, lo, -1);
    const axis = sides.indexOf(Math.max(...sides)), cut = triangles.length >> 1;
    triangles.sort((a, b) => middles[a][axis] - middles[b][axis]);
    return { ...box, first: node(triangles.slice(0, cut)), second: node(triangles.slice(cut)) };
  };
  return node(Array.from({ length: count }, (_, t) => t));
}

function meetsBox(origin, direction, { lo, hi }, most) {
  const [near, far] = spanInBox(origin, direction, lo, hi);
  return Math.max(near, 0) <= Math.min(far, most) * (1 + 1e-12) + 1e-12;
}

// Distance and weights of the second and third corner (Moeller and Trumbore 1997), or null.
function hitTriangle(origin, direction, places, t) {
  const corner = (k) => [places[9 * t + 3 * k], places[9 * t + 3 * k + 1], places[9 * t + 3 * k + 2]];
  const a = corner(0), u = add(corner(1), a, -1), v = add(corner(2), a, -1);
  const p = cross(direction, v), from = add(origin, a, -1), scale = 1 / dot(u, p);
  const b = scale * dot(from, p), q = cross(from, u), c = scale * dot(direction, q);
  const distance = scale * dot(v, q);
  return b >= 0 && c >= 0 && b + c <= 1 && distance > 1e-4 ? { distance, b, c } : null;
}

// The nearest hit before `most`: { distance, triangle, b, c }, or null.
function hitMesh(origin, direction, mesh, most = Infinity) {
  const from = add(origin, mesh.position, -1), open = [mesh.nodes];
  let best = null;
  while (open.length > 0) {
    const node = open.pop();
    if (!meetsBox(from, direction, node, best ? best.distance : most)) continue;
    if (!node.triangles) open.push(node.first, node.second);
    for (const triangle of node.triangles || []) {
      const hit = hitTriangle(from, direction, mesh.places, triangle);
      if (hit && hit.distance < (best ? best.distance : most)) best = { ...hit, triangle };
    }
  }
  return best;
}

// The normals of a hit, { facet, n }, on the side that the ray comes from; n is that of the light.
function meshNormals({ triangle, b, c }, direction, { facets, smooths }) {
  const at = (list, k) => list.slice(9 * triangle + 3 * k, 9 * triangle + 3 * k + 3);
  const towards = (v, w) => (dot(v, w) < 0 ? v.map((x) => -x) : v);
  const facet = towards(at(facets, 0), direction.map((x) => -x));
  const smooth = add(at(smooths, 0).map((x) => (1 - b - c) * x), add(at(smooths, 1).map((x) => b * x),
    at(smooths, 2), c));
  return { facet, n: Math.hypot(...smooth) > 1e-6 ? towards(normalised(smooth), facet) : facet };
}
