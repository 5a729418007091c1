#include "luxfield/planning/exposure_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace luxfield::planning {
namespace {

// Times that people can read: two digits, downwards, in steps of the camera.
double RoundedDown(double seconds, double step_s) {
  const double unit = std::pow(10, std::floor(std::log10(seconds)) - 1);
  const double rounded = unit * std::floor(seconds / unit * (1 + 1e-12));
  return step_s > 0 ? step_s * std::floor(rounded / step_s * (1 + 1e-12)) : rounded;
}

}  // namespace

double PixelNoise::Variance(double irradiance, const std::vector<double>& ladder_s,
                            capture::Rungs bracket, int repeats) const {
  constexpr double kSaturationMargin = 5;  // of reconstruct::MergeOptions
  const double gain = camera.gain_dn_per_e, x = electrons_per_irradiance * irradiance;
  const double floor =
      (camera.read_noise_dn * camera.read_noise_dn + (rounds ? 1.0 / 12 : 0)) / (gain * gain);
  const double shot = photon_noise ? 1 : 0;
  double information = 0;
  for (int rung = bracket.first; rung <= bracket.last; ++rung) {
    const double t = ladder_s[rung], dark = t * camera.dark_current_e_per_s,
                 variance = shot * (t * x + dark) + floor;
    const double level = camera.black_dn + gain * (t * x + dark);
    if (level + kSaturationMargin * gain * std::sqrt(variance) >= camera.saturation_dn) continue;
    information += t * t / (variance / repeats + (shot * dark + floor) / darks);
  }
  if (!(information > 0)) return std::numeric_limits<double>::infinity();
  const double pattern = camera.prnu * irradiance;
  return 1 / (information * electrons_per_irradiance * electrons_per_irradiance) +
         pattern * pattern;
}

ExposedImages::ExposedImages(const std::vector<std::vector<float>>& images,
                             const PlannedFilters& filters, const FilterJudgement& judgement,
                             const capture::ExpandedPlan& expanded, const PixelNoise& noise,
                             double pixels_per_texel)
    : noise_(noise) {
  const auto& grid = filters.grid;
  const std::size_t texels =
      static_cast<std::size_t>(filters.lattice.width) * filters.lattice.height;
  const auto factors = filters.print_factors();
  const double dn_per_irradiance = noise.camera.gain_dn_per_e * noise.electrons_per_irradiance;
  for (const auto& position : expanded.positions)
    for (std::size_t print = 0; print < images.size(); ++print) {
      const std::size_t m = grid.index(position.i, position.j);
      const float* image = images[print].data() + m * texels;
      const float* weight = judgement.noise_weight.data() + m * texels;
      std::map<int, Bin> bins;
      float brightest = 0;
      for (std::size_t t = 0; t < texels; ++t) {
        brightest = std::max(brightest, image[t]);
        if (weight[t] == 0) continue;
        Bin& bin = bins[image[t] > 0 ? static_cast<int>(std::floor(4 * std::log2(image[t])))
                                     : std::numeric_limits<int>::min()];
        bin.weight += weight[t];
        bin.irradiance += double{weight[t]} * image[t];
      }
      auto& list = bins_.emplace_back();
      for (const auto& [level, bin] : bins)
        list.push_back({bin.irradiance / bin.weight,
                        bin.weight * factors[print] * factors[print] / pixels_per_texel});
      rates_.push_back(dn_per_irradiance * brightest);
      if (position.i == grid.width / 2 && position.j == grid.height / 2 && print == 0)
        reference_rate_ = rates_.back();
    }
}

double ExposedImages::largest_rate() const {
  return *std::max_element(rates_.begin(), rates_.end());
}

double ExposedImages::Noise(const std::vector<double>& ladder_s,
                            const std::vector<capture::Rungs>& brackets, int repeats) const {
  double sum = 0;
  for (std::size_t k = 0; k < bins_.size(); ++k)
    for (const Bin& bin : bins_[k])
      sum += bin.weight * noise_.Variance(bin.irradiance, ladder_s, brackets[k], repeats);
  return std::sqrt(sum);
}

std::vector<ExposureChoice> ExposureChoices(double longest_s, double ratio,
                                            const hal::CameraCapabilities& camera,
                                            double period_s) {
  constexpr int kShorter = 3;
  std::vector<ExposureChoice> choices;
  const double least_s = std::max({camera.min_exposure_s, camera.exposure_step_s, period_s}),
               most_s = camera.max_exposure_s - period_s;
  const auto add = [&](double min_s, double max_s, std::initializer_list<double> depths) {
    for (const double depth : depths)
      for (const int repeats : {1, 2, 4, 8, 16}) choices.push_back({min_s, max_s, depth, repeats});
  };
  const double first_s = std::max(RoundedDown(longest_s, camera.exposure_step_s), least_s);
  for (int k = 1; k <= kShorter; ++k) {
    const double t = RoundedDown(longest_s * std::pow(ratio, -k), camera.exposure_step_s);
    if (t >= least_s) add(t, t, {1.0});
  }
  for (double max_s = first_s; max_s <= most_s; max_s *= ratio)
    add(first_s, max_s, {1, 1e-2, 1e-3, 1e-4, 1e-5});
  return choices;
}

}  // namespace luxfield::planning
