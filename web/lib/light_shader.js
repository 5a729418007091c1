// The light vector by the volume's tables in GLSL ES 3.00, as volume.js computes it (docs/web.md): the
// texels of 3-D textures, and functions over them,
//
//   mat3 light_vector(vec3 p, bool far_field)      J(p) of each channel, the columns
//   bool is_before(vec3 p, vec3 n)                 whether the lamp is before the surface's horizon
//   vec3 irradiance(vec3 p, vec3 n, bool far_field)
//
// in the luminaire's frame, metres. Uniforms: u_delta, u_on_f, u_on_i, and a sampler3D u_table_0,
// u_table_1 ... for each channel of each table, with linear interpolation and clamped edges.

const TEXTURE_PEAK = 1000; // the largest coefficient in a texture: far from both ends of half floats

const glslFloat = (x) => (Number.isInteger(x) ? `${x}.0` : `${x}`);

// One channel of a table, (K_x, K_y, K_z, 0) times `scale`, x fastest; its size is nodes + 2.
export function texelsOf(table, channel) {
  const first = 3 * channel * table.count;
  let peak = 0;
  for (let k = first; k < first + 3 * table.count; ++k)
    peak = Math.max(peak, Math.abs(table.coefficients[k]));
  const scale = peak > 0 ? TEXTURE_PEAK / peak : 1;
  const texels = new Float32Array(4 * table.count);
  for (let k = 0; k < table.count; ++k)
    for (let c = 0; c < 3; ++c)
      texels[4 * k + c] = scale * table.coefficients[first + c * table.count + k];
  return { texels, scale };
}

// The source for a volume; `scales` are those of texelsOf, of each channel of the first table, then of
// the second and so on.
export function lightShader(volume, scales) {
  const samplers = scales.map((scale, k) => `uniform sampler3D u_table_${k};\n`).join('');
  let choice = 'mat3 look_up(bool front, float w, vec2 x) {\n';
  volume.tables.forEach((table, k) => {
    const [nx, ny, nw] = table.nodes.map(glslFloat), first = glslFloat(table.first);
    const of = (channel) => {
      const number = volume.channels * k + channel;
      return `${glslFloat(1 / scales[number])} * spline(u_table_${number}, vec3(${nx}, ${ny}, ${nw}), at)`;
    };
    choice += `  if (front == ${table.front} && w >= ${first} && w <= ${glslFloat(table.last)}) {\n`
      + `    vec3 at = vec3(x * vec2(${nx} - 1.0, ${ny} - 1.0), (w - ${first})`
      + ` * ${glslFloat((table.nodes[2] - 1) / (table.last - table.first))});\n`
      + (volume.channels === 1 ? `    vec3 k = ${of(0)};\n    return mat3(k, k, k);\n`
        : `    return mat3(${of(0)}, ${of(1)}, ${of(2)});\n`) + '  }\n';
  });
  return LIGHT_GLSL.replace('//LOOK_UP', `${samplers}${choice}  return mat3(0.0);\n}`);
}

const LIGHT_GLSL = `
uniform float u_delta;
uniform vec4 u_on_f;  // middle, half sides
uniform vec4 u_on_i;

// A tricubic spline by eight trilinear fetches (Sigg and Hadwiger 2005). x counts nodes.
vec3 spline(sampler3D table, vec3 nodes, vec3 x) {
  vec3 cell = clamp(floor(x), vec3(0.0), nodes - 2.0);
  vec3 f = x - cell, g = 1.0 - f;
  vec3 w0 = g * g * g / 6.0, w1 = 2.0 / 3.0 - f * f * (1.0 - 0.5 * f);
  vec3 w2 = 2.0 / 3.0 - g * g * (1.0 - 0.5 * g), w3 = f * f * f / 6.0;
  vec3 lo = w0 + w1, hi = w2 + w3;
  vec3 a = (cell + w1 / lo + 0.5) / (nodes + 2.0), b = (cell + w3 / hi + 2.5) / (nodes + 2.0);
  vec3 near = lo.y * (lo.x * texture(table, a).xyz + hi.x * texture(table, vec3(b.x, a.yz)).xyz)
            + hi.y * (lo.x * texture(table, vec3(a.x, b.y, a.z)).xyz
                      + hi.x * texture(table, vec3(b.xy, a.z)).xyz);
  vec3 far = lo.y * (lo.x * texture(table, vec3(a.xy, b.z)).xyz
                     + hi.x * texture(table, vec3(b.x, a.y, b.z)).xyz)
           + hi.y * (lo.x * texture(table, vec3(a.x, b.yz)).xyz + hi.x * texture(table, b).xyz);
  return lo.z * near + hi.z * far;
}

//LOOK_UP

// J(p) of each channel, luminaire's frame: the columns.
mat3 light_vector(vec3 p, bool far_field) {
  if (p.z <= 0.0) return mat3(0.0);
  bool front = far_field || p.z >= u_delta;
  float w = front ? u_delta / p.z : p.z / u_delta;
  float scale = front ? w : 1.0;
  vec2 at = scale * (far_field ? p.xy - u_on_f.xy : p.xy);
  if (far_field) w = 0.0;
  vec2 middle = front ? u_on_i.xy - (1.0 - w) * u_on_f.xy : w * u_on_i.xy + (1.0 - w) * u_on_f.xy;
  vec2 half_side = (front ? 1.0 : w) * u_on_i.zw + (1.0 - w) * u_on_f.zw;
  vec2 q = (at - middle) / half_side;
  if (any(greaterThan(abs(q), vec2(1.0)))) return mat3(0.0);
  return scale * scale * look_up(front, w, 0.5 * (q + 1.0));
}

// Whether any of F lies before the horizon of a surface.
bool is_before(vec3 p, vec3 n) {
  vec2 reach = abs(n.xy) * u_on_f.zw;
  return dot(n.xy, u_on_f.xy - p.xy) - n.z * p.z + reach.x + reach.y >= 0.0;
}

// n . J of each channel; 0 where all of F is behind the horizon.
vec3 irradiance(vec3 p, vec3 n, bool far_field) {
  return is_before(p, n) ? n * light_vector(p, far_field) : vec3(0.0);
}
`;
