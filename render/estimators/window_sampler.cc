#include "luxfield/render/estimators/window_sampler.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/core/error.h"
#include "luxfield/render/estimators/sampling_params.h"
#include "luxfield/render/lights/luminaire_params.h"

namespace luxfield::render {
namespace {

// Scratch memory of a batch: on a CPU it should stay in the cache, elsewhere fill the device.
constexpr std::size_t kCpuScratchBytes = std::size_t{8} << 20,
                      kScratchBytes = std::size_t{128} << 20;
constexpr std::size_t kBatchUnit = 64;     // pixels: rows of scratch memory begin on cache lines
constexpr int kMaxTexels = (1 << 16) - 1;  // PackSpan

// The knot cells of a luminaire as the images of another: they have a box for a basis.
LuminaireParams CellsAsImages(LuminaireParams params) {
  for (AxisParams& axis : params.axis) axis.count += params.basis.cells - 1;
  params.basis = {};
  params.basis.cells = 1;
  params.basis.left[0][0] = params.basis.right[0][0] = 1;
  return params;
}

}  // namespace

WindowSampler::WindowSampler(const Device& device, const std::string& path,
                             const std::string& kernel, const std::string& build_options,
                             bool masses_are_seen, WindowsOf windows_of)
    : device_(device),
      path_(path),
      kernel_name_(kernel),
      build_options_(build_options),
      windows_of_(windows_of),
      masses_are_seen_(masses_are_seen),
      window_spans_(Program::Build(device, "kernels/luminaire/window_masses.cl"), "WindowSpans"),
      window_masses_(Program::Build(device, "kernels/luminaire/window_masses.cl"), "WindowMasses"),
      shadow_(device) {}

void WindowSampler::CheckOptions(const EstimatorOptions& options) {
  MakeSamplingParams(options);
  if (!(options.max_samples_per_image >= 0))
    throw InputError(fmt::format("samples per image = {} must be above 0, or 0 for no bound",
                                 options.max_samples_per_image));
}

Kernel& WindowSampler::Begin(const std::string& estimator, const GBuffer& gbuffer,
                             const PosedLuminaire& posed, const EstimatorOptions& options) {
  const auto& [luminaire, world_from_luminaire] = posed;
  if (!Sat(luminaire))
    throw InputError(fmt::format(
        "estimator '{}' needs sampling tables of the luminaire's {} and it has none; build them "
        "from its light field",
        estimator, windows_of_ == WindowsOf::kCells ? "cells" : "images"));
  CheckOptions(options);
  const auto& lattice = luminaire.geometry().lattice;
  if (std::max(lattice.width, lattice.height) > kMaxTexels)
    throw InputError(fmt::format(
        "coefficient images of {} x {} texels exceed the {} texels along an axis that sampling "
        "estimators take; use 'exact', or resample the light field",
        lattice.width, lattice.height, kMaxTexels));
  const LuminaireParams params =
      MakeLuminaireParams(luminaire.geometry(), luminaire.row_stride(), world_from_luminaire);
  luminaire_params_ = Buffer::From(device_, std::span<const LuminaireParams>(&params, 1));
  const LuminaireParams windows = windows_of_ == WindowsOf::kCells ? CellsAsImages(params) : params;
  window_params_ = Buffer::From(device_, std::span<const LuminaireParams>(&windows, 1));
  options_ = options;
  pixel_count_ = gbuffer.pixel_count();
  first_ = next_ = 0;
  const auto columns = static_cast<std::size_t>(windows.axis[0].count);
  rows_ = static_cast<std::size_t>(windows.axis[1].count);
  axes_ = columns + rows_;
  const std::size_t mass_bytes = columns * rows_ * sizeof(float);
  const std::size_t bytes_per_pixel = axes_ * sizeof(cl_int4) + mass_bytes;
  const std::size_t scratch = device_.info().is_cpu ? kCpuScratchBytes : kScratchBytes;
  const std::size_t units = std::clamp(scratch / bytes_per_pixel / kBatchUnit, std::size_t{1},
                                       (pixel_count_ + kBatchUnit - 1) / kBatchUnit);
  batch_ = std::min(units * kBatchUnit, shadow_.pixels_at_once());
  stride_ = (batch_ + kBatchUnit - 1) / kBatchUnit * kBatchUnit;
  const auto ensure = [&](Buffer& buffer, std::size_t bytes) {
    if (buffer.bytes() != bytes) buffer = Buffer(device_, bytes);
  };
  ensure(spans_, stride_ * axes_ * sizeof(cl_int4));
  ensure(masses_, stride_ * mass_bytes);
  const bool glossy = gbuffer.glossy();
  auto kernel = kernels_.find(glossy);
  if (kernel == kernels_.end())
    kernel = kernels_
                 .emplace(glossy, Kernel(Program::Build(device_, path_,
                                                        fmt::format("-D GLOSSY={} {}", int{glossy},
                                                                    build_options_)),
                                         kernel_name_))
                 .first;
  return kernel->second;
}

bool WindowSampler::NextBatch(const GBuffer& gbuffer, const LuminaireOnDevice& luminaire,
                              const Buffer& seen) {
  if (next_ >= pixel_count_) return false;
  SamplingParams params = MakeSamplingParams(options_);
  params.max_per_image = options_.max_samples_per_image;
  first_ = next_;
  next_ = std::min(first_ + batch_, pixel_count_);
  params.begin = static_cast<int>(first_);
  params.end = static_cast<int>(next_);
  params.scratch_stride = static_cast<int>(stride_);
  params.shadow_rays = shadow_.per_pixel();
  params.basis_share = options_.knobs.basis_share;
  params.brdf_share = options_.knobs.brdf_share;
  params.systematic = options_.knobs.systematic;
  params.secant = options_.knobs.secant;
  params.depth = options_.knobs.depth;
  params.decorrelated = options_.knobs.decorrelated;
  params.digital = options_.knobs.sequence == Sequence::kSobol;
  params.sequence = static_cast<std::uint32_t>(options_.samples_per_pixel) + 1;
  // A buffer of its own per launch: earlier launches may still read theirs.
  sampling_params_ = Buffer::From(device_, std::span<const SamplingParams>(&params, 1));
  const Buffer none;
  window_spans_.Set(window_params_, sampling_params_, gbuffer.position, spans_)
      .Enqueue({stride_, 2}, {kBatchUnit});
  window_masses_
      .Set(window_params_, sampling_params_, Sat(luminaire), SatScale(luminaire),
           masses_are_seen_ ? seen : none, spans_, masses_)
      .Enqueue({stride_, rows_}, {kBatchUnit});
  return true;
}

}  // namespace luxfield::render
