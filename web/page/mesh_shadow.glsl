// The shadow of a mesh: what SHADOW_RAYS x SHADOW_RAYS points on F of each lamp see of it, as depth maps
// in the lamp's axes (mesh_renderer.js).

uniform vec4 u_mesh_ball;      // about the mesh: centre, radius
uniform highp sampler2DArrayShadow u_maps;
uniform vec4 u_map_window[MAX_LAMPS * SHADOW_RAYS * SHADOW_RAYS];  // of x / z, y / z: scale, offset
uniform vec2 u_map_depth[MAX_LAMPS * SHADOW_RAYS * SHADOW_RAYS];   // of 1, 1 / z

// How much of what a point on F sends to a place passes the mesh. It leads from the point to the place
// by "to", in the lamp's axes; the normal is that of the mesh there, 0 if the place is not on the mesh.
float past_mesh(int map, vec3 to, vec3 normal) {
  vec4 window = u_map_window[map];
  to += normal * (2.0 * to.z / (MAP_SIZE * min(window.x, window.y)));  // two texels: no shadow of its own
  if (to.z <= 0.0) return 1.0;
  vec2 at = to.xy / to.z * window.xy + window.zw;
  if (any(lessThan(at, vec2(0.0))) || any(greaterThan(at, vec2(1.0)))) return 1.0;
  float depth = clamp(dot(u_map_depth[map], vec2(1.0, 1.0 / to.z)), 0.0, 1.0);
  return texture(u_maps, vec4(at, float(map), depth));
}
