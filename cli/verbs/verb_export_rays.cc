// luxfield export X.lf.exr -o X.tm25ray, X.dat, X.ltrf, X.speos.ray: rays of equal flux.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "luxfield/cli/verbs/verb_export.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/primaries.h"
#include "luxfield/core/progress.h"
#include "luxfield/preprocess/ray_sampler.h"
#include "luxfield/version.h"

namespace luxfield::cli {
namespace {

using preprocess::DrawnRay;
using preprocess::RaySampler;

// The rays of a file, a batch at a time: the same for the same seed, whatever the threads.
class DrawnRays {
 public:
  DrawnRays(const RaySampler& sampler, std::uint64_t count, std::uint64_t seed)
      : sampler_(sampler), count_(count), seed_(seed), progress_("rays", count) {}

  // None behind the last.
  const DrawnRay* Next() {
    if (done_ == count_) return nullptr;
    const std::size_t at = static_cast<std::size_t>(done_ % (kBlock * kBlocks));
    if (at == 0) DrawBatch();
    ++done_;
    proposals_ += static_cast<std::uint64_t>(batch_[at].proposals);
    return &batch_[at];
  }

  // Of the rays drawn so far, per proposal.
  double kept_share() const { return double(done_) / double(proposals_); }

 private:
  static constexpr std::uint64_t kStream = 0x7261797365787074;
  static constexpr std::uint64_t kBlock = 2048, kBlocks = 64;  // 12 MiB

  void DrawBatch() {
    core::ThrowIfInterrupted();
    batch_.resize(static_cast<std::size_t>(std::min(count_ - done_, kBlock * kBlocks)));
    const std::uint64_t first_block = done_ / kBlock;
    core::ParallelFor((batch_.size() + kBlock - 1) / kBlock, 1, [&](std::size_t b, std::size_t e) {
      for (std::size_t block = b; block < e; ++block) {
        core::Random random(seed_, kStream, static_cast<std::uint32_t>(first_block + block));
        const std::size_t end = std::min<std::size_t>(batch_.size(), (block + 1) * kBlock);
        for (std::size_t k = block * kBlock; k < end; ++k) batch_[k] = sampler_.Draw(random);
      }
    });
    progress_.Advance(batch_.size());
  }

  const RaySampler& sampler_;
  std::uint64_t count_, seed_, done_ = 0, proposals_ = 0;
  std::vector<DrawnRay> batch_;
  core::Progress progress_;
};

// What the file says of itself.
formats::RayFileHeader HeaderOf(const ExportOptions& options, const ExportFormat& format,
                                double flux, bool luminous) {
  formats::RayFileHeader header;
  header.ray_count = options.rays.value_or(kDefaultRays);
  (luminous ? header.luminous_flux_lm : header.radiant_flux_w) = flux;
  header.texts = {"light field " +
                  std::filesystem::path(options.field).filename().string().substr(0, 80)};
  if (format.rays == formats::RayFormat::kTm25)
    header.texts.insert(header.texts.end(), {"", "", "luxfield", "luxfield " LUXFIELD_VERSION, "",
                                             "", "rays begin on the filter plane", ""});
  return header;
}

void Print(const ExportOptions& options, const ExportFormat& format, const std::string& unit,
           std::uint64_t rays, double flux, double left_out) {
  fmt::print("{}: {}, {} rays of {:.6g} {}, {:.6g} {} in all\n", options.output,
             formats::RayFormatName(*format.rays), rays, flux / double(rays), unit, flux, unit);
  if (left_out > 0)
    fmt::print(
        "  negative     {:.3g} % of the flux is negative light, which no ray carries; the "
        "rest is scaled to the light field's flux\n",
        100 * left_out / flux);
  if (unit == "relative")
    fmt::print("  unit         the light field is relative: the file's lm are not absolute\n");
}

}  // namespace

core::Json ExportRays(const ExportOptions& options, const ExportFormat& format,
                      const Fields& fields) {
  constexpr std::uint64_t kFewest = 3200;  // that CheckRays takes
  if (options.check && options.rays.value_or(kDefaultRays) < kFewest)
    throw InputError(
        fmt::format("--rays {} are too few for --check; give {} or more", *options.rays, kFewest));
  const RaySampler sampler(fields, options.field);
  const std::string unit = UnitOf(fields);
  const bool luminous = unit != "W";
  const double flux = sampler.flux();
  const auto header = HeaderOf(options, format, flux, luminous);
  const double per_ray = flux / double(header.ray_count);
  // X and Z are kept where the format has them and the light field its colours.
  const bool tristimulus = format.rays == formats::RayFormat::kTm25 && unit == "lm" &&
                           std::all_of(fields.begin(), fields.end(), [](const auto& posed) {
                             return posed.field.geometry.channels == 3;
                           });
  const core::Matrix3 xyz_from_rgb = core::XyzFromRgb(core::kRec709);
  DrawnRays rays(sampler, header.ray_count, options.seed);
  formats::WriteRays(options.output, *format.rays, header, luminous, tristimulus,
                     [&](formats::Ray& ray) {
                       const DrawnRay* drawn = rays.Next();
                       if (!drawn) return false;
                       ray = {drawn->position_m, drawn->direction, per_ray, {}};
                       if (tristimulus) {
                         const core::Rgb xyz = core::Apply(xyz_from_rgb, drawn->colour);
                         ray.tristimulus = {per_ray * xyz[0], per_ray, per_ray * xyz[2]};
                       }
                       return true;
                     });
  // Flux of max(E, 0), by the share of proposals that were kept, over that of E.
  const bool has_negative = sampler.positive_flux() > flux;
  const double left_out =
      has_negative ? std::max(0.0, sampler.positive_flux() * rays.kept_share() - flux) : 0;
  Print(options, format, unit, header.ray_count, flux, left_out);
  core::Json json = {
      {"format", format.name}, {"rays", header.ray_count},   {"flux", flux},
      {"unit", unit},          {"tristimulus", tristimulus}, {"negative_flux", left_out}};
  if (options.check) {
    const auto check = formats::CheckRays(core::ReadableAt(options.output),
                                          formats::LuminanceOf(fields), left_out);
    json["check"] = ReportChecks(options, format, {check});
    json["chi_squared"] = check.chi_squared;
    json["degrees"] = check.degrees;
    fmt::print("  counting     chi-squared {:.4g} of {} degrees of freedom\n", check.chi_squared,
               check.degrees);
  }
  return json;
}

}  // namespace luxfield::cli
