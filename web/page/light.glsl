// The light vector by the volume's tables, as volume.js does it (docs/web.md). The tables' samplers
// and lookUp() are written by renderer.js, which knows how many there are.

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

// n . J of each channel; 0 where all of F is behind the horizon.
vec3 irradiance(vec3 p, vec3 n, bool far_field) {
  vec2 reach = abs(n.xy) * u_on_f.zw;
  if (dot(n.xy, u_on_f.xy - p.xy) - n.z * p.z + reach.x + reach.y < 0.0) return vec3(0.0);
  return n * light_vector(p, far_field);
}
