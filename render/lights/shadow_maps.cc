#include "luxfield/render/lights/shadow_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/render/kernels/luminaire/shadow_map_types.clh"
#include "luxfield/render/lights/luminaire_params.h"

namespace luxfield::render {
namespace {

constexpr std::size_t kRaysAtOnce = std::size_t{1} << 17;

Program BuildProgram(const Device& device) {
  return Program::Build(device, "kernels/luminaire/shadow_maps.cl");
}

struct Interval {
  double low, high;
};

// The tangents along one axis under which a view at (origin, z) sees the receivers p, at least
// delta in front of it, that light from u in `lamp` through s in `image` reaches: with p at the
// distance d before the view, p = u + (s - u)(z + d) / delta, and (p - origin) / d is linear in u,
// s and 1 / d.
Interval Tangents(double origin, double z, double delta, Interval lamp, Interval image) {
  Interval tangents{1e30, -1e30};
  for (const double u : {lamp.low, lamp.high})
    for (const double s : {image.low, image.high})
      for (const double inverse : {0.0, 1 / delta}) {
        const double tangent = (u + (s - u) * z / delta - origin) * inverse + (s - u) / delta;
        tangents.low = std::min(tangents.low, tangent);
        tangents.high = std::max(tangents.high, tangent);
      }
  return tangents;
}

ShadowView MakeView(const lightfield::LuminaireGeometry& luminaire, int cell_i, int cell_j,
                    const CellLight& light, int size) {
  const auto& grid = luminaire.grid;
  const auto& lattice = luminaire.lattice;
  // The supports of all images over the cell, not the cell alone: where one part of a support can
  // light a receiver, every map under it must know whether that is hidden.
  const double h = grid.spacing_m, below = (grid.basis.cells - 1) * h, above = grid.basis.cells * h;
  const double u = grid.u0_m + cell_i * h, v = grid.v0_m + cell_j * h;
  const Interval lamp[2] = {{u - below, u + above}, {v - below, v + above}};
  const Interval image[2] = {{lattice.s0_m, lattice.s0_m + lattice.extent_s_m()},
                             {lattice.t1_m - lattice.extent_t_m(), lattice.t1_m}};
  const double origin[2] = {light.position.x, light.position.y};
  ShadowView view{};
  view.lit = light.lit;
  view.origin[2] = static_cast<float>(light.position.z);
  Interval tangents[2];
  for (int axis = 0; axis < 2; ++axis)
    tangents[axis] =
        Tangents(origin[axis], light.position.z, luminaire.delta_m, lamp[axis], image[axis]);
  // A border for receivers that are lit before they are lifted and outside afterwards.
  const double lift =
      0.5 * kShadowTilt *
      std::hypot(tangents[0].high - tangents[0].low, tangents[1].high - tangents[1].low) / size;
  for (int axis = 0; axis < 2; ++axis) {
    auto& [low, high] = tangents[axis];
    const double border = 1.5 * lift * (1 + std::max(std::abs(low), std::abs(high)));
    view.origin[axis] = static_cast<float>(origin[axis]);
    view.low[axis] = static_cast<float>(low - border);
    view.texel[axis] = static_cast<float>((high - low + 2 * border) / size);
  }
  return view;
}

}  // namespace

std::vector<CellLight> CellCentres(const lightfield::BasisGrid& grid,
                                   const std::vector<bool>& lit_images) {
  const int n = grid.basis.cells, columns = grid.width + n - 1, rows = grid.height + n - 1;
  std::vector<CellLight> lights;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
      lights.push_back(
          {{grid.u0_m + (i + 0.5) * grid.spacing_m, grid.v0_m + (j + 0.5) * grid.spacing_m, 0},
           false});
  for (int m = 0; m < grid.count(); ++m) {
    if (!lit_images[m]) continue;
    for (int j = m / grid.width; j < m / grid.width + n; ++j)
      for (int i = m % grid.width; i < m % grid.width + n; ++i) lights[j * columns + i].lit = true;
  }
  return lights;
}

std::vector<CellLight> CellCentres(const lightfield::LightField& field) {
  const std::size_t image_size = field.geometry.plane_size() * field.geometry.channels;
  std::vector<bool> lit;
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    lit.push_back(std::ranges::any_of(std::span(field.data).subspan(m * image_size, image_size),
                                      [](float c) { return c != 0; }));
  return CellCentres(field.geometry.grid, lit);
}

std::vector<CellLight> ReferencePositions(
    const lightfield::LuminaireGeometry& luminaire,
    const std::vector<preprocess::ReferencePosition>& reference) {
  std::vector<CellLight> lights;
  for (const auto& cell : reference)
    lights.push_back({{cell.s_m, cell.t_m, luminaire.delta_m}, cell.images > 0});
  return lights;
}

std::size_t ShadowMaps::Bytes(const lightfield::BasisGrid& grid, int size) {
  const auto side = static_cast<std::size_t>(size);
  return side * side * static_cast<std::size_t>(CellCount(grid)) * sizeof(cl_float);
}

ShadowMaps::ShadowMaps(const Device& device, const lightfield::LuminaireGeometry& luminaire,
                       const std::vector<CellLight>& lights,
                       const scene::Pose& world_from_luminaire, const RayScene& rays, int size)
    : device_(device),
      cells_(static_cast<int>(lights.size())),
      size_(size),
      see_cells_(BuildProgram(device), "SeeCells") {
  if (size < kMinSize || size > kMaxSize)
    throw InputError(fmt::format("shadow map size = {} must lie in [{}, {}]; choose a size there",
                                 size, kMinSize, kMaxSize));
  const std::size_t texels = static_cast<std::size_t>(size) * size;
  const std::size_t bytes = Bytes(luminaire.grid, size);
  if (bytes > device.info().max_allocation_bytes)
    throw InputError(fmt::format(
        "{} shadow maps of {} x {} take {:.0f} MiB, device '{}' allocates at most {:.0f} MiB at "
        "once; ask for smaller maps",
        cells_, size, size, static_cast<double>(bytes) / 0x1p20, device.info().name,
        static_cast<double>(device.info().max_allocation_bytes) / 0x1p20));
  const int columns = luminaire.grid.width + luminaire.grid.basis.cells - 1;
  std::vector<ShadowView> views;
  for (int cell = 0; cell < cells_; ++cell) {
    views.push_back(MakeView(luminaire, cell % columns, cell / columns, lights[cell], size));
    map_count_ += lights[cell].lit;
  }
  const LuminaireParams params = MakeLuminaireParams(luminaire, 0, world_from_luminaire);
  params_ = Buffer::From(device, std::span<const LuminaireParams>(&params, 1));
  views_ = Buffer::From(device, views);
  depth_ = Buffer(device, bytes);
  Cast(rays, texels * lights.size());
}

void ShadowMaps::Cast(const RayScene& scene, std::size_t texels) {
  const Program program = BuildProgram(device_);
  Kernel cast(program, "CastShadowMaps"), store(program, "StoreDepths");
  const std::size_t at_once = std::min(texels, kRaysAtOnce);
  const Buffer rays(device_, at_once * sizeof(scene::PackedRay)),
      hits(device_, at_once * sizeof(scene::PackedHit));
  for (std::size_t first = 0; first < texels; first += at_once) {
    const std::size_t count = std::min(at_once, texels - first);
    cast.Set(params_, views_, static_cast<cl_int>(size_), static_cast<cl_ulong>(first),
             static_cast<cl_int>(count), rays)
        .Enqueue(count);
    scene.Intersect({.rays = rays, .group_count = count, .coherent = true}, hits);
    store.Set(static_cast<cl_ulong>(first), static_cast<cl_int>(count), hits, depth_)
        .Enqueue(count);
  }
}

Buffer ShadowMaps::SeeCells(const GBuffer& gbuffer) const {
  const std::size_t words = (cells_ + 31) / 32;
  Buffer seen(device_, gbuffer.pixel_count() * words * sizeof(cl_uint));
  see_cells_
      .Set(params_, views_, static_cast<cl_int>(cells_), static_cast<cl_int>(size_), depth_,
           gbuffer.position, gbuffer.normal, static_cast<cl_int>(gbuffer.pixel_count()), seen)
      .Enqueue(gbuffer.pixel_count());
  return seen;
}

}  // namespace luxfield::render
