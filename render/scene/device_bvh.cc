#include "luxfield/render/scene/device_bvh.h"

#include <algorithm>
#include <cmath>

#include "luxfield/render/kernels/scene/bvh_types.clh"

namespace luxfield::render {
namespace {

static_assert(scene::Bvh::kMaxDepth <= kBvhStackSize && scene::Bvh::kWidth == kBvhWidth);
// Triangles before a leaf's own in its node, and in it, fit a byte.
static_assert((scene::Bvh::kWidth - 1) * scene::Bvh::kMaxLeafSize < 32 &&
              scene::Bvh::kMaxLeafSize < 8);

constexpr double kSteps = 255;
constexpr int kLeastExponent = -100;  // far below any size, far above the least float

bool IsAbsent(const scene::Bvh::Child& child) { return child.node < 0 && child.count == 0; }

// The least power of 2 of which kSteps reach over the interval.
int ExponentFor(double length) {
  if (!(length > 0)) return kLeastExponent;
  int exponent = 0;
  std::frexp(length / kSteps, &exponent);  // length / kSteps < 2^exponent
  return std::clamp(exponent, kLeastExponent, 127);
}

BvhByte Quantised(double steps) { return static_cast<BvhByte>(std::clamp(steps, 0.0, kSteps)); }

void QuantiseBoxes(const scene::Bvh::Node& from, BvhNode& to) {
  for (int axis = 0; axis < 3; ++axis) {
    float lower = 0, upper = 0;
    bool any = false;
    for (const auto& child : from.children) {
      if (IsAbsent(child)) continue;
      lower = any ? std::min(lower, child.box.lower[axis]) : child.box.lower[axis];
      upper = any ? std::max(upper, child.box.upper[axis]) : child.box.upper[axis];
      any = true;
    }
    const int exponent = ExponentFor(double{upper} - double{lower});
    const double step = std::ldexp(1.0, exponent);
    to.origin[axis] = lower;
    to.exponent[axis] = static_cast<BvhByte>(exponent + kBvhExponentBias);
    for (int p = 0; p < kBvhWidth; ++p) {
      const auto& child = from.children[p];
      if (IsAbsent(child)) continue;
      to.lower[axis][p] =
          Quantised(std::floor((double{child.box.lower[axis]} - double{lower}) / step));
      to.upper[axis][p] =
          Quantised(std::ceil((double{child.box.upper[axis]} - double{lower}) / step));
    }
  }
}

BvhNode MakeNode(const scene::Bvh::Node& from) {
  BvhNode to{};
  QuantiseBoxes(from, to);
  bool has_node = false, has_triangle = false;
  for (int p = 0; p < kBvhWidth; ++p) {
    const auto& child = from.children[p];
    if (child.node >= 0) {
      if (!has_node) to.first_node = child.node;
      has_node = true;
      to.inner |= static_cast<BvhByte>(1 << p);
    } else if (child.count > 0) {
      if (!has_triangle) to.first_triangle = child.first;
      has_triangle = true;
      to.leaf[p] = static_cast<BvhByte>(8 * (child.first - to.first_triangle) + child.count);
    }
  }
  return to;
}

}  // namespace

DeviceBvh UploadBvh(const Device& device, const scene::Geometry& geometry, const scene::Bvh& bvh) {
  std::vector<BvhNode> nodes(bvh.nodes.size());
  std::transform(bvh.nodes.begin(), bvh.nodes.end(), nodes.begin(), MakeNode);
  std::vector<BvhTriangle> triangles;
  triangles.reserve(bvh.order.size());
  for (const std::uint32_t index : bvh.order) {
    BvhTriangle triangle{};
    std::copy_n(geometry.corner(index, 0).begin(), 3, triangle.a);
    std::copy_n(geometry.corner(index, 1).begin(), 3, triangle.b);
    std::copy_n(geometry.corner(index, 2).begin(), 3, triangle.c);
    triangle.index = static_cast<int>(index);
    triangles.push_back(triangle);
  }
  return {Buffer::From(device, nodes), Buffer::From(device, triangles)};
}

}  // namespace luxfield::render
