// A corner of what is drawn: of the room as it stands, or of a unit cube that is a box with these axes.

uniform vec3 u_centre;
uniform mat3 u_axes;           // columns; of unit length
uniform vec3 u_half;           // half sides along them
uniform vec3 u_eye;
uniform mat3 u_view;           // columns: right, up, back
uniform vec2 u_tangent;        // of half the field of view: sideways, upwards
layout(location = 0) in vec3 a_place;
layout(location = 1) in vec4 a_facing;  // normal, and which surface it is
out vec3 v_place;
flat out vec4 v_facing;
#ifdef ON_MESH
layout(location = 2) in vec3 a_smooth;
out vec3 v_smooth;
#endif

void main() {
  v_place = u_centre + u_axes * (u_half * a_place);
  v_facing = a_facing;
#ifdef ON_MESH
  v_smooth = a_smooth;
#endif
  vec3 seen = (v_place - u_eye) * u_view;
  gl_Position = vec4(seen.xy / u_tangent, DEPTH.x * seen.z + DEPTH.y, -seen.z);
}
