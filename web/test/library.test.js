// node --test: readers of LUXFIELD_light_field by the vectors of web/vectors/.

import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { deflateSync } from 'node:zlib';
import { LUMINANCE, chunksOfGlb, lightShader, texelsOf, volumesOfGlb } from '../lib/index.js';

const at = (name) => new URL(`../vectors/${name}`, import.meta.url);
const glb = await readFile(at('lamp.glb'));
const vectors = JSON.parse(await readFile(at('vectors.json'), 'utf8'));
const [volume] = await volumesOfGlb(glb);

// Coefficients are float32: 6e-8 of each of the 64 that are summed.
const largest = Math.max(...volume.tables.map(({ coefficients }) => coefficients.reduce(
  (most, x) => Math.max(most, Math.abs(x)), 0)));
const near = (found, expected, unit, where) =>
  assert.ok(Math.abs(found - expected) <= 1e-6 * unit, `${where}: ${found} and not ${expected}`);

test('codes become coefficients', () => {
  assert.equal(volume.tables.length, vectors.codes.length);
  const { json } = chunksOfGlb(glb);
  volume.tables.forEach(({ coefficients }, k) => {
    const { count, first, last } = vectors.codes[k];
    const { knees, steps } = json.extensions.LUXFIELD_light_field.lights[0].tables[k];
    assert.equal(coefficients.length, count);
    const check = (codes, from, component) => codes.forEach((code, i) => {
      const expected = knees[component] * Math.sinh(steps[component] * code);
      near(coefficients[from + i], expected, Math.abs(expected), `table ${k}, ${from + i}`);
    });
    check(first, 0, 0);
    check(last, count - last.length, knees.length - 1);
  });
});

test('the light vector and illuminance', () => {
  let lit = 0;
  for (const { p, n, light_vector: expected, illuminance } of vectors.receivers) {
    const scale = p[2] >= volume.delta ? (volume.delta / p[2]) ** 2 : 1;
    const j = volume.lightVector(p);
    j.forEach((x, k) => near(x, expected[k], scale * largest, `J of ${p}`));
    near(volume.illuminance(p, n), illuminance, scale * largest, `E at ${p}`);
    lit += expected.some((x) => x !== 0);
  }
  assert.ok(lit > 30, 'most receivers are to be in the light');
});

test('the far field is the limit of great distances', () => {
  const p = [400, 300, 4000], [, , z] = p;
  const far = volume.farFieldLightVector(p), exact = volume.lightVector(p);
  const unit = (volume.delta / z) ** 2 * largest;
  far.forEach((x, k) => assert.ok(Math.abs(x - exact[k]) < 1e-3 * unit, `${x} and ${exact[k]}`));
});

test('texels are the coefficients, scaled', () => {
  const table = volume.tables[1], { texels, scale } = texelsOf(table, 2);
  for (const k of [0, 7, table.count - 1])
    for (const c of [0, 1, 2])
      near(texels[4 * k + c] / scale, table.coefficients[(6 + c) * table.count + k], largest, `texel ${k}`);
  const shader = lightShader(volume, Array(12).fill(scale));
  assert.match(shader, /uniform sampler3D u_table_11;/);
  assert.doesNotMatch(shader, /LOOK_UP|undefined|NaN/);
  assert.equal(LUMINANCE.length, 3);
});

test('what is no lamp is refused', async () => {
  await assert.rejects(volumesOfGlb(glb.subarray(0, 3000)), /no whole binary glTF/);
  const other = Buffer.from(glb);
  other.set(Buffer.from('luxfield lamp voluMe'), other.indexOf('luxfield lamp volume'));
  await assert.rejects(volumesOfGlb(other), /voluMe/);
});

// A binary glTF file of that JSON and those bytes.
function glbOf(json, binary) {
  const text = Buffer.from(JSON.stringify(json));
  const chunk = (kind, bytes) => {
    const head = Buffer.alloc(8);
    head.writeUInt32LE(bytes.length, 0);
    head.writeUInt32LE(kind, 4);
    return Buffer.concat([head, bytes]);
  };
  const head = Buffer.alloc(12);
  const body = Buffer.concat([chunk(0x4e4f534a, text), chunk(0x004e4942, binary)]);
  [0x46546c67, 2, 12 + body.length].forEach((number, k) => head.writeUInt32LE(number, 4 * k));
  return Buffer.concat([head, body]);
}

const lightOf = (json) => json.extensions.LUXFIELD_light_field.lights[0];

test('a stream longer than its table states is read no further', async () => {
  const { json } = chunksOfGlb(glb);
  const bomb = deflateSync(Buffer.alloc(400 << 20)); // 400 kB
  json.bufferViews[lightOf(json).tables[0].bufferView] = { buffer: 0, byteOffset: 0, byteLength: bomb.length };
  const folder = await mkdtemp(join(tmpdir(), 'luxfield-bomb-'));
  try {
    const file = join(folder, 'bomb.glb');
    await writeFile(file, glbOf(json, bomb));
    const program = `
      import { readFileSync } from 'node:fs';
      import { volumesOfGlb } from ${JSON.stringify(new URL('../lib/index.js', import.meta.url).href)};
      const problem = await volumesOfGlb(readFileSync(${JSON.stringify(file)})).then(() => 'none', (e) => e.message);
      console.log(JSON.stringify({ problem, kilobytes: process.resourceUsage().maxRSS }));`;
    const { stdout, stderr } = spawnSync(process.execPath, ['--input-type=module', '-e', program]);
    const { problem, kilobytes } = JSON.parse(stdout.toString() || `{"problem": ${JSON.stringify(stderr.toString())}}`);
    assert.match(problem, /^LUXFIELD_light_field: tables\[0\]: the codes are no zlib stream of the \d+ bytes/);
    assert.ok(kilobytes < 200 << 10, `${kilobytes} kB`);
  } finally {
    await rm(folder, { recursive: true });
  }
});

test('tables that state too many codes are refused before anything is unpacked', async () => {
  const { json, binary } = chunksOfGlb(glb);
  lightOf(json).tables[1].nodes = [4096, 4096, 4096];
  await assert.rejects(volumesOfGlb(glbOf(json, binary)), /tables\[1\]\.nodes must be so few/);
  const many = chunksOfGlb(glb);
  lightOf(many.json).tables = Array(100).fill({ ...lightOf(many.json).tables[0], nodes: [64, 64, 8] });
  await assert.rejects(volumesOfGlb(glbOf(many.json, many.binary)), /nodes must be so few/);
});

// Every value of the lamp's JSON replaced by each of these, one at a time, and files cut short: the
// reader takes them or says what is wrong in words of its own.
test('whatever is wrong is said in a sentence', async () => {
  const { json, binary } = chunksOfGlb(glb);
  const values = [null, -1, 0, 0.5, 1e300, '', 'x', [], [1], {}, true, 2 ** 31];
  const places = [];
  const walk = (node, path) => {
    if (node === null || typeof node !== 'object') return;
    for (const key of Object.keys(node)) {
      places.push([...path, key]);
      walk(node[key], [...path, key]);
    }
  };
  walk({ bufferViews: json.bufferViews, extensions: json.extensions }, []);
  let refused = 0;
  const tryFile = async (file, what) => {
    try {
      const [lamp] = await volumesOfGlb(file);
      lamp?.uncertainty([0.1, 0, 2], [0, 0, -1]);
    } catch (problem) {
      ++refused;
      assert.equal(problem.constructor, Error, `${what}: ${problem.stack}`);
      assert.match(problem.message, /glTF|LUXFIELD_light_field/, what);
    }
  };
  for (const path of places.filter((_, k) => k % 3 === 0))
    for (const value of values) {
      const spoilt = JSON.parse(JSON.stringify(json));
      path.slice(0, -1).reduce((node, key) => node[key], spoilt)[path.at(-1)] = value;
      await tryFile(glbOf(spoilt, binary), `${path.join('.')} = ${JSON.stringify(value)}`);
    }
  for (let length = 0; length < binary.length; length += 97)
    await tryFile(glbOf(json, binary.subarray(0, length)), `${length} bytes`);
  assert.ok(refused > places.length, `${refused} were refused`);
});

// three.js where it is installed (./run foreign): the file by GLTFLoader.
const three = process.env.LUXFIELD_THREE;
const skip = three ? false : 'LUXFIELD_THREE names no folder with three';
test('three.js loads the lamp', { skip }, async () => {
  const { mkdir, cp, symlink } = await import('node:fs/promises');
  const { pathToFileURL, fileURLToPath } = await import('node:url');
  const folder = await mkdtemp(join(tmpdir(), 'luxfield-three-'));
  try {
    await mkdir(join(folder, 'node_modules'));
    await symlink(three, join(folder, 'node_modules/three'));
    await cp(fileURLToPath(new URL('../lib', import.meta.url)), join(folder, 'lib'), { recursive: true });
    await cp(fileURLToPath(new URL('../package.json', import.meta.url)), join(folder, 'package.json'));
    const { GLTFLoader } = await import(pathToFileURL(join(three, 'examples/jsm/loaders/GLTFLoader.js')));
    const { LuxfieldLightPlugin } = await import(pathToFileURL(join(folder, 'lib/luxfield_light.js')));
    const { Group, Mesh, MeshBasicMaterial, MeshStandardMaterial, Vector3 } =
      await import(pathToFileURL(join(three, 'build/three.module.js')));
    globalThis.self ??= globalThis;
    const loader = new GLTFLoader();
    loader.register((parser) => new LuxfieldLightPlugin(parser));
    const { scene } = await loader.parseAsync(
      glb.buffer.slice(glb.byteOffset, glb.byteOffset + glb.length), '');
    const lamp = scene.getObjectByProperty('isLuxfieldLight', true);
    assert.ok(lamp);
    // Turned and moved: the node's (X, Y, Z) is (x, -y, -z) of the lamp.
    const stand = new Group().add(scene);
    stand.position.set(1, 2, 3);
    stand.rotation.set(0, Math.PI / 2, 0);
    for (const { p, n, illuminance } of vectors.receivers.slice(7, 30)) {
      const world = ([x, y, z]) => new Vector3(x, -y, -z).applyEuler(stand.rotation);
      near(lamp.illuminance(world(p).add(stand.position), world(n)), illuminance, 10 * largest,
        `three at ${p}`);
    }
    const material = new MeshStandardMaterial(), shown = new MeshBasicMaterial(), { onBeforeCompile } = shown;
    lamp.illuminateAll(new Group().add(new Mesh(undefined, [material, shown]),
      new Mesh(undefined, material)));
    assert.equal(shown.onBeforeCompile, onBeforeCompile);
    const shader = { uniforms: {}, vertexShader: 'void main() {\n#include <project_vertex>\n}',
      fragmentShader: 'void main() {\n#include <lights_fragment_begin>\n}' };
    material.onBeforeCompile(shader, null);
    assert.match(shader.fragmentShader, /luxfield_\d+_light_vector\(place, false\)/);
    assert.match(shader.vertexShader, /v_luxfield_place = /);
    assert.equal(shader.fragmentShader.split(`uniform mat4 ${lamp.prefix}from_world`).length, 2, 'lit once');
  } finally {
    await rm(folder, { recursive: true });
  }
});
