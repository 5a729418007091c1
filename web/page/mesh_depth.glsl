// A mesh as a point on F sees it, in the lamp's axes: what mesh_shadow.glsl looks up.

uniform vec3 u_centre;
uniform vec3 u_from;           // the point on F
uniform mat3 u_axes;           // of the lamp: columns u, v, z
uniform vec4 u_window;
uniform vec2 u_depth;
layout(location = 0) in vec3 a_place;

void main() {
  vec3 to = (u_centre + a_place - u_from) * u_axes;
  vec2 at = to.xy * u_window.xy + to.z * u_window.zw;
  gl_Position = vec4(2.0 * at - to.z, 2.0 * (u_depth.x * to.z + u_depth.y) - to.z, to.z);
}
