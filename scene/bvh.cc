#include "luxfield/scene/bvh.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/scene/embree.h"

namespace luxfield::scene {
namespace {

// Embree's builder makes these through callbacks, in its own arena, on several threads.
struct BuildNode {
  bool is_leaf = false;
};

struct BuildInner : BuildNode {
  unsigned count = 0;
  std::array<BuildNode*, Bvh::kWidth> children{};
  std::array<Box, Bvh::kWidth> boxes{};
};

struct BuildLeaf : BuildNode {
  std::uint32_t count = 0;
  std::array<std::uint32_t, Bvh::kMaxLeafSize> triangles{};
};

template <typename T>
T* Allocate(RTCThreadLocalAllocator allocator) {
  return new (rtcThreadLocalAlloc(allocator, sizeof(T), 16)) T;
}

void* CreateInner(RTCThreadLocalAllocator allocator, unsigned, void*) {
  return static_cast<BuildNode*>(Allocate<BuildInner>(allocator));
}

void SetChildren(void* node, void** children, unsigned count, void*) {
  auto* inner = static_cast<BuildInner*>(static_cast<BuildNode*>(node));
  inner->count = count;
  for (unsigned i = 0; i < count; ++i) inner->children[i] = static_cast<BuildNode*>(children[i]);
}

void SetBounds(void* node, const RTCBounds** bounds, unsigned count, void*) {
  auto* inner = static_cast<BuildInner*>(static_cast<BuildNode*>(node));
  for (unsigned i = 0; i < count; ++i) {
    const RTCBounds& b = *bounds[i];
    inner->boxes[i] = {{b.lower_x, b.lower_y, b.lower_z}, {b.upper_x, b.upper_y, b.upper_z}};
  }
}

void* CreateLeaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives,
                 std::size_t count, void*) {
  auto* leaf = Allocate<BuildLeaf>(allocator);
  leaf->is_leaf = true;
  leaf->count = static_cast<std::uint32_t>(std::min<std::size_t>(count, Bvh::kMaxLeafSize));
  for (std::uint32_t i = 0; i < leaf->count; ++i) leaf->triangles[i] = primitives[i].primID;
  // Embree's order within a leaf depends on its threads.
  std::sort(leaf->triangles.begin(), leaf->triangles.begin() + leaf->count);
  return static_cast<BuildNode*>(leaf);
}

// 8 float32 steps of the scene's largest coordinate: no less than what rounding moves a ray by on
// its way.
float BoxMargin(const Geometry& geometry) {
  float largest = 0;
  for (const Vertex& vertex : geometry.vertices)
    for (const float coordinate : vertex.position)
      largest = std::max(largest, std::abs(coordinate));
  return 8 * std::numeric_limits<float>::epsilon() * largest + std::numeric_limits<float>::min();
}

RTCBuildPrimitive BoundsOf(const Geometry& geometry, std::uint32_t triangle, float margin) {
  float lower[3], upper[3];
  for (int axis = 0; axis < 3; ++axis) {
    const float a = geometry.corner(triangle, 0)[axis], b = geometry.corner(triangle, 1)[axis],
                c = geometry.corner(triangle, 2)[axis];
    lower[axis] = std::min({a, b, c}) - margin;
    upper[axis] = std::max({a, b, c}) + margin;
  }
  return {lower[0], lower[1], lower[2], 0, upper[0], upper[1], upper[2], triangle};
}

Box BoxOf(const RTCBuildPrimitive& p) {
  return {{p.lower_x, p.lower_y, p.lower_z}, {p.upper_x, p.upper_y, p.upper_z}};
}

void Extend(const RTCBuildPrimitive& p, Box& box) {
  const float lower[3] = {p.lower_x, p.lower_y, p.lower_z},
              upper[3] = {p.upper_x, p.upper_y, p.upper_z};
  for (int axis = 0; axis < 3; ++axis) {
    box.lower[axis] = std::min(box.lower[axis], lower[axis]);
    box.upper[axis] = std::max(box.upper[axis], upper[axis]);
  }
}

// Which child stands in which place of a node (Bvh::Node): greedily the pair whose child lies
// farthest towards the place's corner, seen from the node's centre (after Ylitie, Karras and Laine
// 2017, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs").
std::array<int, Bvh::kWidth> Places(const BuildInner& inner) {
  const auto centre = [](const Box& box, int axis) {
    return 0.5 * (double{box.lower[axis]} + double{box.upper[axis]});
  };
  double middle[3] = {};
  for (unsigned c = 0; c < inner.count; ++c)
    for (int axis = 0; axis < 3; ++axis) middle[axis] += centre(inner.boxes[c], axis) / inner.count;
  std::array<int, Bvh::kWidth> child_at;
  child_at.fill(-1);
  std::array<bool, Bvh::kWidth> placed{};
  for (unsigned n = 0; n < inner.count; ++n) {
    double best = 0;
    int best_child = -1, best_place = -1;
    for (int c = 0; c < static_cast<int>(inner.count); ++c)
      for (int place = 0; place < Bvh::kWidth; ++place) {
        if (placed[c] || child_at[place] >= 0) continue;
        double towards = 0;
        for (int axis = 0; axis < 3; ++axis) {
          const double off = centre(inner.boxes[c], axis) - middle[axis];
          towards += place >> axis & 1 ? off : -off;
        }
        if (best_child >= 0 && towards <= best) continue;
        best = towards;
        best_child = c;
        best_place = place;
      }
    placed[best_child] = true;
    child_at[best_place] = best_child;
  }
  return child_at;
}

class Flattener {
 public:
  explicit Flattener(Bvh& bvh) : bvh_(bvh) {}

  // Fills node `at`, its leaves' triangles and, below them, its inner nodes.
  void Flatten(const BuildInner& inner, std::size_t at, int depth) {
    if (depth > Bvh::kMaxDepth)
      throw DeviceError(
          fmt::format("Embree built a hierarchy deeper than {} levels; simplify the scene's meshes",
                      Bvh::kMaxDepth));
    const auto child_at = Places(inner);
    Bvh::Node node;
    for (int place = 0; place < Bvh::kWidth; ++place) {
      if (child_at[place] < 0) continue;
      const BuildNode* child = inner.children[child_at[place]];
      node.children[place] =
          child->is_leaf ? MakeLeaf(*static_cast<const BuildLeaf*>(child)) : MakeInner();
      node.children[place].box = inner.boxes[child_at[place]];
    }
    bvh_.nodes[at] = node;
    for (int place = 0; place < Bvh::kWidth; ++place)
      if (node.children[place].node >= 0)
        Flatten(*static_cast<const BuildInner*>(inner.children[child_at[place]]),
                static_cast<std::size_t>(node.children[place].node), depth + 1);
  }

  Bvh::Child MakeLeaf(const BuildLeaf& leaf) {
    Bvh::Child child;
    child.first = static_cast<std::int32_t>(bvh_.order.size());
    child.count = static_cast<std::int32_t>(leaf.count);
    bvh_.order.insert(bvh_.order.end(), leaf.triangles.begin(),
                      leaf.triangles.begin() + leaf.count);
    return child;
  }

 private:
  Bvh::Child MakeInner() {
    Bvh::Child child;
    child.node = static_cast<std::int32_t>(bvh_.nodes.size());
    bvh_.nodes.emplace_back();
    return child;
  }

  Bvh& bvh_;
};

}  // namespace

Bvh BuildBvh(const Geometry& geometry) {
  const std::size_t count = geometry.triangles.size();
  if (count > Bvh::kMaxTriangles)
    throw InputError(fmt::format("the scene holds {} triangles, more than {}; simplify its meshes",
                                 count, Bvh::kMaxTriangles));
  Bvh bvh;
  if (count == 0) {
    bvh.nodes.emplace_back();
    return bvh;
  }
  std::vector<RTCBuildPrimitive> primitives(count);
  const float margin = BoxMargin(geometry);
  for (std::size_t i = 0; i < count; ++i)
    primitives[i] = BoundsOf(geometry, static_cast<std::uint32_t>(i), margin);

  const EmbreeDevice device;
  const EmbreeBvh builder(device);
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.byteSize = sizeof arguments;
  arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM;
  arguments.maxBranchingFactor = Bvh::kWidth;
  arguments.maxDepth = Bvh::kMaxDepth - 4;
  arguments.minLeafSize = 1;
  arguments.maxLeafSize = Bvh::kMaxLeafSize;
  arguments.bvh = builder.get();
  arguments.primitives = primitives.data();
  arguments.primitiveCount = arguments.primitiveArrayCapacity = count;
  arguments.createNode = CreateInner;
  arguments.setNodeChildren = SetChildren;
  arguments.setNodeBounds = SetBounds;
  arguments.createLeaf = CreateLeaf;
  const auto* root = static_cast<const BuildNode*>(rtcBuildBVH(&arguments));
  if (!root) device.Fail("building the hierarchy");

  bvh.order.reserve(count);
  bvh.nodes.emplace_back();
  if (root->is_leaf) {
    Box everything = BoxOf(primitives.front());
    for (const RTCBuildPrimitive& p : primitives) Extend(p, everything);
    bvh.nodes[0].children[0] = Flattener(bvh).MakeLeaf(*static_cast<const BuildLeaf*>(root));
    bvh.nodes[0].children[0].box = everything;
  } else {
    Flattener(bvh).Flatten(*static_cast<const BuildInner*>(root), 0, 1);
  }
  return bvh;
}

}  // namespace luxfield::scene
