// A measured lamp as a light of three.js (release 157 or later). Its near field lights the diffuse part
// of Lambert, Phong, Toon, Standard and Physical materials exactly, within the tables' stated error, at
// any distance; highlights are those of a light in the mean direction. It throws no shadows.

import { ClampToEdgeWrapping, Data3DTexture, DataUtils, HalfFloatType, LinearFilter, Matrix4, Object3D,
  Quaternion, RGBAFormat, Vector3, Vector4 } from 'three';
import { EXTENSION, decodeLight } from './gltf.js';
import { lightShader, texelsOf } from './light_shader.js';

// A lamp shines along -z of its node: x = X, y = -Y, z = -Z (docs/formats/gltf-light-field.md).
const LAMP_FROM_NODE = new Matrix4().makeScale(1, -1, -1);
const GLOBALS = /\b(u_delta|u_on_f|u_on_i|u_table_\d+|spline|look_up|light_vector|is_before|irradiance)\b/g;

let made = 0;

function textureOf({ texels }, nodes) {
  const halves = Uint16Array.from(texels, (x) => DataUtils.toHalfFloat(x));
  const texture = new Data3DTexture(halves, ...nodes.map((n) => n + 2));
  Object.assign(texture, { format: RGBAFormat, type: HalfFloatType, minFilter: LinearFilter,
    magFilter: LinearFilter, wrapS: ClampToEdgeWrapping, wrapT: ClampToEdgeWrapping,
    wrapR: ClampToEdgeWrapping, unpackAlignment: 1, needsUpdate: true });
  return texture;
}

const isLit = (material) => material.isMeshLambertMaterial || material.isMeshPhongMaterial
  || material.isMeshToonMaterial || material.isMeshStandardMaterial;

export class LuxfieldLight extends Object3D {
  // `volume` is a LampVolume; `level` dims it.
  constructor(volume, level = 1) {
    super();
    this.isLuxfieldLight = true;
    this.type = 'LuxfieldLight';
    this.volume = volume;
    this.prefix = `luxfield_${made++}_`;
    const packed = volume.tables.flatMap((table) => Array.from({ length: volume.channels },
      (_, channel) => ({ ...texelsOf(table, channel), nodes: table.nodes })));
    this.textures = packed.map((one) => textureOf(one, one.nodes));
    this.shader = lightShader(volume, packed.map(({ scale }) => scale));
    this.uniforms = { u_delta: { value: volume.delta }, u_on_f: { value: new Vector4(...volume.onF) },
      u_on_i: { value: new Vector4(...volume.onI) }, level: { value: level },
      from_world: { value: new Matrix4() } };
    this.textures.forEach((value, k) => { this.uniforms[`u_table_${k}`] = { value }; });
    this.visibleLevel = level;
  }

  get level() { return this.visibleLevel; }

  set level(value) {
    this.visibleLevel = value;
    this.uniforms.level.value = value;
  }

  // Places and turns, and leaves scale out.
  updateMatrixWorld(force) {
    super.updateMatrixWorld(force);
    const place = new Vector3(), turn = new Quaternion(), scale = new Vector3();
    this.matrixWorld.decompose(place, turn, scale);
    this.uniforms.from_world.value.compose(place, turn, scale.set(1, 1, 1)).invert()
      .premultiply(LAMP_FROM_NODE);
  }

  // In lx at a place of the world with that unit normal, Vector3 both; what the shader computes.
  illuminance(place, normal) {
    this.updateWorldMatrix(true, false);
    this.updateMatrixWorld();
    const fromWorld = this.uniforms.from_world.value;
    const p = place.clone().applyMatrix4(fromWorld), n = normal.clone().transformDirection(fromWorld);
    return this.level * this.volume.illuminance(p.toArray(), n.toArray());
  }

  // Lights a material from then on. A lamp takes a texture unit for each table and channel, of 16 that
  // every device has: three or four lamps of one channel go together.
  illuminate(material) {
    const before = material.onBeforeCompile, key = material.customProgramCacheKey();
    material.onBeforeCompile = (shader, renderer) => {
      before.call(material, shader, renderer);
      this.extend(shader);
    };
    material.customProgramCacheKey = () => `${key} ${this.prefix}`;
    material.needsUpdate = true;
    return this;
  }

  // Lights every material below an object.
  illuminateAll(root) {
    const materials = new Set();
    root.traverse(({ material }) => [material ?? []].flat().forEach((one) => materials.add(one)));
    materials.forEach((one) => { if (isLit(one)) this.illuminate(one); });
    return this;
  }

  extend(shader) {
    const { prefix } = this, varying = 'v_luxfield_place';
    for (const [name, uniform] of Object.entries(this.uniforms)) shader.uniforms[prefix + name] = uniform;
    if (!shader.vertexShader.includes(varying)) {
      shader.vertexShader = `varying vec3 ${varying};\n${shader.vertexShader}`.replace(
        '#include <project_vertex>', `#include <project_vertex>
        vec4 luxfield_place = vec4(transformed, 1.0);
        #ifdef USE_BATCHING
          luxfield_place = batchingMatrix * luxfield_place;
        #endif
        #ifdef USE_INSTANCING
          luxfield_place = instanceMatrix * luxfield_place;
        #endif
        ${varying} = (modelMatrix * luxfield_place).xyz;`);
      shader.fragmentShader = `varying vec3 ${varying};\n${shader.fragmentShader}`;
    }
    const own = this.shader.replace(GLOBALS, `${prefix}$1`);
    shader.fragmentShader = shader.fragmentShader.replace('void main() {', `precision highp sampler3D;
      ${own}
      uniform mat4 ${prefix}from_world;
      uniform float ${prefix}level;
      void main() {`).replace('#include <lights_fragment_begin>', `#include <lights_fragment_begin>
      {
        vec3 place = (${prefix}from_world * vec4(${varying}, 1.0)).xyz;
        vec3 facing = (${prefix}from_world
          * vec4(inverseTransformDirection(geometryNormal, viewMatrix), 0.0)).xyz;
        mat3 j = ${prefix}is_before(place, facing) ? ${prefix}light_vector(place, false) : mat3(0.0);
        vec3 mean = j[0] + j[1] + j[2];
        float cosine = dot(mean, facing) / max(length(mean), 1e-20);
        if (cosine > 1e-3) {
          IncidentLight lamp;
          lamp.direction = normalize((viewMatrix
            * vec4((transpose(${prefix}from_world) * vec4(mean, 0.0)).xyz, 0.0)).xyz);
          lamp.color = ${prefix}level * max(facing * j, 0.0) / cosine;
          lamp.visible = true;
          RE_Direct(lamp, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal,
            material, reflectedLight);
        }
      }`);
  }

  dispose() { this.textures.forEach((texture) => texture.dispose()); }
}

// For GLTFLoader: loader.register((parser) => new LuxfieldLightPlugin(parser)). Nodes with the extension
// get a LuxfieldLight as a child; lights of KHR_lights_punctual that stand for the same lamp are removed.
export class LuxfieldLightPlugin {
  constructor(parser) {
    this.name = EXTENSION;
    this.parser = parser;
    this.volumes = new Map();
  }

  volume(number) {
    if (!this.volumes.has(number)) {
      const { parser } = this;
      this.volumes.set(number, decodeLight(parser.json.extensions[EXTENSION].lights[number],
        (view) => parser.getDependency('bufferView', view)));
    }
    return this.volumes.get(number);
  }

  createNodeAttachment(nodeIndex) {
    const light = this.parser.json.nodes[nodeIndex].extensions?.[EXTENSION]?.light;
    return light === undefined ? null : this.volume(light).then((volume) => new LuxfieldLight(volume));
  }

  afterRoot({ scenes }) {
    const fallbacks = [];
    for (const scene of scenes)
      scene.traverse((light) => {
        if (!light.isLuxfieldLight) return;
        // A node that is nothing else is the light itself.
        const isNode = this.parser.associations.get(light)?.nodes !== undefined;
        fallbacks.push(...(isNode ? light : light.parent).children.filter(({ isLight }) => isLight));
      });
    fallbacks.forEach((light) => light.removeFromParent());
  }
}
