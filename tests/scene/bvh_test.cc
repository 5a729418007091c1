#include "luxfield/scene/bvh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "luxfield/core/random.h"
#include "luxfield/scene/ray_caster.h"

namespace luxfield::scene {
namespace {

// `count` random triangles, in part degenerate, in part all in one place.
Geometry Soup(int count, std::uint64_t seed) {
  core::Random random(seed, 0);
  Geometry geometry;
  for (int i = 0; i < count; ++i) {
    const auto first = static_cast<std::uint32_t>(geometry.vertices.size());
    const Vec3 centre =
        i % 3 == 0 ? Vec3{1, 1, 1} : 10.0 * Vec3{random.Normal(), random.Normal(), random.Normal()};
    for (int k = 0; k < 3; ++k) {
      const Vec3 p =
          i % 7 == 0 ? centre : centre + Vec3{random.Normal(), random.Normal(), random.Normal()};
      geometry.vertices.push_back(
          {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)}, {}, {}});
    }
    geometry.triangles.push_back({{first, first + 1, first + 2}, 0});
  }
  return geometry;
}

// Walks the tree: boxes nest, every triangle is inside its leaf's box and appears once, depth and
// leaf size are bounded, inner nodes and triangles below a node follow each other.
class Checker {
 public:
  Checker(const Geometry& geometry, const Bvh& bvh) : geometry_(geometry), bvh_(bvh) {}

  void Check() {
    CheckNode(0, nullptr, 1);
    EXPECT_EQ(seen_.size(), geometry_.triangles.size());
    EXPECT_EQ(bvh_.order.size(), geometry_.triangles.size());
  }

 private:
  void CheckNode(int index, const Box* parent, int depth) {
    ASSERT_LE(depth, Bvh::kMaxDepth);
    int next_node = -1, next_triangle = -1;
    for (const auto& child : bvh_.nodes[index].children) {
      if (child.node < 0 && child.count > 0) {
        EXPECT_TRUE(next_triangle < 0 || child.first == next_triangle);
        next_triangle = child.first + child.count;
      } else if (child.node >= 0) {
        EXPECT_TRUE(next_node < 0 || child.node == next_node);
        next_node = child.node + 1;
      }
      if (child.node < 0) {
        ASSERT_LE(child.count, Bvh::kMaxLeafSize);
        for (int i = child.first; i < child.first + child.count; ++i) {
          EXPECT_TRUE(seen_.insert(bvh_.order[i]).second);
          for (int k = 0; k < 3; ++k) ExpectInside(geometry_.corner(bvh_.order[i], k), child.box);
        }
        continue;
      }
      if (parent) {
        ExpectInside(child.box.lower, *parent);
        ExpectInside(child.box.upper, *parent);
      }
      CheckNode(child.node, &child.box, depth + 1);
    }
  }
  static void ExpectInside(const std::array<float, 3>& p, const Box& box) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GE(p[axis], box.lower[axis]);
      EXPECT_LE(p[axis], box.upper[axis]);
    }
  }

  const Geometry& geometry_;
  const Bvh& bvh_;
  std::set<std::uint32_t> seen_;
};

TEST(Bvh, HoldsEveryTriangleOnce) {
  for (const int count : {0, 1, 2, 4, 5, 100, 5000}) {
    SCOPED_TRACE(testing::Message() << count << " triangles");
    const Geometry geometry = Soup(count, 11);
    Checker(geometry, BuildBvh(geometry)).Check();
  }
}

TEST(Bvh, SurvivesManyTrianglesInOnePlace) {
  Geometry geometry;
  geometry.vertices = {{{1, 1, 1}, {}, {}}, {{2, 1, 1}, {}, {}}, {{1, 2, 1}, {}, {}}};
  geometry.triangles.assign(20000, {{0, 1, 2}, 0});
  Checker(geometry, BuildBvh(geometry)).Check();
}

TEST(RayCaster, MatchesClosedForms) {
  Geometry geometry;
  AppendQuad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0, geometry);
  AppendBox(Translation({0, 0, 5}) * Scaling({2, 2, 2}), 0, geometry);
  const RayCaster caster(geometry);
  const auto up = caster.Intersect({{0.3, 0.2, -2}, {0, 0, 1}});
  ASSERT_TRUE(up);
  EXPECT_FLOAT_EQ(static_cast<float>(up->t), 2);
  EXPECT_LT(up->triangle, 2u);
  const auto down = caster.Intersect({{0.3, 0.2, 10}, {0, 0, -2}});
  ASSERT_TRUE(down);
  EXPECT_FLOAT_EQ(static_cast<float>(down->t), 2);  // the box's top at z = 6
  EXPECT_FALSE(caster.Intersect({{0, 0, -1}, {1, 0, 0}}));
  EXPECT_TRUE(caster.Occluded({{0, 0, 1}, {0, 0, 1}, 0, 4}));
  EXPECT_FALSE(caster.Occluded({{0, 0, 1}, {0, 0, 1}, 0, 2.9}));
  EXPECT_FALSE(RayCaster(Geometry{}).Occluded({{0, 0, 0}, {0, 0, 1}}));
}

}  // namespace
}  // namespace luxfield::scene
