// Primary visibility: one ray per pixel, and of what it hits the surface point, its normal towards
// the camera, how it reflects.
#include "luxfield/render/kernels/brdf/brdf_types.clh"
#include "luxfield/render/kernels/scene/gbuffer_types.clh"
#include "luxfield/render/kernels/scene/pinhole.clh"
#include "luxfield/scene/ray_types.clh"

// IEC 61966-2-1.
static inline float LinearFromSrgb8(uint value) {
  const float x = (float)value / 255.0f;
  return x <= 0.04045f ? x / 12.92f : pow((x + 0.055f) / 1.055f, 2.4f);
}

// Alpha is linear always.
static inline float4 Texel(__global const uint* texels, TextureTexels texture, bool srgb,
                           int column, int row) {
  const uint rgba = texels[texture.offset + ((row + texture.height) % texture.height) * texture.width +
                           (column + texture.width) % texture.width];
  const uint r = rgba & 255u, g = (rgba >> 8) & 255u, b = (rgba >> 16) & 255u;
  const float4 linear = (float4)((float)r, (float)g, (float)b, (float)(rgba >> 24)) / 255.0f;
  if (!srgb) return linear;
  return (float4)(LinearFromSrgb8(r), LinearFromSrgb8(g), LinearFromSrgb8(b), linear.w);
}

// Bilinear in linear values, repeating; v = 0 is the lower edge.
static inline float4 SampleTexture(__global const uint* texels, TextureTexels texture, bool srgb,
                                   float2 uv) {
  const float x = (uv.x - floor(uv.x)) * (float)texture.width - 0.5f,
              y = (1.0f - (uv.y - floor(uv.y))) * (float)texture.height - 0.5f;
  const float x0 = floor(x), y0 = floor(y);
  const int column = (int)x0, row = (int)y0;
  const float4 top = mix(Texel(texels, texture, srgb, column, row),
                         Texel(texels, texture, srgb, column + 1, row), x - x0);
  const float4 bottom = mix(Texel(texels, texture, srgb, column, row + 1),
                            Texel(texels, texture, srgb, column + 1, row + 1), x - x0);
  return mix(top, bottom, y - y0);
}

// A direction of texture coordinates, and a point, as the texture's placement maps them.
static inline float2 PlaceDirection(const TextureTexels* texture, float2 uv) {
  const float* m = texture->placement;
  return (float2)(m[0] * uv.x + m[1] * uv.y, m[3] * uv.x + m[4] * uv.y);
}

static inline float2 PlacePoint(const TextureTexels* texture, float2 uv) {
  return PlaceDirection(texture, uv) + (float2)(texture->placement[2], texture->placement[5]);
}

// The corners of a triangle.
typedef struct Corners {
  SceneVertex corner[3];
} Corners;

static inline float2 CornerUv(const Corners* triangle, int corner, int set) {
  return (float2)(triangle->corner[corner].uv[set][0], triangle->corner[corner].uv[set][1]);
}

// Where the texture is looked up at barycentric weights `at` of the corners.
static inline float2 TextureUv(const TextureTexels* texture, const Corners* triangle, float3 at) {
  return PlacePoint(texture, at.x * CornerUv(triangle, 0, texture->set) +
                                 at.y * CornerUv(triangle, 1, texture->set) +
                                 at.z * CornerUv(triangle, 2, texture->set));
}

// Specular colour and roughness, with the texture's specular colour and glossiness.
static inline float4 SpecularRoughness(float4 gloss, float4 value) {
  return (float4)(gloss.xyz * value.xyz, 1.0f - (1.0f - gloss.w) * value.w);
}

// `normal` tilted by a normal texture's value (glTF 2.0, 3.9.3). The tangent is the direction of
// rising u on the triangle; a mesh's own tangents are not read. Unchanged where u, v are
// degenerate.
static inline float3 TiltNormal(float3 normal, float3 value, float scale, float3 edge_b,
                                float3 edge_c, float2 uv_b, float2 uv_c) {
  const float area = uv_b.x * uv_c.y - uv_c.x * uv_b.y;
  float3 tangent = (uv_c.y * edge_b - uv_b.y * edge_c) * sign(area);
  float3 bitangent = (uv_b.x * edge_c - uv_c.x * edge_b) * sign(area);
  tangent -= dot(tangent, normal) * normal;
  const float tangent_length = length(tangent);
  if (!(tangent_length > 0.0f)) return normal;
  tangent /= tangent_length;
  const float3 across = cross(normal, tangent);
  bitangent = dot(across, bitangent) < 0.0f ? -across : across;
  const float3 tilt = 2.0f * value - 1.0f;
  return normalize(scale * (tilt.x * tangent + tilt.y * bitangent) +
                   fmax(tilt.z, 1e-3f) * normal);
}

// Cosine to the eye below which interpolated and tilted normals are bent towards it. At 1e-3 a
// surface is seen under 0.06 degrees: only silhouettes of coarse meshes and steep normal maps
// change.
#define MIN_EYE_COSINE 1e-3f

static inline float3 BendToEye(float3 normal, float3 to_eye) {
  const float cosine = dot(normal, to_eye);
  if (cosine >= MIN_EYE_COSINE) return normal;
  // normal + x to_eye has the cosine (cosine + x) / length; for small x the length is 1.
  return normalize(normal + (2.0f * MIN_EYE_COSINE - cosine) * to_eye);
}

// The ray of every pixel of the camera's rows.
__kernel void CastPrimaryRays(PinholeCamera camera, __global PackedRay* rays) {
  const int column = get_global_id(0), row = get_global_id(1);
  if (column >= camera.width || row >= camera.rows) return;
  __global PackedRay* ray = rays + row * camera.width + column;
  vstore3(vload3(0, camera.position), 0, ray->origin);
  vstore3(PixelDirection(&camera, column, row), 0, ray->direction);
  ray->t_min = 0.0f;
  ray->t_max = MAXFLOAT;
}

// Item k is pixel first_pixel + k.
__kernel void ShadeHits(int first_pixel, int count, __global const PackedRay* rays,
                        __global const PackedHit* hits, __global const SceneVertex* vertices,
                        __global const SceneTriangle* triangles,
                        __global const SurfaceMaterial* materials, __global const uint* texels,
                        __global float4* positions, __global float4* normals,
                        __global float4* albedos, __global float4* glosses,
                        __global float4* emissions) {
  const int item = get_global_id(0), pixel = first_pixel + item;
  if (item >= count) return;
  const PackedHit hit = hits[item];
  if (hit.triangle < 0) {
    positions[pixel] = normals[pixel] = albedos[pixel] = (float4)(0.0f);
    if (glosses) glosses[pixel] = (float4)(0.0f);
    if (emissions) emissions[pixel] = (float4)(0.0f);
    return;
  }
  const float3 direction = vload3(0, rays[item].direction);
  const SceneTriangle triangle = triangles[hit.triangle];
  Corners shaded;
  for (int k = 0; k < 3; ++k) shaded.corner[k] = vertices[triangle.vertex[k]];
  const float3 a = vload3(0, shaded.corner[0].position), b = vload3(0, shaded.corner[1].position),
               c = vload3(0, shaded.corner[2].position);
  const float weight_a = 1.0f - hit.b - hit.c;
  // From the corners, not along the ray: the error then scales with the triangle, not with the
  // distance.
  const float3 position = a + hit.b * (b - a) + hit.c * (c - a);

  float3 geometric = normalize(cross(b - a, c - a));
  if (dot(geometric, direction) > 0.0f) geometric = -geometric;
  const float3 smooth = weight_a * vload3(0, shaded.corner[0].normal) +
                        hit.b * vload3(0, shaded.corner[1].normal) +
                        hit.c * vload3(0, shaded.corner[2].normal);
  const float smooth_length = length(smooth);
  float3 normal = geometric;
  if (smooth_length > 1e-3f)
    normal = smooth / (dot(smooth, geometric) < 0.0f ? -smooth_length : smooth_length);

  const SurfaceMaterial material = materials[triangle.material];
  const float3 at = (float3)(weight_a, hit.b, hit.c);
  float3 albedo = (float3)(material.albedo[0], material.albedo[1], material.albedo[2]);
  if (material.colour.offset >= 0)
    albedo *= SampleTexture(texels, material.colour, true,
                            TextureUv(&material.colour, &shaded, at)).xyz;
  if (material.normal.offset >= 0) {
    const int set = material.normal.set;
    const float2 uv_a = CornerUv(&shaded, 0, set);
    normal = TiltNormal(
        normal,
        SampleTexture(texels, material.normal, false, TextureUv(&material.normal, &shaded, at)).xyz,
        material.normal_scale, b - a, c - a,
        PlaceDirection(&material.normal, CornerUv(&shaded, 1, set) - uv_a),
        PlaceDirection(&material.normal, CornerUv(&shaded, 2, set) - uv_a));
  }
  float4 gloss = vload4(0, material.gloss);
  if (material.gloss_values.offset >= 0) {
    const float4 value =
        SampleTexture(texels, material.gloss_values, material.kind == kSpecularGlossiness,
                      TextureUv(&material.gloss_values, &shaded, at));
    if (material.kind == kSpecularGlossiness)
      gloss = SpecularRoughness(gloss, value);
    else
      gloss.xy *= (float2)(value.z, value.y);
  }
  if (material.kind == kSpecularGlossiness)
    albedo *= 1.0f - fmax(gloss.x, fmax(gloss.y, gloss.z));
  positions[pixel] = (float4)(position, 1.0f);
  normals[pixel] = (float4)(BendToEye(normal, normalize(-direction)), 0.0f);
  albedos[pixel] = (float4)(albedo, glosses ? (float)material.kind : 0.0f);
  if (glosses) glosses[pixel] = gloss;
  if (!emissions) return;
  float3 emission = (float3)(material.emission[0], material.emission[1], material.emission[2]);
  if (material.emission_colour.offset >= 0)
    emission *= SampleTexture(texels, material.emission_colour, true,
                              TextureUv(&material.emission_colour, &shaded, at)).xyz;
  emissions[pixel] = (float4)(emission, 0.0f);
}
