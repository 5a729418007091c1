#include "luxfield/planning/filter_photographs.h"

namespace luxfield::planning {
namespace {

using hal::sim::FilterBench;
using View = FilterBench::View;

constexpr int kRepeats = 4;

rig::SensorModel KnownSensor(const hal::sim::Sensor& sensor) {
  rig::SensorModel known = sensor.model();
  // PRNU and vignetting cancel in the ratio of two photographs.
  known.prnu = 0;
  return known;
}

reconstruct::MergedFrame Photograph(const FilterBench& bench, View view,
                                    const std::vector<double>& exposures_s) {
  std::vector<session::RawFrame> frames;
  std::vector<reconstruct::DarkFrame> darks;
  for (const double exposure_s : exposures_s) {
    std::vector<session::RawFrame> dark;
    for (int k = 0; k < kRepeats; ++k) {
      const int number = static_cast<int>(frames.size());
      frames.push_back(bench.Expose(view, exposure_s, number));
      dark.push_back(bench.Expose(View::kDark, exposure_s, number));
    }
    darks.push_back(reconstruct::AverageDarks(dark, exposure_s));
  }
  std::vector<reconstruct::Exposure> exposures;
  for (std::size_t n = 0; n < frames.size(); ++n)
    exposures.push_back({&frames[n], exposures_s[n / kRepeats], 1, 1, &darks[n / kRepeats]});
  return reconstruct::MergeExposures(KnownSensor(bench.sensor()), exposures);
}

}  // namespace

FilterPhotographs PhotographFilter(const FilterBench& bench) {
  const double t = bench.exposure_s();
  FilterPhotographs result;
  result.sheet = bench.sheet();
  result.light = Photograph(bench, View::kLight, {t});
  for (int print = 0; print < result.sheet.prints(); ++print)
    result.prints.push_back(
        Photograph(bench, print == 0 ? View::kPlus : View::kMinus, {t, 8 * t, 64 * t}));
  return result;
}

FilterPhotographs PhotographFilter(const std::filesystem::path& lab_toml,
                                   std::optional<std::uint64_t> seed, int pixels) {
  return PhotographFilter(
      FilterBench(hal::sim::ReadLab(core::Config::FromFile(lab_toml), seed), pixels));
}

}  // namespace luxfield::planning
