#include "render/estimators/window_sampler.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "render/estimators/luminaire_params.h"
#include "render/kernels/sampling_types.clh"

namespace luxfield::render {
namespace {

constexpr std::size_t kScratchBytes = std::size_t{32} << 20;
constexpr std::size_t kBatchUnit = 64;  // pixels: rows of scratch memory begin on cache lines
constexpr int kMaxSamples =
    1 << 20;  // cumulative expectations stay exact to 1/16 sample in float32

}  // namespace

WindowSampler::WindowSampler(const Device& device, const std::string& kernel)
    : device_(device), kernel_name_(kernel) {}

Kernel& WindowSampler::Begin(const std::string& estimator, const GBuffer& gbuffer,
                             const LuminaireOnDevice& luminaire,
                             const scene::Pose& world_from_luminaire,
                             const EstimatorOptions& options) {
  if (!luminaire.has_sat())
    throw InputError(fmt::format(
        "estimator '{}' needs sampling tables; make them with 'luxfield preprocess' and name "
        "them beside the light field",
        estimator));
  if (options.samples_per_pixel < 1 || options.samples_per_pixel > kMaxSamples)
    throw InputError(fmt::format("samples per pixel = {} must be 1 to {}",
                                 options.samples_per_pixel, kMaxSamples));
  if (!(options.max_samples_per_image >= 0))
    throw InputError(fmt::format("samples per image = {} must be above 0, or 0 for no bound",
                                 options.max_samples_per_image));
  const LuminaireParams params =
      MakeLuminaireParams(luminaire.geometry(), luminaire.row_stride(), world_from_luminaire);
  luminaire_params_ = Buffer::From(device_, std::span<const LuminaireParams>(&params, 1));
  options_ = options;
  pixel_count_ = gbuffer.pixel_count();
  next_ = 0;
  const std::size_t images = luminaire.geometry().grid.count();
  const std::size_t batch =
      std::clamp(kScratchBytes / (images * sizeof(float)) / kBatchUnit, std::size_t{1},
                 (pixel_count_ + kBatchUnit - 1) / kBatchUnit) *
      kBatchUnit;
  if (batch != batch_ || scratch_.bytes() != batch * images * sizeof(float))
    scratch_ = Buffer(device_, batch * images * sizeof(float));
  batch_ = batch;
  auto& kernel = gbuffer.glossy() ? glossy_ : diffuse_;
  if (!kernel)
    kernel.emplace(Program::Build(device_, "kernels/windowed.cl",
                                  fmt::format("-D GLOSSY={}", gbuffer.glossy() ? 1 : 0)),
                   kernel_name_);
  return *kernel;
}

bool WindowSampler::NextBatch() {
  if (next_ >= pixel_count_) return false;
  SamplingParams params{};
  params.samples = options_.samples_per_pixel;
  params.max_per_image = options_.max_samples_per_image;
  params.seed_lo = static_cast<std::uint32_t>(options_.seed);
  params.seed_hi = static_cast<std::uint32_t>(options_.seed >> 32);
  params.stream = options_.stream;
  params.first_pixel = options_.first_pixel;
  params.begin = static_cast<int>(next_);
  params.end = static_cast<int>(std::min(next_ + batch_, pixel_count_));
  params.scratch_stride = static_cast<int>(batch_);
  // A buffer of its own per launch: earlier launches may still read theirs.
  sampling_params_ = Buffer::From(device_, std::span<const SamplingParams>(&params, 1));
  next_ += batch_;
  return true;
}

}  // namespace luxfield::render
