/** Three numbers: a place in metres or a unit vector, of the luminaire's frame. */
export type Vector = readonly [number, number, number];

/** Weights of linear Rec. 709 in luminance. */
export const LUMINANCE: readonly number[];

/** The name of the extension of glTF. */
export const EXTENSION: 'LUXFIELD_light_field';

/** A range of heights above the lamp's face, and how far the tables are off there (docs/web.md). */
export interface Zone {
  z_first_m: number;
  z_last_m: number;
  about_image_plane: boolean;
  stated_error: number;
  rel_rmse: number;
  receivers: number;
}

/** A table as JSON states it; its codes are in `codes` (base64) or in `bufferView`. */
export interface StatedTable {
  side: 'front' | 'between';
  first: number;
  last: number;
  nodes: [number, number, number];
  knees: number[];
  steps: number[];
  codes?: string;
  bufferView?: number;
}

/** A lamp as JSON states it: docs/web.md, "The volume". */
export interface StatedLamp {
  format: string;
  version: number;
  delta_m: number;
  channels: 1 | 3;
  unit: string;
  on_f: [number, number, number, number];
  on_i: [number, number, number, number];
  floor_share?: number;
  stated_error?: number;
  zones?: Zone[];
  tables: StatedTable[];
}

/** A decoded table: coefficients in the order [channel][K_x, K_y, K_z][w][y][x]. */
export interface Table {
  front: boolean;
  first: number;
  last: number;
  nodes: [number, number, number];
  count: number;
  coefficients: Float32Array;
}

export class LampVolume {
  static decode(stated: StatedLamp, packed?: (table: StatedTable) => Uint8Array): Promise<LampVolume>;
  readonly delta: number;
  readonly channels: 1 | 3;
  readonly onF: [number, number, number, number];
  readonly onI: [number, number, number, number];
  readonly zones: Zone[];
  readonly tables: Table[];
  /** J(p): three numbers for each channel, lm/m^2. */
  lightVector(p: Vector): Float64Array;
  /** The same of a point lamp with the lamp's intensities. */
  farFieldLightVector(p: Vector): Float64Array;
  /** Illuminance, lx, of a surface with unit normal n; 0 behind its horizon. */
  illuminance(p: Vector, n: Vector, farField?: boolean): number;
  /** By how much `illuminance` may be off, lx; NaN nearer than the tables reach. */
  uncertainty(p: Vector, n: Vector): number;
  /** The stated error of height z, a share. */
  statedErrorAt(z: number): number;
  /** About the largest illuminance at that height, lx. */
  brightestAt(z: number): number;
}

export function chunksOfGlb(data: ArrayBuffer | ArrayBufferView): { json: any; binary: Uint8Array };
export function decodeLight(light: StatedLamp, bytesOf: (bufferView: number) =>
  ArrayBuffer | Uint8Array | Promise<ArrayBuffer | Uint8Array>): Promise<LampVolume>;
/** The lamps of a binary glTF file. */
export function volumesOfGlb(data: ArrayBuffer | ArrayBufferView): Promise<LampVolume[]>;

/** One channel of a table as RGBA texels, times `scale`. */
export function texelsOf(table: Table, channel: number): { texels: Float32Array; scale: number };
/** GLSL ES 3.00 for a volume: `mat3 light_vector(vec3, bool)` and `vec3 irradiance(vec3, vec3, bool)`. */
export function lightShader(volume: LampVolume, scales: number[]): string;
