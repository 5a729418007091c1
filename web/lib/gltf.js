// Lights of LUXFIELD_light_field in glTF 2.0 (docs/formats/gltf-light-field.md). Needs no page, and no
// library.

import { LampVolume } from './volume.js';

export const EXTENSION = 'LUXFIELD_light_field';

const MOST_LIGHTS = 16; // each of which may take 100 MB while it is read
const GLB_MAGIC = 0x46546c67, JSON_CHUNK = 0x4e4f534a, BIN_CHUNK = 0x004e4942;

// The JSON and the bytes of a binary glTF file, an ArrayBuffer or a view of one.
export function chunksOfGlb(data) {
  const bytes = data instanceof ArrayBuffer ? new Uint8Array(data)
    : new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const isWhole = bytes.length >= 20 && view.getUint32(0, true) === GLB_MAGIC
    && view.getUint32(4, true) === 2 && view.getUint32(8, true) === bytes.length;
  if (!isWhole) throw new Error('this is no whole binary glTF 2.0 file');
  const chunks = {};
  for (let at = 12; at + 8 <= bytes.length;) {
    const length = view.getUint32(at, true), kind = view.getUint32(at + 4, true);
    chunks[kind] ||= bytes.subarray(at + 8, at + 8 + length);
    at += 8 + length;
  }
  if (!chunks[JSON_CHUNK]) throw new Error('this binary glTF file holds no JSON');
  let json;
  try {
    json = JSON.parse(new TextDecoder().decode(chunks[JSON_CHUNK]));
  } catch {
    throw new Error('the JSON of this binary glTF file is damaged');
  }
  return { json, binary: chunks[BIN_CHUNK] || new Uint8Array(0) };
}

// The volume of a light of the root's extension; `bytesOf` gives, or promises, a bufferView's bytes.
export async function decodeLight(light, bytesOf) {
  if (light?.format !== 'luxfield lamp volume' || light.version !== 1)
    throw new Error(`${EXTENSION}: '${light?.format}' of version ${light?.version} is not known here`);
  const tables = Array.isArray(light.tables) ? light.tables : [];
  const packed = new Map();
  for (const table of tables)
    packed.set(table, new Uint8Array(await bytesOf(table?.bufferView)));
  try {
    return await LampVolume.decode(light, (table) => packed.get(table));
  } catch (problem) {
    throw new Error(`${EXTENSION}: ${problem.message}`);
  }
}

// The volumes of all lights of a binary glTF file, in the order of the root's list.
export async function volumesOfGlb(data) {
  const { json, binary } = chunksOfGlb(data);
  const lights = json?.extensions?.[EXTENSION]?.lights ?? [];
  if (!Array.isArray(lights) || lights.length > MOST_LIGHTS)
    throw new Error(`${EXTENSION}: lights must be a list of at most ${MOST_LIGHTS}`);
  const volumes = [];
  for (const light of lights) volumes.push(await decodeLight(light, (number) => bytesOfView(json, binary, number)));
  return volumes;
}

function bytesOfView(json, binary, number) {
  const { byteOffset = 0, byteLength } = json.bufferViews?.[number] ?? {};
  const isWithin = [byteOffset, byteLength].every((n) => Number.isInteger(n) && n >= 0)
    && byteOffset + byteLength <= binary.length;
  if (!isWithin)
    throw new Error(`${EXTENSION}: bufferView ${number} does not lie within this file; it may be cut short`);
  return binary.subarray(byteOffset, byteOffset + byteLength);
}
