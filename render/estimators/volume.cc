#include "luxfield/render/estimators/volume.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/render/estimators/exact.h"
#include "luxfield/render/estimators/pixel_list.h"
#include "luxfield/render/estimators/visible_share.h"
#include "luxfield/render/lights/luminaire_params.h"
#include "luxfield/render/lights/patch_shadows.h"

namespace luxfield::render {
namespace {

constexpr std::size_t kPixelsPerItem = 16;  // kPixels of volume.cl

// Of the error asked for, what cut texels that are not clipped may take of |J|.
constexpr float kShareOfCuts = 0.5f;

// x and y bit by bit in turns (Morton 1966): pixels by this order lie near those before them along both
// axes.
std::uint64_t MortonCode(std::uint32_t x, std::uint32_t y) {
  std::uint64_t bits = 0;
  for (int k = 0; k < 32; ++k)
    bits |= std::uint64_t{x >> k & 1} << (2 * k) | std::uint64_t{y >> k & 1} << (2 * k + 1);
  return bits;
}

// Pixels, or ~pixels, of pictures `width` wide.
void SortByNeighbourhood(std::vector<cl_int>& pixels, int width) {
  std::vector<std::pair<std::uint64_t, cl_int>> keyed;
  keyed.reserve(pixels.size());
  for (const cl_int listed : pixels) {
    const cl_int pixel = listed < 0 ? ~listed : listed;
    keyed.emplace_back(MortonCode(pixel % width, pixel / width), listed);
  }
  std::sort(keyed.begin(), keyed.end());
  for (std::size_t k = 0; k < pixels.size(); ++k) pixels[k] = keyed[k].second;
}

class Volume : public Estimator {
 public:
  explicit Volume(const Device& device)
      : device_(device),
        program_(Program::Build(device, "kernels/luminaire/volume.cl")),
        whole_(program_, "VolumeIrradiance"),
        cut_(program_, "VolumeCutIrradiance"),
        exact_(MakeExact(device)),
        list_(device),
        share_(device) {}

  const EstimatorTraits& traits() const override { return VolumeTraits(); }

  void Light(const Receivers& receivers, const LightSource& source, const EstimatorOptions& options,
             Lighting& lighting) override {
    const PosedLuminaire& posed = RequireLuminaire(traits(), source);
    const auto& [luminaire, world_from_luminaire] = posed;
    const auto& [gbuffer, visibility] = receivers;
    RequireLambertian(traits(), gbuffer);
    RequireShadows(traits(), visibility);
    if (!luminaire.has_volume())
      throw InputError(
          "estimator 'volume' needs a light-vector volume and the luminaire has none; build it "
          "over the receivers to be lit");
    const LuminaireParams params =
        MakeLuminaireParams(luminaire.geometry(), luminaire.row_stride(), world_from_luminaire);
    const Buffer device_params =
        Buffer::From(device_, std::span<const LuminaireParams>(&params, 1));
    const Buffer share =
        share_.Trace(traits().name, receivers, posed, options, lighting.samples).irradiance;
    const Buffer all;  // null: everything is visible
    const Buffer& seen = visibility.patches ? visibility.patches->Shares(gbuffer) : all;
    const std::size_t left_bytes = (2 + gbuffer.pixel_count()) * sizeof(cl_int);
    if (left_.bytes() != left_bytes) left_ = Buffer(device_, left_bytes);
    std::array<cl_int, 2> left{};  // lit by `exact`, and by cut_
    left_.Upload(std::span<const cl_int>(left));
    const auto count = static_cast<cl_int>(gbuffer.pixel_count());
    whole_
        .Set(device_params, luminaire.volume_params(), luminaire.volume(), gbuffer.position,
             gbuffer.normal, count, share, lighting.irradiance, lighting.variance, left_,
             kShareOfCuts * options.max_error, seen)
        .Enqueue((gbuffer.pixel_count() + kPixelsPerItem - 1) / kPixelsPerItem);
    left_.Download(std::span<cl_int>(left));
    if (left[1] > 0) {
      std::vector<cl_int> cut(left[1]);
      const std::size_t first = 2 + gbuffer.pixel_count() - cut.size();
      left_.Download(std::span<cl_int>(cut), first);
      SortByNeighbourhood(cut, gbuffer.width);
      left_.Upload(std::span<const cl_int>(cut), first);
      cut_.Set(device_params, luminaire.images(), gbuffer.position, gbuffer.normal, count, share,
               lighting.irradiance, lighting.variance, left_, left[1], seen)
          .Enqueue(left[1]);
    }
    if (left[0] > 0) LightLeft(gbuffer, posed, {share, seen}, left[0], lighting);
  }

 private:
  // By `exact`, the first `count` pixels of the list.
  void LightLeft(const GBuffer& gbuffer, const PosedLuminaire& posed, const SeenShares& shares,
                 cl_int count, Lighting& lighting) {
    std::vector<cl_int> pixels(count);
    left_.Download(std::span<cl_int>(pixels), 2);
    std::sort(pixels.begin(), pixels.end());  // neighbours share work
    const GBuffer some = list_.Gather(gbuffer, pixels);
    Lighting exact(device_, some);
    exact_->Light({some}, posed, {}, exact);
    list_.Scatter(exact.irradiance, shares, lighting);
  }

  Device device_;
  Program program_;
  Kernel whole_, cut_;
  std::unique_ptr<Estimator> exact_;
  PixelList list_;
  Buffer left_;
  VisibleShare share_;
};

}  // namespace

const EstimatorTraits& VolumeTraits() {
  static const EstimatorTraits traits{
      .name = "volume",
      .needs = {.volume = true},
      .needs_for_shadows = {.cells = true},
      .soft_map_shadows = true,
      .noise_free = true,
      .rel_error = preprocess::VolumeOptions{}.max_rel_error,
      .error_is_asked = true,
      .guarantee =
          "irradiance interpolated in a table made for an error target, measured against the "
          "closed form at receivers of the picture; exact where the table ends and where horizons "
          "cut; traced shadows as for exact, soft maps without noise at frame rate"};
  return traits;
}

std::unique_ptr<Estimator> MakeVolume(const Device& device) {
  return std::make_unique<Volume>(device);
}

std::vector<cl_float4> LightReceivers(const Device& device, Estimator& estimator,
                                      const LuminaireOnDevice& luminaire,
                                      std::span<const preprocess::JudgedReceiver> receivers,
                                      double max_error) {
  if (receivers.empty()) return {};
  std::vector<cl_float4> position, normal;
  for (const auto& [receiver, by_volume, irradiance] : receivers) {
    const auto& [p, n] = receiver;
    position.push_back(
        {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 1}});
    normal.push_back(
        {{static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z), 0}});
  }
  GBuffer gbuffer(device, static_cast<int>(receivers.size()), 1);
  gbuffer.position.Upload(std::span<const cl_float4>(position));
  gbuffer.normal.Upload(std::span<const cl_float4>(normal));
  Lighting lighting(device, gbuffer);
  EstimatorOptions options;
  options.max_error = static_cast<float>(max_error);
  estimator.Light({gbuffer}, PosedLuminaire{luminaire}, options, lighting);
  return lighting.irradiance.Download<cl_float4>();
}

double RelativeRmse(std::span<const preprocess::JudgedReceiver> receivers,
                    std::span<const cl_float4> lit) {
  double squares = 0, sum = 0;
  for (std::size_t k = 0; k < receivers.size(); ++k)
    for (int channel = 0; channel < 3; ++channel) {
      const double truth = receivers[k].irradiance[channel];
      squares += (lit[k].s[channel] - truth) * (lit[k].s[channel] - truth);
      sum += truth;
    }
  return squares > 0
             ? std::sqrt(squares * 3 * static_cast<double>(receivers.size())) / std::abs(sum)
             : 0;
}

std::vector<preprocess::Receiver> ReceiversOf(const GBuffer& gbuffer,
                                              const scene::Pose& world_from_luminaire) {
  const auto position = gbuffer.position.Download<cl_float4>(),
             normal = gbuffer.normal.Download<cl_float4>();
  const scene::Pose luminaire_from_world = world_from_luminaire.Inverse();
  std::vector<preprocess::Receiver> receivers;
  for (std::size_t k = 0; k < position.size(); ++k) {
    if (position[k].s[3] == 0) continue;
    const auto& p = position[k].s;
    const auto& n = normal[k].s;
    receivers.push_back({luminaire_from_world.Point({p[0], p[1], p[2]}),
                         luminaire_from_world.Vector({n[0], n[1], n[2]})});
  }
  return receivers;
}

}  // namespace luxfield::render
