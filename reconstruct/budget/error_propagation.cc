#include "luxfield/reconstruct/budget/error_propagation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

#include "luxfield/core/parallel.h"
#include "luxfield/reconstruct/bracket/merge_shares.h"
#include "luxfield/reconstruct/bracket/mosaic_sites.h"
#include "luxfield/reconstruct/bracket/register_mosaic.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;
using session::FrameKind;
using session::FrameRecord;

double IrradiancePerRate(const MergedBracket& bracket, std::size_t pixel) {
  return bracket.irradiance_per_rate[bracket.irradiance_per_rate.size() == 1 ? 0 : pixel];
}

double MiddleOf(const FrameRecord& record) { return record.t_start_s + record.exposure_s / 2; }

// Frames between two moves of the stage share a number.
std::map<const FrameRecord*, int> NumberVisits(const std::vector<FrameRecord>& frames) {
  std::vector<const FrameRecord*> lit;
  for (const FrameRecord& record : frames)
    if (record.kind == FrameKind::kPosition || record.kind == FrameKind::kReference)
      lit.push_back(&record);
  std::stable_sort(lit.begin(), lit.end(), [](const FrameRecord* a, const FrameRecord* b) {
    return std::tie(a->epoch, a->t_start_s) < std::tie(b->epoch, b->t_start_s);
  });
  std::map<const FrameRecord*, int> visits;
  int visit = 0;
  for (std::size_t n = 0; n < lit.size(); ++n) {
    if (n > 0 &&
        (lit[n]->epoch != lit[n - 1]->epoch || lit[n]->stage_u_m != lit[n - 1]->stage_u_m ||
         lit[n]->stage_v_m != lit[n - 1]->stage_v_m))
      ++visit;
    visits[lit[n]] = visit;
  }
  return visits;
}

double SumOfSquares(const std::vector<double>& values) {
  double sum = 0;
  for (const double x : values) sum += x * x;
  return sum;
}

// |per_m|^2 without what noise adds to it on average.
double SquareWithoutNoise(const ImageSlope& slope) {
  return slope.per_m.x * slope.per_m.x + slope.per_m.y * slope.per_m.y - slope.variance.x -
         slope.variance.y;
}

}  // namespace

ErrorPropagation::ErrorPropagation(const PropagationInput& input,
                                   std::vector<lightfield::Weights> weights)
    : input_(input),
      print_(input.plan.filter, input.plan.geometry.grid.basis, input.plan.geometry.grid.spacing_m,
             input.plan.filter_scale),
      print_factors_(PrintFactors(input.plan.filter, input.plan.geometry.grid.basis)),
      visit_(NumberVisits(input.session.frames())) {
  const int positions = input.plan.geometry.grid.count();
  const std::size_t pixels =
      static_cast<std::size_t>(input.plan.sensor.width) * input.plan.sensor.height;
  for (lightfield::Weights& w : weights) {
    Sums& sums = sums_.emplace_back();
    sums.weights = std::move(w);
    sums.pixel.assign(pixels, 0);
    for (int m = 0; m < positions; ++m) {
      sums.lags.push_back(SumLags(input.coefficients, sums.weights, m));
      ImageSlope image = ImageSensitivity(input.measurements, sums.weights, m);
      image.per_m = image.per_m + print_.Shift(sums.lags.back());
      sums.position.push_back(image);
    }
  }
}

double ErrorPropagation::own_variance_dn2(double exposure_s) const {
  const rig::SensorModel& sensor = input_.plan.sensor;
  return sensor.gain_dn_per_e * sensor.gain_dn_per_e * sensor.dark_current_e_per_s * exposure_s +
         sensor.read_noise_dn * sensor.read_noise_dn + sensor.quantisation_variance_dn2();
}

void ErrorPropagation::OnReferences(std::span<const MergedReference> references,
                                    const LampDrift& drift) {
  drift_ = drift;
  std::map<std::tuple<int, double, double>, std::size_t> first;
  double level = 0;
  for (const MergedReference& merged : references) {
    const FrameRecord& record = *merged.record;
    Reference& r = references_.emplace_back();
    r.record = merged.record;
    r.pixels = *merged.pixels;
    r.signal_dn = merged.signal_dn;
    r.factor = drift.Factor(record.epoch, record.channel, MiddleOf(record));
    r.darks = merged.dark ? merged.dark->count : 0;
    r.first = first
                  .try_emplace({record.channel, record.exposure_s, record.attenuation},
                               references_.size() - 1)
                  .first->second;
    r.log_signal_per_m = ReferenceSensitivity(input_.coefficients, input_.plan, merged);
    r.monitor_share = record.meter * references_[r.first].signal_dn / r.signal_dn;
    level += r.monitor_share;
  }
  for (Reference& r : references_)
    r.monitor_share =
        input_.how.lamp_level == LampLevel::kMonitorUnity ? r.monitor_share / level : 0;
}

std::vector<ErrorPropagation::Seen> ErrorPropagation::SeenBy(const MergedBracket& bracket,
                                                             Vec2 centre_m) const {
  const rig::SensorModel& sensor = input_.plan.sensor;
  const auto& lattice = input_.plan.geometry.lattice;
  std::vector<Seen> seen;
  if (sensor.cfa.empty()) {
    const Registration registration(input_.plan.image_from_sensor, sensor.width, sensor.height,
                                    lattice, input_.plan.lens);
    seen.push_back({bracket.channel, 1, registration.Overlaps(centre_m)});
    return seen;
  }
  const int channels = input_.plan.geometry.channels;
  const MosaicRegistration registration(input_.plan.image_from_sensor, sensor.width, sensor.height,
                                        lattice, input_.plan.lens, sensor.cfa,
                                        std::vector<std::vector<float>>(channels, {1}));
  for (int channel = 0; channel < channels; ++channel) {
    auto sites = registration.Overlaps(channel, centre_m);
    for (auto& overlaps : sites)
      seen.push_back({channel, 1 / static_cast<double>(sites.size()), std::move(overlaps)});
  }
  return seen;
}

void ErrorPropagation::AddRates(const Sums& sums, const MergedBracket& bracket,
                                const std::vector<Seen>& all, std::vector<double>* by_rate) const {
  const auto& geometry = input_.plan.geometry;
  const auto known = [&](std::size_t p) {
    return !(bracket.merged.mask[p] & lightfield::kUnknownMask);
  };
  const int m = geometry.grid.index(bracket.i, bracket.j);
  for (const Seen& seen : all) {
    const std::size_t image = static_cast<std::size_t>(m) * geometry.channels + seen.channel;
    for (std::size_t k = 0; k < seen.overlaps.size(); ++k) {
      const double w = print_factors_[bracket.print] * seen.share *
                       sums.weights[image * geometry.plane_size() + k];
      if (w == 0) continue;
      double covered = 0;
      for (const PixelShare& o : seen.overlaps[k])
        if (known(o.pixel)) covered += o.share;
      for (const PixelShare& o : seen.overlaps[k])
        if (known(o.pixel))
          (*by_rate)[o.pixel] += w * o.share / covered * IrradiancePerRate(bracket, o.pixel);
    }
  }
}

void ErrorPropagation::AddRegistrationSlopes(const MergedBracket& bracket,
                                             const std::vector<Seen>& all) {
  const auto& lattice = input_.plan.geometry.lattice;
  const double step_m = 1e-3 * std::min(lattice.ds_m, lattice.dt_m);
  const std::array<Vec2, 4> steps = {Vec2{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  // What the bracket adds to every quantity, registered so.
  const auto parts = [&](const std::vector<Seen>& registered) {
    const std::vector<float>& rate = bracket.merged.rate_e_per_s;
    std::vector<double> part(sums_.size());
    core::ParallelFor(sums_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t q = begin; q < end; ++q) {
        std::vector<double> by_rate(rate.size());
        AddRates(sums_[q], bracket, registered, &by_rate);
        part[q] = std::inner_product(rate.begin(), rate.end(), by_rate.begin(), 0.0);
      }
    });
    return part;
  };
  const std::vector<double> here = parts(all);
  for (std::size_t n = 0; n < steps.size(); ++n) {
    const std::vector<double> there = parts(SeenBy(bracket, bracket.centre_m + step_m * steps[n]));
    for (std::size_t q = 0; q < sums_.size(); ++q)
      sums_[q].registration[n] += (there[q] - here[q]) / step_m;
  }
}

void ErrorPropagation::OnBracket(const MergedBracket& bracket) {
  const auto& geometry = input_.plan.geometry;
  const rig::SensorModel& sensor = input_.plan.sensor;
  const int m = geometry.grid.index(bracket.i, bracket.j);
  const MergedFrame& merged = bracket.merged;
  const auto known = [&](std::size_t p) { return !(merged.mask[p] & lightfield::kUnknownMask); };
  // Means of the channels that the frames show.
  std::vector<double> mean(static_cast<std::size_t>(geometry.channels)), count(mean.size());
  for (std::size_t p = 0; p < merged.rate_e_per_s.size(); ++p)
    if (known(p)) {
      const int channel = sensor.cfa.empty() ? bracket.channel : ChannelOfPixel(sensor, p);
      mean[channel] += IrradiancePerRate(bracket, p) * merged.rate_e_per_s[p];
      ++count[channel];
    }
  for (std::size_t c = 0; c < mean.size(); ++c) mean[c] /= std::max(count[c], 1.0);
  const std::vector<Seen> all = SeenBy(bracket, bracket.centre_m);
  AddRegistrationSlopes(bracket, all);

  const MergeShares merge(sensor, bracket.exposures, input_.how.merge, merged);
  core::ParallelFor(sums_.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<double> by_rate(merged.rate_e_per_s.size());
    std::vector<SampleShare> shares;
    for (std::size_t q = begin; q < end; ++q) {
      Sums& sums = sums_[q];
      std::fill(by_rate.begin(), by_rate.end(), 0.0);
      AddRates(sums, bracket, all, &by_rate);
      for (const Seen& seen : all) {
        const std::size_t image = static_cast<std::size_t>(m) * geometry.channels + seen.channel;
        const double* const w = sums.weights.data() + image * geometry.plane_size();
        const double of_image = std::accumulate(w, w + geometry.plane_size(), 0.0);
        sums.stray += print_factors_[bracket.print] * seen.share * of_image * mean[seen.channel];
      }
      std::vector<double> light(bracket.records.size());
      for (std::size_t p = 0; p < by_rate.size(); ++p) {
        if (by_rate[p] == 0) continue;
        const double x = merged.rate_e_per_s[p];
        merge.At(p, &shares);
        sums.pixel[p] += by_rate[p] * x;
        for (std::size_t n = 0; n < shares.size(); ++n) {
          const SampleShare& sample = shares[n];
          if (sample.share == 0) continue;
          const double a = by_rate[p] * sample.share;
          sums.photon_variance += a * a * sample.photon_variance;
          sums.read_variance += a * a * sample.own_variance;
          light[n] += a * x;
          if (sample.dark_variance > 0) {
            std::vector<double>& dark = sums.dark[bracket.records[n]->exposure_s];
            dark.resize(by_rate.size());
            dark[p] += a / sample.k;
          }
        }
      }
      for (std::size_t n = 0; n < light.size(); ++n) sums.light[bracket.records[n]] += light[n];
    }
  });
}

ErrorPropagation::ReferenceTerms ErrorPropagation::Terms(const FrameLights& lights) const {
  ReferenceTerms terms{std::vector<double>(references_.size()),
                       std::vector<double>(references_.size())};
  std::map<std::tuple<int, int, double>, std::size_t> at;
  for (std::size_t j = 0; j < references_.size(); ++j)
    at[{references_[j].record->epoch, references_[j].record->channel,
        MiddleOf(*references_[j].record)}] = j;
  double all = 0;
  // A frame's light is divided by factor = sum share_j S_j / S_first x level.
  for (const auto& [record, light] : lights) {
    const auto shares = drift_.Shares(record->epoch, record->channel, MiddleOf(*record));
    double factor = 0;
    for (const auto& s : shares) factor += s.share * s.factor;
    for (const auto& s : shares) {
      const std::size_t j = at.at({record->epoch, record->channel, s.time_s});
      const double part = light * s.share * s.factor / factor;
      terms.signal[j] -= part;
      terms.signal[references_[j].first] += part;
    }
    if (!shares.empty()) all += light;
  }
  // level = mean of meter_j S_first / S_j.
  for (std::size_t j = 0; j < references_.size(); ++j) {
    const double part = all * references_[j].monitor_share;
    terms.signal[j] += part;
    terms.signal[references_[j].first] -= part;
    terms.meter[j] -= part;
  }
  return terms;
}

double ErrorPropagation::ReadVariance(const Sums& sums, const ReferenceTerms& terms) const {
  double variance = sums.read_variance;
  auto dark = sums.dark;
  for (std::size_t j = 0; j < references_.size(); ++j) {
    const Reference& r = references_[j];
    const double per_dn = terms.signal[j] / r.signal_dn;
    variance += per_dn * per_dn * static_cast<double>(r.pixels.size()) *
                own_variance_dn2(r.record->exposure_s);
    if (r.darks == 0) continue;
    std::vector<double>& same = dark[r.record->exposure_s];
    same.resize(sums.pixel.size());
    for (const std::size_t p : r.pixels) same[p] += per_dn;
  }
  std::map<double, int> counts;
  for (const FrameRecord& record : input_.session.frames())
    if (record.kind == FrameKind::kDark && !record.flagged) ++counts[record.exposure_s];
  for (const auto& [exposure_s, values] : dark)
    variance += SumOfSquares(values) * own_variance_dn2(exposure_s) / counts.at(exposure_s);
  return variance;
}

double ErrorPropagation::ShutterVariance(const FrameLights& lights,
                                         const ReferenceTerms& terms) const {
  double per_s2 = 0;
  const auto add = [&](const FrameRecord& record, double light) {
    per_s2 += light * light / (record.exposure_s * record.exposure_s);
  };
  for (const auto& [record, light] : lights) add(*record, light);
  for (std::size_t j = 0; j < references_.size(); ++j) add(*references_[j].record, terms.signal[j]);
  return per_s2;
}

double ErrorPropagation::ExposureTimesVariance(const FrameLights& lights,
                                               const ReferenceTerms& terms) const {
  std::map<double, double> per_s;  // by exposure time
  const auto add = [&](const FrameRecord& record, double light) {
    per_s[record.exposure_s] += light / record.exposure_s;
  };
  for (const auto& [record, light] : lights) add(*record, light);
  for (std::size_t j = 0; j < references_.size(); ++j) add(*references_[j].record, terms.signal[j]);
  double per_s2 = 0;
  for (const auto& [exposure_s, sum] : per_s) per_s2 += sum * sum;
  return per_s2;
}

double ErrorPropagation::DriftVariance(const FrameLights& lights, const ReferenceTerms& terms,
                                       double period_s) const {
  // The clocks of two epochs do not compare: their wanders are taken as independent.
  std::map<int, std::complex<double>> wave;
  const auto add = [&](const FrameRecord& record, double light) {
    wave[record.epoch] +=
        light * std::polar(1.0, 2 * std::numbers::pi * MiddleOf(record) / period_s);
  };
  for (const auto& [record, light] : lights) add(*record, light);
  for (std::size_t j = 0; j < references_.size(); ++j)
    add(*references_[j].record, terms.signal[j] + terms.meter[j]);
  // The result belongs to the lamp as it was at its first reference.
  if (input_.how.lamp_level == LampLevel::kFirstReference)
    for (const Reference& r : references_) {
      if (&r != &references_[r.first]) continue;
      for (const auto& [record, light] : lights)
        if (record->channel == r.record->channel) add(*r.record, -light);
    }
  double variance = 0;
  for (const auto& [epoch, sum] : wave) variance += std::norm(sum);
  return variance;
}

double ErrorPropagation::ImageShiftVariance(const Sums& sums) const {
  const auto& [right, left, up, down] = sums.registration;
  // A kink has a mean, and the means of both axes add up.
  return (right * right + left * left + up * up + down * down) / 2 +
         (right + left) * (up + down) / std::numbers::pi;
}

double ErrorPropagation::StageVariance(const Sums& sums, const ReferenceTerms& terms) const {
  std::map<int, ImageSlope> by_visit;
  std::map<int, int> visit_of_position;  // both prints of a pair are taken on one
  for (const auto& [record, light] : sums.light)
    visit_of_position[input_.plan.geometry.grid.index(record->i, record->j)] = visit_.at(record);
  for (const auto& [m, visit] : visit_of_position) {
    by_visit[visit].per_m = by_visit[visit].per_m + sums.position[m].per_m;
    by_visit[visit].variance = by_visit[visit].variance + sums.position[m].variance;
  }
  for (std::size_t j = 0; j < references_.size(); ++j) {
    Vec2& sum = by_visit[visit_.at(references_[j].record)].per_m;
    sum = sum + terms.signal[j] * references_[j].log_signal_per_m;
  }
  double variance = 0;
  for (const auto& [visit, slope] : by_visit) variance += SquareWithoutNoise(slope);
  return std::max(variance, 0.0);
}

std::array<std::optional<double>, kErrorSources> ErrorPropagation::Sigma(
    std::size_t q, const ErrorSizes& sizes) const {
  const Sums& sums = sums_[q];
  FrameLights lights = sums.light;
  double ratio_variance = 0;
  if (exposures_) {
    const ThroughRatios ratios = exposures_->Propagate(sums.light);
    for (const auto& [record, light] : ratios.light) lights[record] += light;
    ratio_variance = ratios.noise_variance;
  }
  const ReferenceTerms terms = Terms(lights);
  std::array<std::optional<double>, kErrorSources> sigma;
  const auto set = [&](ErrorSource source, const std::optional<double>& size, double sensitivity) {
    if (size) sigma[static_cast<std::size_t>(source)] = *size * std::abs(sensitivity);
  };
  double photon = sums.photon_variance;
  for (std::size_t j = 0; j < references_.size(); ++j)
    photon += terms.signal[j] * terms.signal[j] * input_.plan.sensor.gain_dn_per_e /
              references_[j].signal_dn;
  set(ErrorSource::kPhotonNoise, 1, std::sqrt(photon));
  set(ErrorSource::kReadNoise, 1, std::sqrt(ReadVariance(sums, terms)));
  set(ErrorSource::kPrnu, input_.plan.sensor.prnu, std::sqrt(SumOfSquares(sums.pixel)));
  set(ErrorSource::kShutter, sizes.shutter_jitter_s, std::sqrt(ShutterVariance(lights, terms)));
  // Estimated, what is left is the noise of the estimates, and the longest time taken at its word.
  const double of_times = std::sqrt(ExposureTimesVariance(lights, terms));
  if (exposures_)
    set(ErrorSource::kExposureTimes, 1,
        std::hypot(sizes.exposure_time_s.value_or(0) * of_times, std::sqrt(ratio_variance)));
  else
    set(ErrorSource::kExposureTimes, sizes.exposure_time_s, of_times);
  if (sizes.lamp_wander)
    set(ErrorSource::kLampDrift, sizes.lamp_wander,
        std::sqrt(DriftVariance(lights, terms, sizes.lamp_wander_period_s)));
  const bool by_monitor = input_.how.lamp_level == LampLevel::kMonitorUnity;
  set(ErrorSource::kMonitor, by_monitor ? sizes.monitor : 0, std::sqrt(SumOfSquares(terms.meter)));
  set(ErrorSource::kStage, sizes.stage_m, std::sqrt(StageVariance(sums, terms)));
  set(ErrorSource::kImageShift, sizes.image_shift_m, std::sqrt(ImageShiftVariance(sums)));
  LagSums lags;
  for (const LagSums& of_position : sums.lags) lags += of_position;
  if (sizes.print_shift_m)
    set(ErrorSource::kPrintShift, 1, std::sqrt(print_.ShiftVariance(lags, *sizes.print_shift_m)));
  set(ErrorSource::kDensity, sizes.density, print_.Density(lags));
  set(ErrorSource::kDensityGamma, sizes.density_gamma, print_.Gamma(lags));
  set(ErrorSource::kGrain, sizes.grain, print_.Grain(lags) * std::sqrt(sizes.grain_area_m2));
  set(ErrorSource::kStrayLight, sizes.stray_share, sums.stray);
  return sigma;
}

}  // namespace luxfield::reconstruct
