// node --test: readers of LUXFIELD_light_field by the vectors of web/vectors/.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
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

// three.js where it is installed (./run foreign): the file by GLTFLoader.
const three = process.env.LUXFIELD_THREE;
const skip = three ? false : 'LUXFIELD_THREE names no folder with three';
test('three.js loads the lamp', { skip }, async () => {
  const { mkdtemp, mkdir, cp, symlink, rm } = await import('node:fs/promises');
  const { tmpdir } = await import('node:os');
  const { join } = await import('node:path');
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
