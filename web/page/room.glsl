// The room in one pass: each pixel's ray is cut with floor, wall, sphere, box and lamps, and what it
// hits is lit by every lamp's near field, with shadows from points on F (room.js).

uniform vec2 u_size;           // of the picture, pixels
uniform vec3 u_eye;
uniform mat3 u_view;           // columns: right, up, back
uniform float u_tangent;       // of half the vertical field of view
uniform int u_lamps;
uniform vec3 u_lamp_place[MAX_LAMPS];
uniform mat3 u_lamp_axes[MAX_LAMPS];  // columns u, v, z
uniform float u_lamp_level[MAX_LAMPS];
uniform vec4 u_room;           // half, wall z, wall height, unused
uniform vec4 u_sphere;         // centre, radius
uniform vec3 u_box_centre;
uniform vec3 u_box_half;
uniform int u_mode;            // 0 picture, 1 false colour, 2 deviation of point lamps
uniform bool u_far_field;
uniform float u_exposure;      // 1 / illuminance that shows white
uniform vec2 u_range;          // of false colour, log10 of illuminance
uniform vec3 u_ramp[8];
uniform vec3 u_weights;        // of the channels in luminance
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

vec3 box_normal(vec3 p, vec3 centre, vec3 half_side) {
  vec3 at = (p - centre) / half_side, size = abs(at);
  if (size.x > size.y && size.x > size.z) return vec3(sign(at.x), 0.0, 0.0);
  return size.y > size.z ? vec3(0.0, sign(at.y), 0.0) : vec3(0.0, 0.0, sign(at.z));
}

// Whether a ball of that radius can come between p and any point of F.
bool in_the_way(vec3 p, vec3 lamp, vec3 ball, float radius) {
  vec3 to = lamp - p, from = ball - p;
  float along = clamp(dot(from, to) / dot(to, to), 0.0, 1.0);
  float reach = radius + length(u_on_f.zw) + length(u_on_f.xy);
  vec3 off = from - along * to;
  return dot(off, off) < reach * reach;
}

float visible_share(vec3 p, int own, int lamp) {
  bool sphere = own != 2 && in_the_way(p, u_lamp_place[lamp], u_sphere.xyz, u_sphere.w);
  bool box = own != 3 && in_the_way(p, u_lamp_place[lamp], u_box_centre, length(u_box_half));
  if (!sphere && !box) return 1.0;
  float seen = 0.0;
  for (int j = 0; j < SHADOW_RAYS; ++j)
    for (int i = 0; i < SHADOW_RAYS; ++i) {
      vec2 on_f = (2.0 * vec2(i, j) + 1.0) / float(SHADOW_RAYS) - 1.0;
      vec3 u = vec3(u_on_f.xy + on_f * u_on_f.zw, 0.0);
      vec3 to = u_lamp_place[lamp] + u_lamp_axes[lamp] * u - p;
      float r = length(to);
      bool blocked = (sphere && hit_sphere(p, to / r, u_sphere) < r)
                  || (box && hit_box(p, to / r, u_box_centre, u_box_half) < r);
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

// What is shown of a surface, by the mode.
vec3 surface_colour(vec3 n, vec3 albedo, vec3 e, float log_e, float line, float illuminance,
                    float point) {
  float shade = 0.74 + 0.22 * n.y + 0.12 * n.x;  // of the faint even light, so that edges show
  if (u_mode == 1) {
    float level = (log_e - u_range.x) / (u_range.y - u_range.x);
    if (level < 0.0) return u_ramp[0] * (0.55 + 0.75 * shade);
    vec3 line_colour = level > 0.55 ? vec3(0.05) : vec3(1.0);
    return mix(ramp(level), line_colour, level < 1.0 ? 0.8 * line : 0.0);
  }
  if (u_mode == 2) {
    float least = pow(10.0, u_range.x);
    if (max(illuminance, point) <= least) return vec3(0.80, 0.81, 0.83) * shade;
    return deviation_colour((point - illuminance) / max(illuminance, least));
  }
  return srgb(1.0 - exp(-1.8 * albedo * (e * u_exposure + vec3(0.17) * shade)));
}

void main() {
  vec2 at = (2.0 * gl_FragCoord.xy / u_size - 1.0) * vec2(u_size.x / u_size.y, 1.0) * u_tangent;
  vec3 d = normalize(u_view * vec3(at, -1.0));
  vec3 background = mix(vec3(0.91, 0.925, 0.94), vec3(0.80, 0.83, 0.86), clamp(0.5 - d.y, 0.0, 1.0));

  float t = FAR, lamp_t = FAR;
  int hit = -1;  // 0 floor, 1 wall, 2 sphere, 3 box
  float floor_t = -u_eye.y / d.y, wall_t = (u_room.y - u_eye.z) / d.z;
  vec3 on_floor = u_eye + floor_t * d, on_wall = u_eye + wall_t * d;
  if (floor_t > 1e-4 && abs(on_floor.x) < u_room.x && on_floor.z > u_room.y
      && on_floor.z < u_room.y + 2.0 * u_room.x) { t = floor_t; hit = 0; }
  if (wall_t > 1e-4 && wall_t < t && abs(on_wall.x) < u_room.x && on_wall.y > 0.0
      && on_wall.y < u_room.z) { t = wall_t; hit = 1; }
  float sphere_t = hit_sphere(u_eye, d, u_sphere);
  if (sphere_t < t) { t = sphere_t; hit = 2; }
  float box_t = hit_box(u_eye, d, u_box_centre, u_box_half);
  if (box_t < t) { t = box_t; hit = 3; }

  // The lamps' bodies: from F backwards.
  bool lamp_front = false;
  float glow = 0.0;
  float depth = 0.6 * max(u_on_f.z, u_on_f.w);
  for (int k = 0; k < u_lamps; ++k) {
    vec3 o = (u_eye - u_lamp_place[k]) * u_lamp_axes[k], v = d * u_lamp_axes[k];
    vec3 centre = vec3(u_on_f.xy, -0.5 * depth), half_side = vec3(u_on_f.zw, 0.5 * depth);
    float body = hit_box(o, v, centre, half_side);
    if (body < lamp_t) {
      lamp_t = body;
      lamp_front = box_normal(o + body * v, centre, half_side).z > 0.0;
      glow = min(1.0, u_lamp_level[k]);
    }
  }

  vec3 p = u_eye + t * d, n = vec3(0.0, 1.0, 0.0), albedo = vec3(0.62, 0.62, 0.60);
  if (hit == 1) { n = vec3(0.0, 0.0, 1.0); albedo = vec3(0.75, 0.74, 0.71); }
  if (hit == 2) { n = normalize(p - u_sphere.xyz); albedo = vec3(0.75, 0.55, 0.45); }
  if (hit == 3) { n = box_normal(p, u_box_centre, u_box_half); albedo = vec3(0.45, 0.58, 0.70); }

  vec3 e = vec3(0.0), other = vec3(0.0);
  bool half_shadow = false;
  if (hit >= 0)
    for (int k = 0; k < u_lamps; ++k) {
      vec3 q = (p - u_lamp_place[k]) * u_lamp_axes[k], m = n * u_lamp_axes[k];
      vec3 near = irradiance(q, m, u_far_field && u_mode != 2);
      vec3 far = u_mode == 2 ? irradiance(q, m, true) : vec3(0.0);
      if (dot(abs(near) + abs(far), vec3(1.0)) > 0.0) {
        float seen = visible_share(p, hit, k), share = u_lamp_level[k] * seen;
        half_shadow = half_shadow || (seen > 0.0 && seen < 1.0);
        e += share * max(near, 0.0);
        other += share * far;
      }
    }
  float illuminance = dot(u_weights, e), point = dot(u_weights, other);
  float log_e = log(max(illuminance, 1e-12)) / log(10.0);
  float line = isolux(log_e);  // before any branch: it takes differences between pixels
  if (half_shadow) line = 0.0;  // whose steps are no lines

  vec3 shown = hit < 0 ? background : surface_colour(n, albedo, e, log_e, line, illuminance, point);
  // A lamp hides half of what lies behind it, so that its light is seen where it stands close.
  if (lamp_t < t) {
    vec3 body = lamp_front ? mix(vec3(0.55), vec3(1.0, 0.97, 0.85), glow) : vec3(0.24, 0.27, 0.31);
    shown = mix(shown, body, 0.6);
  }
  colour = vec4(shown, 1.0);
}
