// Deals the samples of a point out to lights through a tree over them (docs/theory.md 6).
//
// The tree is cut where nodes are small against their distance; the nodes c of the cut share the K
// samples, with a part of them evenly,
//
//   q_c = (1 - d) w_c / sum w + d / |cut|,   w: light_importance.clh
//
// and a node's share goes to its children likewise, down to the leaves: nbar_l = K q_l of light l.
// Systematic allocation over the leaves in order gives l floor(S_l + xi) - floor(S_(l-1) + xi)
// samples, S = cumsum nbar, K in all. A light of nbar_l < 1 is drawn with probability nbar_l, and its
// estimate counts 1 / nbar_l.
#include "luxfield/render/kernels/lights/light_cut.clh"
#include "luxfield/render/kernels/sample/allocation.clh"

// d of a cut and of two children.
#define DEFENSIVE_CUT 0.05f
#define DEFENSIVE_CHILD 0.02f

// The part of a node's share that goes to its left child.
static inline float LeftShare(float left, float right) {
  if (!(left > 0.0f)) return 0.0f;
  if (!(right > 0.0f)) return 1.0f;
  return (1.0f - DEFENSIVE_CHILD) * left / (left + right) + 0.5f * DEFENSIVE_CHILD;
}

typedef struct Share {
  int node;
  float low, high;  // S before and after it
} Share;

typedef struct Selection {
  __global SelectedLight* lights;
  int count;
} Selection;

// Deals a node's share out to its leaves.
static inline void Descend(__global const LightNode* nodes, __global const TreeLight* lights,
                           __global const float* tables, float3 position, float3 normal,
                           Share share, float xi, Selection* selection) {
  Share stack[kMostDepth];
  int depth = 1;
  stack[0] = share;
  while (depth > 0) {
    share = stack[--depth];
    const int samples = SamplesBelow(share.high, xi) - SamplesBelow(share.low, xi);
    if (samples == 0) continue;
    const int light = nodes[share.node].light;
    if (light >= 0) {
      __global SelectedLight* selected = selection->lights + selection->count++;
      selected->light = light;
      selected->samples = samples;
      selected->weight = 1.0f / fmin(share.high - share.low, 1.0f);
      continue;
    }
    const int left = share.node + 1, right = nodes[share.node].right;
    const float left_importance = Importance(nodes, lights, tables, left, position, normal),
                right_importance = Importance(nodes, lights, tables, right, position, normal);
    if (!(left_importance + right_importance > 0.0f)) continue;  // samples of no light
    const float part = LeftShare(left_importance, right_importance);
    const float middle = part == 1.0f ? share.high
                                      : fmin(fma(part, share.high - share.low, share.low),
                                             share.high);
    const Share right_share = {right, middle, share.high}, left_share = {left, share.low, middle};
    stack[depth++] = right_share;
    stack[depth++] = left_share;
  }
}

// Item: a point. `selected` has room for `capacity` lights of each, `counts` says how many there
// are.
__kernel void SelectLights(__global const LightNode* nodes, __global const TreeLight* lights,
                           __global const float* tables, __constant const SamplingParams* sampling,
                           __global const float4* positions, __global const float4* normals,
                           int capacity, __global int* counts, __global SelectedLight* selected) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  if (pixel >= sampling->end) return;
  Selection selection;
  selection.lights = selected + (size_t)item * capacity;
  selection.count = 0;
  if (positions[pixel].w != 0.0f) {
    const float3 position = positions[pixel].xyz, normal = normals[pixel].xyz;
    Cut cut;
    MakeCut(nodes, lights, tables, position, normal, &cut);
    float total = 0.0f;
    for (int k = 0; k < cut.count; ++k) total += cut.importance[k];
    const float even = DEFENSIVE_CUT * total / (float)max(cut.count, 1);
    float shares = 0.0f;
    for (int k = 0; k < cut.count; ++k) {
      cut.importance[k] = (1.0f - DEFENSIVE_CUT) * cut.importance[k] + even;
      shares += cut.importance[k];
    }
    // Words that no light's own samples use.
    const uint4 words =
        Philox((uint4)(sampling->first_pixel + (uint)pixel, 0u, sampling->stream, 1u),
               (uint2)(sampling->seed_lo, sampling->seed_hi));
    const float xi = UnitFloat(words.x), wanted = (float)sampling->samples;
    Share share;
    share.high = 0.0f;
    float sum = 0.0f;
    for (int k = 0; k < cut.count; ++k) {
      sum += cut.importance[k];
      share.node = cut.node[k];
      share.low = share.high;
      share.high = wanted * (sum / shares);
      Descend(nodes, lights, tables, position, normal, share, xi, &selection);
    }
  }
  counts[item] = selection.count;
}
