#include "luxfield/bench/hill_mesh.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"

namespace luxfield::bench {
namespace {

static_assert(std::endian::native == std::endian::little, "WritePly copies numbers as they are");

constexpr double kSide_m = 20;
constexpr int kOctaves = 7;

// In [0, 1], one of a cell.
double CellHeight(int octave, int x, int y) {
  core::Random random(static_cast<std::uint64_t>(octave) + 1,
                      (static_cast<std::uint64_t>(x) << 32) + static_cast<std::uint64_t>(y));
  return random.Uniform();
}

// A cone in each cell of a lattice of 2^octave cells along a side, half as high as those of the
// lattice before.
double Height(double x, double y) {
  double height = 0.6 * std::sin(0.7 * x) * std::cos(0.5 * y);
  for (int octave = 2; octave < 2 + kOctaves; ++octave) {
    const double cells = std::exp2(octave), u = x / kSide_m * cells, v = y / kSide_m * cells;
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    const double off = std::hypot(u - i - 0.5, v - j - 0.5);
    height += std::max(0.0, 1 - 2 * off) * CellHeight(octave, i, j) * 6 / cells;
  }
  return height;
}

template <typename T>
void Put(const T& value, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

scene::Geometry HillMesh(int triangles) {
  const int side = static_cast<int>(std::sqrt(triangles / 2.0));
  if (side < 1) throw InputError("a mesh of hills has at least 2 triangles");
  scene::Geometry geometry;
  geometry.materials.emplace_back();
  for (int row = 0; row <= side; ++row)
    for (int column = 0; column <= side; ++column) {
      const double x = kSide_m * column / side, y = kSide_m * row / side;
      geometry.vertices.push_back(
          {{static_cast<float>(x - kSide_m / 2), static_cast<float>(y - kSide_m / 2),
            static_cast<float>(Height(x, y))},
           {},
           {}});
    }
  for (int row = 0; row < side; ++row)
    for (int column = 0; column < side; ++column) {
      const auto a = static_cast<std::uint32_t>(row * (side + 1) + column),
                 b = a + static_cast<std::uint32_t>(side) + 1;
      geometry.triangles.push_back({{a, a + 1, b + 1}, 0});
      geometry.triangles.push_back({{a, b + 1, b}, 0});
    }
  return geometry;
}

scene::Camera HillCamera(int width, int height) {
  return scene::Camera::LookAt({-9, -12, 7}, {0, 0, 0.5}, {0, 0, 1}, 45, width, height);
}

std::string HillScene(const std::string& file) {
  return fmt::format(R"([camera]
position = [-9, -12, 7]
look_at = [0, 0, 0.5]
vertical_fov_deg = 45

[[material]]
name = "ground"
albedo = [0.5, 0.5, 0.5]

[[mesh]]
file = "{}"
material = "ground"
)",
                     file);
}

void WritePly(const std::filesystem::path& path, const scene::Geometry& geometry) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float "
      "y\nproperty float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      geometry.vertices.size(), geometry.triangles.size());
  for (const scene::Vertex& vertex : geometry.vertices) Put(vertex.position, bytes);
  for (const scene::Triangle& triangle : geometry.triangles) {
    Put(std::uint8_t{3}, bytes);
    Put(triangle.vertex, bytes);
  }
  core::WriteFileAtomically(path, bytes);
}

}  // namespace luxfield::bench
