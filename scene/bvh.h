// A bounding volume hierarchy of up to 8 children a node that Embree builds, flattened for other
// traversers.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "luxfield/scene/geometry.h"

namespace luxfield::scene {

struct Box {
  std::array<float, 3> lower{};
  std::array<float, 3> upper{};
};

// Node 0 is the root. Boxes contain their triangles with a margin of 8 float32 steps of the scene's
// largest coordinate, so that a traverser's rounding loses none.
struct Bvh {
  static constexpr int kWidth = 8;
  static constexpr int kMaxDepth = 48;  // nodes on any path from the root, leaves not counted
  static constexpr int kMaxLeafSize = 4;
  static constexpr std::size_t kMaxTriangles = std::size_t{1} << 27;

  struct Child {
    Box box;
    std::int32_t node = -1;             // an inner node, or -1: a leaf
    std::int32_t first = 0, count = 0;  // its range in `order`
  };
  // Inner nodes among the children follow each other in `nodes`, and so do the triangles of leaves
  // in `order`. An absent child is a leaf of 0 triangles.
  //
  // A child's place tells where it lies: bit k of the place is 1 for children towards the upper end
  // of axis k, as far as eight children can be placed so. A ray whose direction is negative along
  // the axes of the bits of `octant` thus meets places p roughly in the order of p xor octant.
  struct Node {
    std::array<Child, kWidth> children;
  };

  std::vector<Node> nodes;           // never empty
  std::vector<std::uint32_t> order;  // triangles of the geometry in leaf order, each once
};

// Throws InputError if there are more triangles than kMaxTriangles, DeviceError if Embree fails.
Bvh BuildBvh(const Geometry& geometry);

}  // namespace luxfield::scene
