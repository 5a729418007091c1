#include "luxfield/reconstruct/calibrate/sensor/flat_field.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/reconstruct/bracket/mosaic_sites.h"
#include "luxfield/reconstruct/calibrate/sensor/sensor_calibration_file.h"
#include "luxfield/session/session_file.h"
#include "luxfield/version.h"

namespace luxfield::reconstruct {
namespace {

constexpr const char* kFormat = "luxfield flat field";
constexpr double kDarkest = 0.1, kBrightest = 0.8;  // of the sensor's range, mean of a flat

struct Sums {
  std::vector<double> signal, variance;
  std::vector<char> usable;
  std::vector<double> mean;  // per site: sum of the frames' means over its usable pixels
  std::vector<int> flats;    // per site
};

// Mean of the darks of the exposure nearest to t, and how many they are. PairsOfSession sees to it
// that there are some.
struct Dark {
  std::vector<double> mean_dn;
  int frames = 0;
};

Dark DarkOf(std::span<const CalibrationPair> pairs, double exposure_s) {
  double nearest = -1;
  for (const CalibrationPair& pair : pairs)
    if (pair.dark && (nearest < 0 || std::abs(std::log(pair.exposure_s / exposure_s)) <
                                         std::abs(std::log(nearest / exposure_s))))
      nearest = pair.exposure_s;
  Dark dark;
  for (const CalibrationPair& pair : pairs) {
    if (!pair.dark || pair.exposure_s != nearest) continue;
    const auto [a, b] = pair.read();
    dark.mean_dn.resize(a.size());
    for (std::size_t k = 0; k < a.size(); ++k) dark.mean_dn[k] += a.at(k) + b.at(k);
    dark.frames += 2;
  }
  for (double& value : dark.mean_dn) value /= std::max(1, dark.frames);
  return dark;
}

// Site of the sensor's k-th pixel.
int SiteOf(const rig::SensorModel& sensor, std::size_t k) {
  return reconstruct::SiteOf(sensor.cfa, static_cast<int>(k) / sensor.width,
                             static_cast<int>(k) % sensor.width);
}

double FloorVariance(const rig::SensorModel& sensor) {
  return sensor.read_noise_dn * sensor.read_noise_dn + sensor.quantisation_variance_dn2();
}

// Adds one to `used` of the sites for which the flat counts.
void Add(const session::RawFrame& flat, const Dark& dark, const rig::SensorModel& sensor,
         Sums& sums, std::vector<double>& used) {
  std::vector<double> mean(used.size()), count(used.size());
  for (std::size_t k = 0; k < flat.size(); ++k) {
    if (!sums.usable[k]) continue;
    const int site = SiteOf(sensor, k);
    mean[site] += flat.at(k) - dark.mean_dn[k];
    ++count[site];
  }
  const double range = sensor.saturation_dn - sensor.black_dn;
  for (std::size_t site = 0; site < mean.size(); ++site) mean[site] /= std::max(1.0, count[site]);
  if (*std::max_element(mean.begin(), mean.end()) > kBrightest * range) return;
  const auto counts = [&](int site) { return mean[site] >= kDarkest * range; };
  const double floor = FloorVariance(sensor);
  for (std::size_t k = 0; k < flat.size(); ++k) {
    if (!counts(SiteOf(sensor, k))) continue;
    if (flat.at(k) >= sensor.saturation_dn) sums.usable[k] = 0;
    const double signal = flat.at(k) - dark.mean_dn[k];
    sums.signal[k] += signal;
    sums.variance[k] += floor + sensor.gain_dn_per_e * std::max(0.0, signal);
  }
  for (int site = 0; site < static_cast<int>(mean.size()); ++site) {
    if (!counts(site)) continue;
    sums.mean[site] += mean[site];
    ++sums.flats[site];
    ++used[site];
  }
}

// Terms x^i y^j, i + j <= degree, on [-1, 1]^2: Legendre polynomials keep the matrix well behaved.
void Terms(int degree, double x, double y, Eigen::VectorXd& terms) {
  std::array<double, 9> px{1, x}, py{1, y};
  for (int n = 1; n < degree; ++n) {
    px[n + 1] = ((2 * n + 1) * x * px[n] - n * px[n - 1]) / (n + 1);
    py[n + 1] = ((2 * n + 1) * y * py[n] - n * py[n - 1]) / (n + 1);
  }
  Eigen::Index k = 0;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; i + j <= degree; ++j) terms[k++] = px[i] * py[j];
}

struct Surface {
  int degree = 0;
  Eigen::VectorXd coefficients;
  double residual_square = 0;  // mean over usable pixels

  double At(double x, double y) const {
    Eigen::VectorXd terms(coefficients.size());
    Terms(degree, x, y, terms);
    return terms.dot(coefficients);
  }
};

double Place(int n, int count) { return 2 * (n + 0.5) / count - 1; }

Surface FitSurface(int degree, const FlatField& field, const std::vector<char>& usable) {
  const int size = (degree + 1) * (degree + 2) / 2;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size), terms(size);
  for (int row = 0; row < field.height; ++row)
    for (int column = 0; column < field.width; ++column) {
      const std::size_t k = static_cast<std::size_t>(row) * field.width + column;
      if (!usable[k]) continue;
      Terms(degree, Place(column, field.width), Place(row, field.height), terms);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(terms);
      right += field.sensitivity[k] * terms;
    }
  Surface surface;
  surface.degree = degree;
  surface.coefficients = normal.selfadjointView<Eigen::Lower>().ldlt().solve(right);
  std::size_t count = 0;
  for (int row = 0; row < field.height; ++row)
    for (int column = 0; column < field.width; ++column) {
      const std::size_t k = static_cast<std::size_t>(row) * field.width + column;
      if (!usable[k]) continue;
      const double off =
          field.sensitivity[k] - surface.At(Place(column, field.width), Place(row, field.height));
      surface.residual_square += off * off;
      ++count;
    }
  surface.residual_square /= static_cast<double>(std::max<std::size_t>(1, count - size));
  return surface;
}

Surface ChooseSurface(const FlatField& field, const std::vector<char>& usable) {
  const auto count = static_cast<double>(std::count(usable.begin(), usable.end(), 1));
  Surface surface = FitSurface(2, field, usable);
  for (const int degree : {4, 6, 8}) {
    Surface next = FitSurface(degree, field, usable);
    const auto terms = static_cast<double>(next.coefficients.size() - surface.coefficients.size());
    const double gain =
        count * (surface.residual_square - next.residual_square) / next.residual_square;
    if (gain < 3 * terms) break;
    surface = std::move(next);
  }
  return surface;
}

}  // namespace

FlatField MeasureFlatField(std::span<const CalibrationPair> pairs, const rig::SensorModel& sensor) {
  const std::size_t size = static_cast<std::size_t>(sensor.width) * sensor.height;
  const int sites = SitesOf(sensor.cfa);
  Sums sums{std::vector<double>(size), std::vector<double>(size), std::vector<char>(size, 1),
            std::vector<double>(sites), std::vector<int>(sites)};
  for (const auto& [row, column] : sensor.defects)
    sums.usable[static_cast<std::size_t>(row) * sensor.width + column] = 0;
  std::map<double, std::vector<const CalibrationPair*>> flats;
  for (const CalibrationPair& pair : pairs)
    if (!pair.dark) flats[pair.exposure_s].push_back(&pair);
  core::Progress progress("measure", flats.size());
  for (const auto& [exposure_s, of_exposure] : flats) {
    core::ThrowIfInterrupted();
    const Dark dark = DarkOf(pairs, exposure_s);
    std::vector<double> used(sites);
    for (const CalibrationPair* pair : of_exposure) {
      const auto [a, b] = pair->read();
      Add(a, dark, sensor, sums, used);
      Add(b, dark, sensor, sums, used);
    }
    // One dark under all of them: its error adds up.
    for (std::size_t k = 0; k < size; ++k)
      sums.variance[k] +=
          std::pow(used[SiteOf(sensor, k)], 2) * FloorVariance(sensor) / dark.frames;
    progress.Advance();
  }
  for (int site = 0; site < sites; ++site)
    if (sums.flats[site] == 0)
      throw InputError(fmt::format(
          "no flat has a mean between a tenth and eight tenths of the sensor's range{}; plan more "
          "exposures between",
          sites == 1 ? ""
                     : fmt::format(" in site {} of the mosaic, and no other site above", site)));
  FlatField field;
  field.width = sensor.width;
  field.height = sensor.height;
  field.flats = *std::min_element(sums.flats.begin(), sums.flats.end());
  field.sensitivity.resize(size);
  field.sigma.resize(size);
  for (std::size_t k = 0; k < size; ++k) {
    const double mean = sums.mean[SiteOf(sensor, k)];
    field.sensitivity[k] = static_cast<float>(sums.signal[k] / mean);
    field.sigma[k] = static_cast<float>(std::sqrt(sums.variance[k]) / mean);
  }
  std::vector<double> smooth(size), middle(sites);
  double residual = 0, noise = 0, count = 0, terms = 0;
  for (int site = 0; site < sites; ++site) {
    std::vector<char> usable = sums.usable;
    for (std::size_t k = 0; k < size; ++k) usable[k] = usable[k] && SiteOf(sensor, k) == site;
    const Surface surface = ChooseSurface(field, usable);
    field.degree = std::max(field.degree, surface.degree);
    middle[site] = surface.At(0, 0);
    terms += static_cast<double>(surface.coefficients.size());
    for (std::size_t k = 0; k < size; ++k) {
      if (SiteOf(sensor, k) != site) continue;
      const auto row = static_cast<int>(k) / field.width,
                 column = static_cast<int>(k) % field.width;
      smooth[k] = surface.At(Place(column, field.width), Place(row, field.height));
      if (!usable[k]) continue;
      residual += std::pow(field.sensitivity[k] / smooth[k] - 1, 2);
      noise += std::pow(field.sigma[k] / smooth[k], 2);
      ++count;
    }
  }
  residual /= count - terms;
  noise /= count;
  field.noise = std::sqrt(noise);
  field.pattern = std::sqrt(std::max(0.0, residual - noise));
  field.measured = field.noise < field.pattern;
  for (std::size_t k = 0; k < size; ++k) {
    const bool keep = field.measured && sums.usable[k];
    const double one = middle[SiteOf(sensor, k)];
    field.sensitivity[k] = static_cast<float>((keep ? field.sensitivity[k] : smooth[k]) / one);
    field.sigma[k] = static_cast<float>((keep ? field.sigma[k] : field.pattern * smooth[k]) / one);
  }
  return field;
}

FlatField MeasureFlatField(const session::SessionReader& session,
                           const std::filesystem::path& sensor_calibration, bool check_hashes) {
  rig::SensorModel sensor = session::SensorModelOf(session);
  if (!sensor_calibration.empty()) ApplySensorCalibration(sensor_calibration, sensor);
  FlatField field;
  try {
    field = MeasureFlatField(PairsOfSession(session, check_hashes), sensor);
  } catch (const InputError& error) {
    const std::string folder = session.folder().string(), what = error.what();
    if (what.starts_with(folder)) throw;
    throw InputError(fmt::format("{}: {}", folder, what));
  }
  field.provenance = {{"session_plan", session.plan_id()},
                      {"software", "luxfield " LUXFIELD_VERSION}};
  return field;
}

void WriteFlatField(const std::filesystem::path& path, const FlatField& field) {
  core::ExrPartView part;
  part.width = field.width;
  part.height = field.height;
  part.channels = {{"Y", std::span<const float>(field.sensitivity)},
                   {"sigma", std::span<const float>(field.sigma)}};
  part.attributes = {{"luxfield:format", std::string(kFormat)},
                     {"luxfield:version", 1},
                     {"luxfield:kind", std::string(field.measured ? "measured" : "polynomial")},
                     {"luxfield:degree", field.degree},
                     {"luxfield:noise", field.noise},
                     {"luxfield:pattern", field.pattern},
                     {"luxfield:flats", field.flats}};
  for (const auto& [name, value] : field.provenance) part.attributes["luxfield:" + name] = value;
  core::WriteExr(path, std::span(&part, 1));
}

std::string ApplyFlatField(const std::filesystem::path& path, rig::SensorModel& sensor) {
  core::ExrReader reader(path);
  const auto& part = reader.parts().at(0);
  const auto format = part.attributes.find("luxfield:format");
  if (format == part.attributes.end() || format->second != core::ExrValue(std::string(kFormat)))
    throw InputError(path.string(), "is not a flat field",
                     "write one with `luxfield calibrate flat-field`");
  if (part.width != sensor.width || part.height != sensor.height)
    throw InputError(path.string(),
                     fmt::format("has {} x {} pixels, the session's camera {} x {}", part.width,
                                 part.height, sensor.width, sensor.height),
                     "use the flat field of this camera and mode");
  const std::vector<float> sensitivity = reader.ReadFloat(0, "Y"),
                           sigma = reader.ReadFloat(0, "sigma");
  double square = 0;
  for (std::size_t k = 0; k < sensitivity.size(); ++k) {
    if (!(sensitivity[k] > 0 && std::isfinite(sensitivity[k]) && sigma[k] >= 0 &&
          std::isfinite(sigma[k])))
      throw InputError(
          path.string(),
          fmt::format("sensitivity {} +- {} must be above 0 and finite", sensitivity[k], sigma[k]),
          "measure the flat field again");
    square += static_cast<double>(sigma[k]) * sigma[k] /
              (static_cast<double>(sensitivity[k]) * sensitivity[k]);
  }
  sensor.vignetting = sensitivity;
  sensor.prnu = std::sqrt(square / static_cast<double>(sensitivity.size()));
  return core::Sha256(core::ReadFile(path));
}

core::Json ToJson(const FlatField& field) {
  return {{"kind", field.measured ? "measured" : "polynomial"},
          {"degree", field.degree},
          {"noise", field.noise},
          {"pattern", field.pattern},
          {"flats", field.flats},
          {"width", field.width},
          {"height", field.height}};
}

}  // namespace luxfield::reconstruct
