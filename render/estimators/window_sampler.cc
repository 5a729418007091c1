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
constexpr char kWindowsPath[] = "kernels/luminaire/window_masses.cl";

// The knot cells of a luminaire as the images of another: they have a box for a basis.
LuminaireParams CellsAsImages(LuminaireParams params) {
  for (AxisParams& axis : params.axis) axis.count += params.basis.cells - 1;
  params.basis = {};
  params.basis.cells = 1;
  params.basis.left[0][0] = params.basis.right[0][0] = 1;
  return params;
}

}  // namespace

WindowSampler::WindowKernels::WindowKernels(const Device& device, const std::string& build_options)
    : spans(Program::Build(device, kWindowsPath, build_options), "WindowSpans"),
      masses(Program::Build(device, kWindowsPath, build_options), "WindowMasses") {}

WindowSampler::WindowSampler(const Device& device, const std::string& path,
                             const std::string& kernel, const std::string& build_options,
                             bool masses_are_seen, WindowsOf windows_of)
    : device_(device),
      path_(path),
      kernel_name_(kernel),
      build_options_(build_options),
      windows_of_(windows_of),
      masses_are_seen_(masses_are_seen),
      shadow_(device) {}

void WindowSampler::CheckOptions(const EstimatorOptions& options) {
  MakeSamplingParams(options);
  if (!(options.max_samples_per_image >= 0))
    throw InputError(fmt::format("samples per image = {} must be above 0, or 0 for no bound",
                                 options.max_samples_per_image));
}

void WindowSampler::UploadParams(const LightTasks& tasks) {
  std::vector<LuminaireParams> luminaires, windows;
  for (const LightSource& source : tasks.lights) {
    const auto& [luminaire, world_from_luminaire] = std::get<PosedLuminaire>(source);
    luminaires.push_back(
        MakeLuminaireParams(luminaire.geometry(), luminaire.row_stride(), world_from_luminaire));
    windows.push_back(windows_of_ == WindowsOf::kCells ? CellsAsImages(luminaires.back())
                                                       : luminaires.back());
  }
  luminaire_params_ = Buffer::From(device_, luminaires);
  window_params_ = Buffer::From(device_, windows);
  columns_ = static_cast<std::size_t>(windows.front().axis[0].count);
  rows_ = static_cast<std::size_t>(windows.front().axis[1].count);
}

Kernel& WindowSampler::Begin(const std::string& estimator, const GBuffer& gbuffer,
                             const LightTasks& tasks, const EstimatorOptions& options) {
  const LuminaireOnDevice& luminaire = LuminaireOf(tasks);
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
  UploadParams(tasks);
  options_ = options;
  first_ = next_ = tasks.begin;
  end_ = tasks.end;
  const std::size_t points = end_ - next_, axes = columns_ + rows_,
                    mass_bytes = columns_ * rows_ * sizeof(float);
  const std::size_t bytes_per_pixel = axes * sizeof(cl_int4) + mass_bytes;
  const std::size_t scratch = device_.info().is_cpu ? kCpuScratchBytes : kScratchBytes;
  const std::size_t units =
      std::clamp(scratch / bytes_per_pixel / kBatchUnit, std::size_t{1},
                 std::max((points + kBatchUnit - 1) / kBatchUnit, std::size_t{1}));
  batch_ = std::min(units * kBatchUnit, shadow_.pixels_at_once());
  stride_ = (batch_ + kBatchUnit - 1) / kBatchUnit * kBatchUnit;
  const auto ensure = [&](Buffer& buffer, std::size_t bytes) {
    if (buffer.bytes() != bytes) buffer = Buffer(device_, bytes);
  };
  ensure(spans_, stride_ * axes * sizeof(cl_int4));
  ensure(masses_, stride_ * mass_bytes);
  const bool glossy = gbuffer.glossy(), has_tasks = tasks.tasks != nullptr;
  const std::string task_options = fmt::format("-D TASKS={}", int{has_tasks});
  if (!window_kernels_.contains(has_tasks))
    window_kernels_.emplace(has_tasks, WindowKernels(device_, task_options));
  auto kernel = kernels_.find({glossy, has_tasks});
  if (kernel == kernels_.end())
    kernel = kernels_
                 .emplace(std::pair(glossy, has_tasks),
                          Kernel(Program::Build(device_, path_,
                                                fmt::format("-D GLOSSY={} {} {}", int{glossy},
                                                            task_options, build_options_)),
                                 kernel_name_))
                 .first;
  return kernel->second;
}

bool WindowSampler::NextBatch(const GBuffer& gbuffer, const LightTasks& tasks, const Buffer& seen) {
  if (next_ >= end_) return false;
  const LuminaireOnDevice& luminaire = LuminaireOf(tasks);
  SamplingParams params = MakeSamplingParams(options_);
  params.max_per_image = options_.max_samples_per_image;
  first_ = next_;
  next_ = std::min(first_ + batch_, end_);
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
  WindowKernels& windows = window_kernels_.at(tasks.tasks != nullptr);
  const Buffer& own_tasks = tasks.tasks ? *tasks.tasks : none;
  windows.spans.Set(window_params_, sampling_params_, own_tasks, gbuffer.position, spans_)
      .Enqueue({stride_, 2}, {kBatchUnit});
  windows.masses
      .Set(window_params_, sampling_params_, own_tasks, Sat(luminaire), SatScale(luminaire),
           masses_are_seen_ ? seen : none, spans_, masses_)
      .Enqueue({stride_, rows_}, {kBatchUnit});
  return true;
}

}  // namespace luxfield::render
