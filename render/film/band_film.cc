#include "luxfield/render/film/band_film.h"

#include <fmt/format.h>

#include "luxfield/core/error.h"

namespace luxfield::render {
namespace {

constexpr char kPath[] = "kernels/film/film.cl";
constexpr std::size_t kGroup = 64;  // pixels of a work-group, in kernels over rows

Buffer Zeros(const Device& device, std::size_t bytes) {
  Buffer buffer(device, bytes);
  buffer.FillZero();
  return buffer;
}

std::vector<float> Row(const Buffer& buffer, std::size_t row, std::size_t pixels) {
  std::vector<float> values(pixels);
  buffer.Download(std::span<float>(values), row * pixels);
  return values;
}

cl_float4 Float4(const core::Rgb& c) {
  return {{static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]), 0}};
}

// 100 bytes a pixel and so on (band_film.h).
void RequireRoom(const Device& device, const BandFilm::Size& size) {
  const std::size_t spread = size.passes > 1 ? 12 : 0;
  const std::size_t row = size.pixels * sizeof(cl_float2) * (1 + size.lights_apart);
  const std::size_t bytes = size.pixels * (100 + spread + size.lights_apart * (16 + spread) +
                                           size.groups * 2 * sizeof(cl_float4));
  if (bytes <= device.info().global_memory_bytes && row <= device.info().max_allocation_bytes)
    return;
  throw DeviceError(fmt::format(
      "the film of {} pixels with {} lights told apart and {} light groups takes {:.0f} MiB, more "
      "than '{}' has; render with fewer lights at a time, without light groups or on another "
      "--device",
      size.pixels, size.lights_apart, size.groups, static_cast<double>(bytes) / 0x1p20,
      device.info().name));
}

}  // namespace

FilmKernels::FilmKernels(const Device& on)
    : device(on),
      add_light(Program::Build(on, kPath), "AddLight"),
      add_drawn_lights(Program::Build(on, kPath), "AddDrawnLights"),
      add_drawn_group(Program::Build(on, kPath), "AddDrawnGroup"),
      add_pass(Program::Build(on, kPath), "AddPass"),
      add_luminances(Program::Build(on, kPath), "AddLuminances"),
      add_variances(Program::Build(on, kPath), "AddVariances"),
      add_radiance(Program::Build(on, kPath), "AddRadiance"),
      add_hits(Program::Build(on, kPath), "AddHits"),
      gather_pixels(Program::Build(on, kPath), "GatherPixels") {}

FilmLight::FilmLight(const Device& device, std::size_t pixels)
    : radiance(Zeros(device, pixels * sizeof(cl_float4))),
      irradiance(Zeros(device, pixels * sizeof(cl_float4))) {}

PassSums::PassSums(FilmKernels& kernels, std::size_t pixels, std::size_t lights_apart)
    : kernels_(kernels),
      pixels_(pixels),
      rows_(1 + lights_apart),
      light_(kernels.device, pixels),
      samples_(Zeros(kernels.device, pixels * sizeof(float))),
      luminances_(Zeros(kernels.device, rows_ * pixels * sizeof(float))),
      stated_(Zeros(kernels.device, rows_ * pixels * sizeof(float))) {}

void PassSums::Clear() {
  for (Buffer* buffer : {&light_.radiance, &light_.irradiance, &samples_, &luminances_, &stated_})
    buffer->FillZero();
}

void PassSums::Add(const FilmPart& part, const core::Rgb& scale, std::size_t light,
                   FilmLight* group, int passes) {
  const Lighting& lighting = part.lighting;
  const Buffer none;
  const std::size_t points = part.gbuffer.pixel_count();
  kernels_.add_light
      .Set(lighting.irradiance, lighting.reflected, lighting.variance, lighting.samples,
           part.gbuffer.albedo, part.pixels, static_cast<cl_int>(points),
           static_cast<cl_int>(pixels_), Float4(scale),
           static_cast<cl_int>(rows_ > 1 ? 1 + light : 0), static_cast<cl_float>(passes),
           light_.radiance, light_.irradiance, samples_, luminances_, stated_,
           group ? group->radiance : none, group ? group->irradiance : none)
      .Enqueue(points);
}

void PassSums::Add(const FilmPart& part, const FilmDraws& drawn, std::span<FilmLight> groups,
                   int passes) {
  if (drawn.draws.empty()) return;
  const Lighting& found = drawn.found;
  const std::size_t points = drawn.starts.size() - 1;
  const Buffer starts = Buffer::From(kernels_.device, drawn.starts),
               draws = Buffer::From(kernels_.device, drawn.draws);
  kernels_.add_drawn_lights
      .Set(found.irradiance, found.reflected, found.variance, found.samples, part.gbuffer.albedo,
           part.pixels, static_cast<cl_int>(drawn.first_point), static_cast<cl_int>(points), starts,
           draws, static_cast<cl_int>(pixels_), cl_int{rows_ > 1}, light_.radiance,
           light_.irradiance, samples_, luminances_, stated_)
      .Enqueue(points);
  for (std::size_t g = 0; g < groups.size(); ++g)
    kernels_.add_drawn_group
        .Set(found.irradiance, found.reflected, found.variance, found.samples, part.gbuffer.albedo,
             part.pixels, static_cast<cl_int>(drawn.first_point), static_cast<cl_int>(points),
             starts, draws, static_cast<cl_int>(g), static_cast<cl_float>(passes),
             groups[g].radiance, groups[g].irradiance)
        .Enqueue(points);
}

std::vector<float> PassSums::Luminances(std::size_t row) const {
  return Row(luminances_, row, pixels_);
}

std::vector<float> PassSums::StatedVariances(std::size_t row) const {
  return Row(stated_, row, pixels_);
}

BandFilm::BandFilm(FilmKernels& kernels, const Size& size)
    : kernels_((RequireRoom(kernels.device, size), kernels)),
      size_(size),
      sums_(kernels, size.pixels, size.lights_apart),
      light_(kernels.device, size.pixels),
      coverage_(Zeros(kernels.device, size.pixels * sizeof(float))),
      hits_(kernels.device, size.pixels * sizeof(float)),
      samples_(Zeros(kernels.device, size.pixels * sizeof(float))),
      stated_(Zeros(kernels.device, size.pixels * sizeof(float))),
      luminances_(Zeros(kernels.device, sums_.rows() * size.pixels * sizeof(float))),
      variances_(Zeros(kernels.device, sums_.rows() * size.pixels * sizeof(float))) {
  for (std::size_t g = 0; g < size.groups; ++g) groups_.emplace_back(kernels.device, size.pixels);
  if (size.passes == 1) return;
  means_ = Buffer(kernels.device, sums_.rows() * size.pixels * sizeof(cl_float2));
  squares_ = Buffer(kernels.device, sums_.rows() * size.pixels * sizeof(float));
}

void BandFilm::AddHits(const GBuffer& gbuffer) {
  kernels_.add_hits.Set(gbuffer.position, static_cast<cl_int>(size_.pixels), hits_, coverage_)
      .Enqueue(size_.pixels);
}

void BandFilm::AddRadiance(const Buffer& radiance, double scale, int group) {
  const Buffer none;
  kernels_.add_radiance
      .Set(radiance, static_cast<cl_int>(size_.pixels), static_cast<cl_float>(scale),
           light_.radiance, group < 0 ? none : groups_[group].radiance)
      .Enqueue(size_.pixels);
}

void BandFilm::AddPass(int pass) {
  const auto count = static_cast<cl_int>(size_.pixels), rows = static_cast<cl_int>(sums_.rows());
  kernels_.add_pass
      .Set(sums_.light_.radiance, sums_.light_.irradiance, sums_.samples_, sums_.stated_, count,
           static_cast<cl_float>(size_.passes), light_.radiance, light_.irradiance, samples_,
           stated_)
      .Enqueue(size_.pixels);
  kernels_.add_luminances
      .Set(sums_.luminances_, count, rows, static_cast<cl_int>(pass), luminances_, means_, squares_)
      .Enqueue({size_.pixels, sums_.rows()}, {kGroup});
}

void BandFilm::AddVariances() {
  kernels_.add_variances
      .Set(sums_.stated_, squares_, static_cast<cl_int>(size_.pixels),
           static_cast<cl_int>(sums_.rows()), static_cast<cl_float>(size_.passes), variances_)
      .Enqueue({size_.pixels, sums_.rows()}, {kGroup});
}

BandFilm::Sums BandFilm::Download() const {
  Sums sums;
  sums.radiance = light_.radiance.Download<cl_float4>();
  sums.irradiance = light_.irradiance.Download<cl_float4>();
  sums.coverage = coverage_.Download<float>();
  sums.samples = samples_.Download<float>();
  sums.stated = stated_.Download<float>();
  for (std::size_t row = 0; row < sums_.rows(); ++row) {
    sums.variance.push_back(Row(variances_, row, size_.pixels));
    sums.luminance.push_back(Row(luminances_, row, size_.pixels));
  }
  for (const FilmLight& group : groups_) {
    sums.group_radiance.push_back(group.radiance.Download<cl_float4>());
    sums.group_irradiance.push_back(group.irradiance.Download<cl_float4>());
  }
  return sums;
}

GBuffer GatherPoints(FilmKernels& kernels, const GBuffer& gbuffer,
                     std::span<const std::size_t> pixels) {
  GBuffer points(kernels.device, static_cast<int>(pixels.size()), 1, gbuffer.glossy());
  points.eye = gbuffer.eye;
  const Buffer list =
      Buffer::From(kernels.device, std::vector<cl_int>(pixels.begin(), pixels.end()));
  const auto gather = [&](const Buffer& values, const Buffer& gathered) {
    kernels.gather_pixels.Set(list, static_cast<cl_int>(pixels.size()), values, gathered)
        .Enqueue(pixels.size());
  };
  gather(gbuffer.position, points.position);
  gather(gbuffer.normal, points.normal);
  gather(gbuffer.albedo, points.albedo);
  if (gbuffer.glossy()) gather(gbuffer.gloss, points.gloss);
  return points;
}

}  // namespace luxfield::render
