// Which luminaires matter at a point, for estimators without noise (docs/theory.md 6): the others
// together bring at most `share` of about what all bring, the sum of the importances of the tree's
// cut. Bounds of nodes and lights:
//
//   E <= bound(angle) max (n . w)+ / (|c - p| - R)^2           of a node of radius R
//   E <= bound(t) max (n . (u - p))+ / z^3                     of a luminaire
//
// A node is left out where its bound is at most an eighth of what may still be left out.
#include "luxfield/render/kernels/lights/light_cut.clh"

#define MOST_AT_ONCE 0.125f
// What bounds leave to rounding.
#define ROUNDED_UP 1.0001f

static inline float LuminaireBound(__global const TreeLight* light, __global const float* tables,
                                   float3 position, float3 normal) {
  const float3 d = position - vload3(0, light->position);
  const float3 p = InLight(light, d), n = InLight(light, normal);
  if (!(p.z > 0.0f)) return 0.0f;
  const float2 extent = vload2(0, light->extent);
  const float height = -dot(normal, d) + extent.x * fabs(n.x) + extent.y * fabs(n.y);
  // Rounding of the horizon: nothing is dark that is on it.
  if (height < -1e-5f * length(d)) return 0.0f;
  const float2 t = p.xy / p.z, half_width = extent / p.z * ROUNDED_UP,
               low = vload2(0, light->low), bin = vload2(0, light->bin);
  const int2 size = (int2)(light->columns, light->rows);
  const float2 from = (t - half_width - low) / bin, to = (t + half_width - low) / bin;
  if (any(to < -1e-3f) || any(from > convert_float2(size) + 1e-3f)) return 0.0f;
  __global const float* bounds = tables + light->table + (size.x + 1) * (size.y + 1);
  float bound = bounds[size.x * size.y];
  if (all(half_width < 0.99f * bin)) {
    const int2 at = clamp(convert_int2_rtn((t - low) / bin), (int2)(0), size - 1);
    bound = bounds[at.y * size.x + at.x];
  }
  return ROUNDED_UP * light->scale * bound * (fmax(height, 0.0f) / p.z + 1e-6f) / (p.z * p.z);
}

// INFINITY where none is known.
static inline float NodeBound(__global const LightNode* node, float3 position, float3 normal) {
  const float3 d = position - vload3(0, node->centre);
  const float radius = node->radius, height = -dot(normal, d) + radius, distance = length(d),
              nearest = distance - radius;
  if (height < -1e-5f * distance) return 0.0f;
  if (!(nearest > node->bounded_m)) return INFINITY;
  const int2 angles = ProfileBins(node, d, distance);
  float bound = 0.0f;
  for (int k = angles.x; k <= angles.y; ++k) bound = fmax(bound, node->bounds[k]);
  return ROUNDED_UP * bound * clamp(height / nearest + 1e-6f, 0.0f, 1.0f) / (nearest * nearest);
}

// Writes the lights that matter to `found`, if that is not null; returns how many there are.
static inline int FindSignificant(__global const LightNode* nodes, __global const TreeLight* lights,
                                  __global const float* tables, float3 position, float3 normal,
                                  float share, __global int* found) {
  Cut cut;
  MakeCut(nodes, lights, tables, position, normal, &cut);
  float left_out = 0.0f;
  for (int k = 0; k < cut.count; ++k) left_out += cut.importance[k];
  left_out *= share;
  int stack[kMostDepth], depth = 1, count = 0;
  stack[0] = 0;
  while (depth > 0) {
    const int node = stack[--depth], light = nodes[node].light;
    const float bound = light < 0
                            ? NodeBound(nodes + node, position, normal)
                            : LuminaireBound(lights + light, tables, position, normal);
    if (bound <= MOST_AT_ONCE * left_out) {
      left_out -= bound;
    } else if (light < 0) {
      stack[depth++] = nodes[node].right;
      stack[depth++] = node + 1;
    } else {
      if (found) found[count] = light;
      ++count;
    }
  }
  return count;
}

// Item: a point. How many luminaires matter there.
__kernel void CountSignificant(__global const LightNode* nodes, __global const TreeLight* lights,
                               __global const float* tables, float share, int points,
                               __global const float4* positions, __global const float4* normals,
                               __global int* counts) {
  const int k = get_global_id(0);
  if (k >= points) return;
  counts[k] = positions[k].w == 0.0f
                  ? 0
                  : FindSignificant(nodes, lights, tables, positions[k].xyz, normals[k].xyz, share,
                                    0);
}

// Which: of the k-th point from found[starts[k]] on.
__kernel void FindSignificantLights(__global const LightNode* nodes,
                                    __global const TreeLight* lights,
                                    __global const float* tables, float share, int points,
                                    __global const float4* positions,
                                    __global const float4* normals, __global const int* starts,
                                    __global int* found) {
  const int k = get_global_id(0);
  if (k >= points || positions[k].w == 0.0f) return;
  FindSignificant(nodes, lights, tables, positions[k].xyz, normals[k].xyz, share,
                  found + starts[k]);
}
