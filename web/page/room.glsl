// The surfaces of the room, lit by every lamp's near field, with shadows from points on F (room.js).
// Compiled for what is shown (MODE: 0 picture, 1 false colour, 2 deviation of point lamps), for the
// number of lamps (BY_EACH_LAMP), for flat surfaces, the sphere (ON_SPHERE) or a mesh (ON_MESH), and for
// rooms in which there is a mesh (WITH_MESH, with mesh_shadow.glsl before it): programs without a choice
// in them take a fraction of the time where there is no graphics processor.

uniform vec3 u_eye;
uniform mat3 u_view;           // columns: right, up, back
uniform vec3 u_lamp_place[MAX_LAMPS];
uniform mat3 u_lamp_axes[MAX_LAMPS];  // columns u, v, z
uniform float u_lamp_level[MAX_LAMPS];
uniform bool u_far_field;
uniform float u_exposure;      // 1 / illuminance that shows white
uniform vec2 u_range;          // of false colour, log10 of illuminance
uniform vec3 u_ramp[8];
uniform vec3 u_weights;        // of the channels in luminance
in vec3 v_place;
flat in vec4 v_facing;
#ifdef ON_MESH
in vec3 v_smooth;
#endif
out vec4 colour;

const float FAR = 1e9;

float hit_sphere(vec3 o, vec3 d, vec4 sphere) {
  vec3 to = o - sphere.xyz;
  float b = dot(to, d), root = b * b - dot(to, to) + sphere.w * sphere.w;
  if (root <= 0.0) return FAR;
  float t = -b - sqrt(root);
  return t > 1e-4 ? t : FAR;
}

float hit_box(vec3 o, vec3 d, vec3 centre, vec3 half_side) {
  vec3 inverse = 1.0 / d, middle = (centre - o) * inverse, reach = abs(half_side * inverse);
  vec3 lo = middle - reach, hi = middle + reach;
  float near = max(max(lo.x, lo.y), lo.z), far = min(min(hi.x, hi.y), hi.z);
  return near < far && near > 1e-4 ? near : FAR;
}

// Whether a ball of that radius can come between p and any point of F.
bool in_the_way(vec3 p, vec3 lamp, vec3 ball, float radius) {
  vec3 to = lamp - p, from = ball - p;
  float along = clamp(dot(from, to) / dot(to, to), 0.0, 1.0);
  float reach = radius + length(u_on_f.zw) + length(u_on_f.xy);
  vec3 off = from - along * to;
  return dot(off, off) < reach * reach;
}

#ifdef ON_MESH
vec3 facet() { return dot(v_facing.xyz, u_eye - v_place) < 0.0 ? -v_facing.xyz : v_facing.xyz; }
#endif

// Of lamp number k. Of the mesh, as of the box, points behind the horizon are left to the irradiance.
float visible_share(int k, vec3 p, vec3 n, int own, vec3 place, mat3 axes) {
  bool sphere = own != 2 && in_the_way(p, place, SPHERE.xyz, SPHERE.w);
  bool box = own != 3 && in_the_way(p, place, BOX_CENTRE, length(BOX_HALF));
#ifdef WITH_MESH
  bool mesh = in_the_way(p, place, u_mesh_ball.xyz, u_mesh_ball.w);
#else
  const bool mesh = false;
#endif
  if (!sphere && !box && !mesh) return 1.0;
  float seen = 0.0;
  for (int j = 0; j < SHADOW_RAYS; ++j)
    for (int i = 0; i < SHADOW_RAYS; ++i) {
      vec2 on_f = (2.0 * vec2(i, j) + 1.0) / float(SHADOW_RAYS) - 1.0;
      vec3 to = place + axes * vec3(u_on_f.xy + on_f * u_on_f.zw, 0.0) - p;
      float r = length(to);
      bool blocked = (sphere && hit_sphere(p, to / r, SPHERE) < r)
                  || (box && hit_box(p, to / r, BOX_CENTRE, BOX_HALF) < r);
#ifdef WITH_MESH
      vec3 normal = vec3(0.0);
      bool tested = mesh && !blocked;
#ifdef ON_MESH
      normal = facet() * axes;
      tested = tested && min(dot(n, to), dot(facet(), to)) > 0.0;
#endif
      if (tested) {
        seen += past_mesh((k * SHADOW_RAYS + j) * SHADOW_RAYS + i, -to * axes, normal);
        continue;
      }
#endif
      seen += blocked ? 0.0 : 1.0;
    }
  return seen / float(SHADOW_RAYS * SHADOW_RAYS);
}

vec3 ramp(float t) {
  float x = clamp(t, 0.0, 1.0) * 7.0;
  int k = min(int(x), 6);
  return mix(u_ramp[k], u_ramp[k + 1], x - float(k));
}

// 1 on lines of 1, 2 and 5 times powers of ten.
float isolux(float log_e) {
  float width = fwidth(log_e);
  if (width > 0.25) return 0.0;
  float line = 0.0;
  for (int k = 0; k < 3; ++k) {
    float offset = k == 0 ? 0.0 : k == 1 ? 0.30103 : 0.69897;
    float away = abs(fract(log_e - offset + 0.5) - 0.5) / max(width, 1e-6);
    line = max(line, (k == 0 ? 1.0 : 0.45) * (1.0 - smoothstep(0.5, 1.5, away)));
  }
  return line;
}

vec3 srgb(vec3 linear) {
  vec3 c = clamp(linear, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}

// Blue below 0, red above, white at 0; full colour at 50 %.
vec3 deviation_colour(float share) {
  float t = clamp(2.0 * share, -1.0, 1.0);
  vec3 full = t < 0.0 ? vec3(0.02, 0.24, 0.60) : vec3(0.70, 0.09, 0.06);
  return mix(vec3(0.96), full, pow(abs(t), 0.7));
}

struct Lit {
  vec3 near, point;  // by all lamps; by the point lamps that they are far away
  bool half_shadow;
};

void light_by(int k, vec3 place, mat3 axes, float level, vec3 p, vec3 n, int own, inout Lit lit) {
  vec3 q = (p - place) * axes, m = n * axes;
  vec3 near = irradiance(q, m, u_far_field && MODE != 2);
#if MODE == 2
  vec3 point = irradiance(q, m, true);
#else
  vec3 point = vec3(0.0);
#endif
  if (dot(abs(near) + abs(point), vec3(1.0)) <= 0.0) return;
  float seen = visible_share(k, p, n, own, place, axes), share = level * seen;
  lit.half_shadow = lit.half_shadow || (seen > 0.0 && seen < 1.0);
  lit.near += share * max(near, 0.0);
  lit.point += share * point;
}

// What is shown of a surface.
vec3 shown(vec3 n, vec3 albedo, Lit lit) {
  float shade = 0.74 + 0.22 * n.y + 0.12 * n.x;  // of the faint even light, so that edges show
#if MODE == 0
  return srgb(1.0 - exp(-1.8 * albedo * (lit.near * u_exposure + vec3(0.17) * shade)));
#else
  float illuminance = dot(u_weights, lit.near);
#endif
#if MODE == 1
  float log_e = log(max(illuminance, 1e-12)) / log(10.0);
  float line = isolux(log_e);
  if (lit.half_shadow) line = 0.0;  // whose steps are no lines
  float level = (log_e - u_range.x) / (u_range.y - u_range.x);
  if (level < 0.0) return u_ramp[0] * (0.55 + 0.75 * shade);
  vec3 line_colour = level > 0.55 ? vec3(0.05) : vec3(1.0);
  return mix(ramp(level), line_colour, level < 1.0 ? 0.8 * line : 0.0);
#elif MODE == 2
  float point = dot(u_weights, lit.point), least = pow(10.0, u_range.x);
  if (max(illuminance, point) <= least) return vec3(0.80, 0.81, 0.83) * shade;
  return deviation_colour((point - illuminance) / max(illuminance, least));
#endif
}

void main() {
  vec3 p = v_place, n = v_facing.xyz;
  int own = int(v_facing.w);  // 0 floor, 1 wall, 2 sphere, 3 box, 4 mesh
#ifdef ON_SPHERE
  vec3 d = normalize(v_place - u_eye);
  float t = hit_sphere(u_eye, d, SPHERE);
  if (t == FAR) discard;
  p = u_eye + t * d;
  n = normalize(p - SPHERE.xyz);
  own = 2;
  float depth = dot(p - u_eye, u_view[2]);
  gl_FragDepth = 0.5 - 0.5 * (DEPTH.x + DEPTH.y / depth);
#endif
#ifdef ON_MESH
  n = dot(v_smooth, v_smooth) > 1e-12 ? normalize(v_smooth) : facet();
  if (dot(n, facet()) < 0.0) n = -n;
#endif
  vec3 albedo = own == 0 ? vec3(0.62, 0.62, 0.60) : own == 1 ? vec3(0.75, 0.74, 0.71)
              : own == 2 ? vec3(0.75, 0.55, 0.45) : own == 3 ? vec3(0.45, 0.58, 0.70)
              : vec3(0.66, 0.64, 0.48);
  Lit lit = Lit(vec3(0.0), vec3(0.0), false);
  BY_EACH_LAMP
  colour = vec4(shown(n, albedo, lit), 1.0);
}
