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
  BuildNode* children[2] = {nullptr, nullptr};
  Box boxes[2];
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

// 4 float32 steps of the scene's largest coordinate: no less than what rounding moves a ray by on
// its way.
float BoxMargin(const Geometry& geometry) {
  float largest = 0;
  for (const Vertex& vertex : geometry.vertices)
    for (const float coordinate : vertex.position)
      largest = std::max(largest, std::abs(coordinate));
  return 4 * std::numeric_limits<float>::epsilon() * largest + std::numeric_limits<float>::min();
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

class Flattener {
 public:
  explicit Flattener(Bvh& bvh) : bvh_(bvh) {}

  Bvh::Child Flatten(const BuildNode* node, const Box& box, int depth) {
    Bvh::Child child;
    child.box = box;
    if (node->is_leaf) {
      const auto* leaf = static_cast<const BuildLeaf*>(node);
      child.first = static_cast<std::int32_t>(bvh_.order.size());
      child.count = static_cast<std::int32_t>(leaf->count);
      bvh_.order.insert(bvh_.order.end(), leaf->triangles.begin(),
                        leaf->triangles.begin() + leaf->count);
      return child;
    }
    if (depth >= Bvh::kMaxDepth)
      throw DeviceError(
          fmt::format("Embree built a hierarchy deeper than {} levels; simplify the scene's meshes",
                      Bvh::kMaxDepth));
    const auto* inner = static_cast<const BuildInner*>(node);
    child.node = static_cast<std::int32_t>(bvh_.nodes.size());
    bvh_.nodes.emplace_back();
    for (int i = 0; i < 2; ++i) {
      const auto flat = Flatten(inner->children[i], inner->boxes[i], depth + 1);
      bvh_.nodes[child.node].children[i] = flat;
    }
    return child;
  }

 private:
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
  arguments.maxBranchingFactor = 2;
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
  if (root->is_leaf) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const Box everything{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
    bvh.nodes.emplace_back();
    bvh.nodes[0].children[0] = Flattener(bvh).Flatten(root, everything, 0);
  } else {
    Flattener(bvh).Flatten(root, {}, 0);
  }
  return bvh;
}

}  // namespace luxfield::scene
