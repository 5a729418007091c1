// Batches of rays on devices that trace them themselves (render/scene/ray_scene.h).
#include "luxfield/render/kernels/scene/bvh.clh"
#include "luxfield/scene/ray_types.clh"

// True if the ray of this slot is one to trace: it lies in its group's range.
static inline bool IsTraced(__global const RayRange* ranges, int group_size, ulong group_count,
                            size_t slot) {
  const size_t group = slot / (size_t)group_size;
  if (group >= group_count) return false;
  const int ray = (int)(slot - group * (size_t)group_size);
  return !ranges || (ray >= ranges[group].begin && ray < ranges[group].end);
}

__kernel void IntersectRays(__global const BvhNode* nodes, __global const BvhTriangle* triangles,
                            __global const PackedRay* rays, __global const RayRange* ranges,
                            int group_size, ulong group_count, __global PackedHit* hits) {
  const size_t slot = get_global_id(0);
  if (!IsTraced(ranges, group_size, group_count, slot)) return;
  const Hit hit = Intersect(nodes, triangles, vload3(0, rays[slot].origin),
                            vload3(0, rays[slot].direction), rays[slot].t_min, rays[slot].t_max);
  hits[slot].t = hit.t;
  hits[slot].triangle = hit.triangle;
  hits[slot].b = hit.b;
  hits[slot].c = hit.c;
}

__kernel void OccludeRays(__global const BvhNode* nodes, __global const BvhTriangle* triangles,
                          __global const PackedRay* rays, __global const RayRange* ranges,
                          int group_size, ulong group_count, __global uchar* hidden) {
  const size_t slot = get_global_id(0);
  if (!IsTraced(ranges, group_size, group_count, slot)) return;
  hidden[slot] = Occluded(nodes, triangles, vload3(0, rays[slot].origin),
                          vload3(0, rays[slot].direction), rays[slot].t_min, rays[slot].t_max);
}
