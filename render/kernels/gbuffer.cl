// Primary visibility: one ray per pixel, the surface point, its normal towards the camera, its
// albedo.
#include "render/kernels/bvh.clh"
#include "render/kernels/gbuffer_types.clh"

// IEC 61966-2-1.
float LinearFromSrgb8(uint value) {
  const float x = (float)value / 255.0f;
  return x <= 0.04045f ? x / 12.92f : pow((x + 0.055f) / 1.055f, 2.4f);
}

float3 Texel(__global const uint* texels, int width, int height, int column, int row) {
  const uint rgba = texels[((row + height) % height) * width + (column + width) % width];
  return (float3)(LinearFromSrgb8(rgba & 255u), LinearFromSrgb8((rgba >> 8) & 255u),
                  LinearFromSrgb8((rgba >> 16) & 255u));
}

// Bilinear in linear light, repeating; v = 0 is the lower edge.
float3 SampleTexture(__global const uint* texels, int width, int height, float u, float v) {
  const float x = (u - floor(u)) * (float)width - 0.5f,
              y = (1.0f - (v - floor(v))) * (float)height - 0.5f;
  const float x0 = floor(x), y0 = floor(y);
  const int column = (int)x0, row = (int)y0;
  const float3 top = mix(Texel(texels, width, height, column, row),
                         Texel(texels, width, height, column + 1, row), x - x0);
  const float3 bottom = mix(Texel(texels, width, height, column, row + 1),
                            Texel(texels, width, height, column + 1, row + 1), x - x0);
  return mix(top, bottom, y - y0);
}

__kernel void PrimaryRays(PinholeCamera camera, __global const BvhNode* nodes,
                          __global const BvhTriangle* triangles,
                          __global const ShadedTriangle* shading,
                          __global const SurfaceMaterial* materials, __global const uint* texels,
                          __global float4* positions, __global float4* normals,
                          __global float4* albedos) {
  const int column = get_global_id(0), row = get_global_id(1);
  if (column >= camera.width || row >= camera.rows) return;
  const int pixel = row * camera.width + column;
  const float3 origin = vload3(0, camera.position);
  const float3 direction =
      vload3(0, camera.corner) + ((float)column + camera.sample_x) * vload3(0, camera.right) +
      ((float)(camera.first_row + row) + camera.sample_y) * vload3(0, camera.down);
  const Hit hit = Intersect(nodes, triangles, origin, direction, 0.0f, MAXFLOAT);
  if (hit.triangle < 0) {
    positions[pixel] = normals[pixel] = albedos[pixel] = (float4)(0.0f);
    return;
  }
  __global const BvhTriangle* triangle = triangles + hit.slot;
  const float3 a = vload3(0, triangle->a), b = vload3(0, triangle->b), c = vload3(0, triangle->c);
  const float weight_a = 1.0f - hit.b - hit.c;
  // From the corners, not along the ray: the error then scales with the triangle, not with the
  // distance.
  const float3 position = a + hit.b * (b - a) + hit.c * (c - a);

  float3 geometric = normalize(cross(b - a, c - a));
  if (dot(geometric, direction) > 0.0f) geometric = -geometric;
  ShadedTriangle shaded = shading[hit.triangle];
  const float3 smooth = weight_a * vload3(0, shaded.corner[0].normal) +
                        hit.b * vload3(0, shaded.corner[1].normal) +
                        hit.c * vload3(0, shaded.corner[2].normal);
  const float smooth_length = length(smooth);
  float3 normal = geometric;
  if (smooth_length > 1e-3f)
    normal = smooth / (dot(smooth, geometric) < 0.0f ? -smooth_length : smooth_length);

  const SurfaceMaterial material = materials[shaded.material];
  float3 albedo = (float3)(material.albedo[0], material.albedo[1], material.albedo[2]);
  if (material.texture_offset >= 0) {
    const float u =
        weight_a * shaded.corner[0].u + hit.b * shaded.corner[1].u + hit.c * shaded.corner[2].u;
    const float v =
        weight_a * shaded.corner[0].v + hit.b * shaded.corner[1].v + hit.c * shaded.corner[2].v;
    albedo *= SampleTexture(texels + material.texture_offset, material.texture_width,
                            material.texture_height, u, v);
  }
  positions[pixel] = (float4)(position, 1.0f);
  normals[pixel] = (float4)(normal, 0.0f);
  albedos[pixel] = (float4)(albedo, 0.0f);
}
