#include "luxfield/render/lights/patch_shadows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/render/kernels/luminaire/patch_types.clh"
#include "luxfield/render/kernels/scene/bvh_types.clh"
#include "luxfield/render/lights/luminaire_params.h"

namespace luxfield::render {
namespace {

constexpr int kLanes = 16;          // texels of a row are drawn together
constexpr int kPatchesPerUnit = 8;  // of a CPU: maps for each core, more cores share one

// Along one axis.
struct Range {
  double low = 1e30, high = -1e30;

  void Widen(double x) { low = std::min(low, x), high = std::max(high, x); }
};

// The tangents under which `origin` sees what light from u in `patch` through s in `image` reaches
// at least delta away: p = u + (s - u) z / delta, and (p - origin) / z is linear in u, s and 1 / z.
Range Tangents(double origin, const Range& patch, const Range& image, double delta) {
  Range tangents;
  for (const double u : {patch.low, patch.high})
    for (const double s : {image.low, image.high})
      for (const double inverse : {0.0, 1 / delta})
        tangents.Widen((u - origin) * inverse + (s - u) / delta);
  return tangents;
}

PatchAxis MakeAxis(const preprocess::VolumeAxis& axis) {
  return {static_cast<float>(axis.first), static_cast<float>(1 / axis.spacing), axis.nodes};
}

PatchParams MakePatchParams(const LuminaireOnDevice& luminaire, int size) {
  const lightfield::LuminaireGeometry& geometry = luminaire.geometry();
  const auto& lattice = geometry.lattice;
  const Range image[2] = {{lattice.s0_m, lattice.s0_m + lattice.extent_s_m()},
                          {lattice.t1_m - lattice.extent_t_m(), lattice.t1_m}};
  PatchParams params{};
  params.size = size;
  params.lit = luminaire.lit_patches();
  const auto patches = preprocess::PatchesOf(geometry);
  double middle[kPatchCount][2], widest = 0;
  for (int k = 0; k < kPatchCount; ++k) {
    const preprocess::Patch& patch = patches[k];
    const Range x = Tangents(patch.point.x, {patch.low.x, patch.high.x}, image[0],
                             geometry.delta_m),
                y = Tangents(patch.point.y, {patch.low.y, patch.high.y}, image[1],
                             geometry.delta_m);
    params.x[k] = static_cast<float>(patch.point.x);
    params.y[k] = static_cast<float>(patch.point.y);
    middle[k][0] = 0.5 * (x.low + x.high);
    middle[k][1] = 0.5 * (y.low + y.high);
    widest = std::max({widest, x.high - x.low, y.high - y.low});
  }
  // A border of a texel, as four are looked at.
  const double texel = widest / (size - 2);
  params.texel = static_cast<float>(texel);
  for (int k = 0; k < kPatchCount; ++k) {
    params.low_x[k] = static_cast<float>(middle[k][0] - 0.5 * size * texel);
    params.low_y[k] = static_cast<float>(middle[k][1] - 0.5 * size * texel);
  }
  params.nearest = static_cast<float>(1e-6 * geometry.delta_m);
  params.axis[0] = MakeAxis(luminaire.patch_axes().a_x);
  params.axis[1] = MakeAxis(luminaire.patch_axes().a_y);
  params.axis[2] = MakeAxis(luminaire.patch_axes().tau);
  const lightfield::Vec2 centre = preprocess::SupportCentre(geometry);
  params.centre[0] = static_cast<float>(centre.x);
  params.centre[1] = static_cast<float>(centre.y);
  params.extent[0] = static_cast<float>(centre.x - geometry.grid.u0_m);
  params.extent[1] = static_cast<float>(centre.y - geometry.grid.v0_m);
  params.image_low[0] = static_cast<float>(image[0].low - centre.x);
  params.image_high[0] = static_cast<float>(image[0].high - centre.x);
  params.image_low[1] = static_cast<float>(image[1].low - centre.y);
  params.image_high[1] = static_cast<float>(image[1].high - centre.y);
  return params;
}

std::size_t MapBytes(const Device& device, int size) {
  if (size < PatchShadows::kMinSize || size > PatchShadows::kMaxSize)
    throw InputError(fmt::format("shadow map size = {} must lie in [{}, {}]; choose a size there",
                                 size, PatchShadows::kMinSize, PatchShadows::kMaxSize));
  // Rows are read in wide loads, past the last one's end.
  const std::size_t bytes = (std::size_t{kPatchCount} * size * size + kLanes) * sizeof(cl_float);
  if (bytes > device.info().max_allocation_bytes)
    throw InputError(fmt::format(
        "{} shadow maps of {} x {} take {:.0f} MiB, device '{}' allocates at most {:.0f} MiB at "
        "once; ask for smaller maps",
        int{kPatchCount}, size, size, static_cast<double>(bytes) / 0x1p20, device.info().name,
        static_cast<double>(device.info().max_allocation_bytes) / 0x1p20));
  return bytes;
}

}  // namespace

PatchShadows::PatchShadows(const Device& device, const LuminaireOnDevice& luminaire,
                           const scene::Pose& world_from_luminaire, const DeviceBvh& bvh, int size)
    : device_(device),
      luminaire_(&luminaire),
      size_(RoundUp(size)),
      found_(device, sizeof(cl_int)),
      maps_(device, MapBytes(device, size_)),
      gather_(Program::Build(device, "kernels/luminaire/patch_maps.cl"), "GatherPatchTriangles"),
      draw_(Program::Build(device, "kernels/luminaire/patch_maps.cl"), "DrawPatchMaps"),
      share_(Program::Build(device, "kernels/luminaire/patch_shares.cl"), "PatchShares") {
  const PatchParams patches = MakePatchParams(luminaire, size_);
  patches_ = Buffer::From(device, std::span<const PatchParams>(&patches, 1));
  Draw(world_from_luminaire, bvh);
}

int PatchShadows::RoundUp(int size) { return (size + kLanes - 1) / kLanes * kLanes; }

void PatchShadows::Draw(const scene::Pose& world_from_luminaire, const DeviceBvh& bvh) {
  bvh_ = &bvh;
  const LuminaireParams params =
      MakeLuminaireParams(luminaire_->geometry(), luminaire_->row_stride(), world_from_luminaire);
  params_ = Buffer::From(device_, std::span<const LuminaireParams>(&params, 1));
  const std::size_t count = bvh.triangles.bytes() / sizeof(BvhTriangle);
  found_.FillZero();
  if (count > 0) {
    if (triangles_.bytes() != count * sizeof(PatchTriangle))
      triangles_ = Buffer(device_, count * sizeof(PatchTriangle));
    gather_.Set(params_, bvh.triangles, static_cast<cl_int>(count), triangles_, found_)
        .Enqueue(count);
  }
  // A GPU takes every row by itself.
  const int units = device_.info().compute_units;
  const int bands =
      device_.info().is_cpu
          ? std::clamp((units * kPatchesPerUnit + kPatchCount - 1) / kPatchCount, 1, size_)
          : size_;
  draw_.Set(patches_, triangles_, found_, static_cast<cl_int>(bands), maps_)
      .Enqueue({static_cast<std::size_t>(kPatchCount) * bands, 1},
               {device_.info().is_cpu ? std::size_t{1} : std::size_t{64}, 1});
}

const Buffer& PatchShadows::Shares(const GBuffer& gbuffer) const {
  constexpr int kStrip = 16, kStrips = 4;  // patch_shares.cl
  const int tile_height = gbuffer.height >= kStrips ? kStrips : 1,
            tile_width = kStrip * kStrips / tile_height;
  const auto tiles = [](int pixels, int of) {
    return static_cast<std::size_t>((pixels + of - 1) / of);
  };
  const std::size_t bytes = gbuffer.pixel_count() * sizeof(cl_float);
  if (shares_.bytes() != bytes) shares_ = Buffer(device_, bytes);
  share_
      .Set(params_, patches_, maps_, luminaire_->patch_light(), gbuffer.position, gbuffer.normal,
           cl_int{gbuffer.width}, cl_int{gbuffer.height}, cl_int{tile_width}, bvh_->nodes,
           bvh_->triangles, shares_)
      .Enqueue(tiles(gbuffer.width, tile_width) * tiles(gbuffer.height, tile_height));
  return shares_;
}

}  // namespace luxfield::render
