// Measured lamps by their light-vector tables: see README.md. The class for three.js is in
// 'luxfield-light/three', so that this module needs no library.
export { LUMINANCE, LampVolume } from './volume.js';
export { EXTENSION, chunksOfGlb, decodeLight, volumesOfGlb } from './gltf.js';
export { lightShader, texelsOf } from './light_shader.js';
