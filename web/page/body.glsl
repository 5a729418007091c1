// What is drawn about the room's surfaces: a box far away as the backdrop, and the lamps' bodies, which
// hide half of what lies behind them, so that their light is seen where they stand close.

uniform vec3 u_eye;
uniform float u_glow;  // of a lamp's face, 0 to 1; below 0 of the backdrop
in vec3 v_place;
flat in vec4 v_facing;
out vec4 colour;

void main() {
  if (u_glow < 0.0) {
    float down = 0.5 - normalize(v_place - u_eye).y;
    colour = vec4(mix(vec3(0.91, 0.925, 0.94), vec3(0.80, 0.83, 0.86), clamp(down, 0.0, 1.0)), 1.0);
  } else {
    vec3 face = mix(vec3(0.55), vec3(1.0, 0.97, 0.85), u_glow);
    colour = vec4(v_facing.z > 0.0 ? face : vec3(0.24, 0.27, 0.31), 0.6);
  }
}
