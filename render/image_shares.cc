#include "luxfield/render/image_shares.h"

#include <algorithm>
#include <limits>
#include <map>

#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/lightfield/projected_texels.h"
#include "luxfield/preprocess/summed_area.h"

namespace luxfield::render {

using lightfield::PencilAxis;
using lightfield::ProjectedTexels;
using lightfield::TexelAxis;

ImageShares::ImageShares(const lightfield::LightField& field) : geometry_(field.geometry) {
  const auto width = static_cast<std::size_t>(field.geometry.lattice.width),
             height = static_cast<std::size_t>(field.geometry.lattice.height);
  const std::size_t size = (width + 1) * (height + 1);
  const auto images = static_cast<std::size_t>(field.geometry.grid.count());
  sums_.assign(size * images, 0.0);
  core::ParallelFor(images, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      double* sums = sums_.data() + size * m;
      for (std::size_t row = 0; row < height; ++row) {
        double of_row = 0;
        for (std::size_t column = 0; column < width; ++column) {
          of_row +=
              double{preprocess::TexelMagnitude(field, static_cast<int>(m), row * width + column)};
          sums[(row + 1) * (width + 1) + column + 1] =
              sums[row * (width + 1) + column + 1] + of_row;
        }
      }
    }
  });
}

double ImageShares::SumOf(std::size_t image, std::size_t c0, std::size_t r0, std::size_t c1,
                          std::size_t r1) const {
  const auto stride = static_cast<std::size_t>(geometry_.lattice.width) + 1;
  const double* s =
      sums_.data() + image * stride * (static_cast<std::size_t>(geometry_.lattice.height) + 1);
  return std::max(
      0.0, s[r1 * stride + c1] - s[r0 * stride + c1] - s[r1 * stride + c0] + s[r0 * stride + c0]);
}

std::optional<double> ImageShares::At(lightfield::Vec3 p) const {
  if (!(p.z > 0)) return {};
  const auto& [delta_m, grid, lattice, channels, unit] = geometry_;
  const auto columns = lightfield::ProjectAllTexels(grid.basis, grid.u0_m, grid.spacing_m,
                                                    grid.width, TexelAxis::Columns(lattice),
                                                    PencilAxis::ThroughPoint(p.x, p.z, delta_m));
  const auto rows = lightfield::ProjectAllTexels(grid.basis, grid.v0_m, grid.spacing_m, grid.height,
                                                 TexelAxis::Rows(lattice),
                                                 PencilAxis::ThroughPoint(p.y, p.z, delta_m));
  double sum = 0, squares = 0;
  for (std::size_t j = 0; j < rows.size(); ++j)
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const auto c0 = static_cast<std::size_t>(columns[i].first),
                 r0 = static_cast<std::size_t>(rows[j].first);
      const double a =
          SumOf(j * columns.size() + i, c0, r0, c0 + columns[i].size(), r0 + rows[j].size());
      sum += a;
      squares += a * a;
    }
  if (!(squares > 0)) return {};
  return sum * sum / (squares * static_cast<double>(rows.size() * columns.size()));
}

core::Image ImageSharesAt(const LitScene& scene, std::span<const lightfield::Vec3> points) {
  struct Lamp {
    const ImageShares& shares;
    scene::Pose luminaire_from_world;
  };
  std::map<const LoadedLightField*, ImageShares> shares;
  std::vector<Lamp> lamps;
  for (const PlacedLuminaire& luminaire : scene.luminaires()) {
    if (!(std::ranges::max(luminaire.scale) > 0)) continue;
    const LoadedLightField* loaded = luminaire.light_field.get();
    auto known = shares.find(loaded);
    if (known == shares.end())
      known = shares.emplace(loaded, ImageShares(loaded->on_device.Download())).first;
    lamps.push_back({known->second, luminaire.world_from_luminaire.Inverse()});
  }
  core::Image means(static_cast<int>(points.size()), 1, 1);
  constexpr std::size_t kGrain = 64;
  core::ParallelFor(points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    core::ThrowIfInterrupted();
    for (std::size_t k = begin; k < end; ++k) {
      double sum = 0;
      int reached = 0;
      for (const Lamp& lamp : lamps)
        if (const auto share = lamp.shares.At(lamp.luminaire_from_world.Point(points[k]))) {
          sum += *share;
          ++reached;
        }
      means.data[k] =
          reached > 0 ? static_cast<float>(sum / reached) : std::numeric_limits<float>::quiet_NaN();
    }
  });
  return means;
}

}  // namespace luxfield::render
