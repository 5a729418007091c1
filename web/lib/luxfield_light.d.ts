import type { Material, Object3D, Vector3 } from 'three';
import type { LampVolume } from './index.js';

/** A measured lamp, which shines along its -z; scale is not applied. */
export class LuxfieldLight extends Object3D {
  constructor(volume: LampVolume, level?: number);
  readonly isLuxfieldLight: true;
  readonly volume: LampVolume;
  /** Dims the lamp: 1 as measured. */
  level: number;
  /** In lx, at a place of the world with that unit normal. */
  illuminance(place: Vector3, normal: Vector3): number;
  illuminate(material: Material): this;
  illuminateAll(root: Object3D): this;
  dispose(): void;
}

/** `loader.register((parser) => new LuxfieldLightPlugin(parser))` of GLTFLoader. */
export class LuxfieldLightPlugin {
  constructor(parser: object);
  readonly name: string;
}
