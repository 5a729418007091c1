// The irradiance at receivers that a texture holds, places in row 0 and normals in row 1: what
// compares the shader with volume.js.

uniform sampler2D u_receivers;
out vec4 result;

void main() {
  int k = int(gl_FragCoord.x);
  vec3 p = texelFetch(u_receivers, ivec2(k, 0), 0).xyz, n = texelFetch(u_receivers, ivec2(k, 1), 0).xyz;
  result = vec4(irradiance(p, n, false), 1.0);
}
