#include "luxfield/photometry/spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"

namespace luxfield::photometry {
namespace {

// CIE 018:2019, each 5 nm from 380.
constexpr std::array kEfficiency = {
    0.000039, 0.000064, 0.000120, 0.000217, 0.000396, 0.000640, 0.001210, 0.002180, 0.004000,
    0.007300, 0.011600, 0.016840, 0.023000, 0.029800, 0.038000, 0.048000, 0.060000, 0.073900,
    0.090980, 0.112600, 0.139020, 0.169300, 0.208020, 0.258600, 0.323000, 0.407300, 0.503000,
    0.608200, 0.710000, 0.793200, 0.862000, 0.914850, 0.954000, 0.980300, 0.994950, 1.000000,
    0.995000, 0.978600, 0.952000, 0.915400, 0.870000, 0.816300, 0.757000, 0.694900, 0.631000,
    0.566800, 0.503000, 0.441200, 0.381000, 0.321000, 0.265000, 0.217000, 0.175000, 0.138200,
    0.107000, 0.081600, 0.061000, 0.044580, 0.032000, 0.023200, 0.017000, 0.011920, 0.008210,
    0.005723, 0.004102, 0.002929, 0.002091, 0.001484, 0.001047, 0.000740, 0.000520, 0.000361,
    0.000249, 0.000172, 0.000120, 0.000085, 0.000060, 0.000042, 0.000030, 0.000021, 0.000015};

double ValueAt(const Spectrum& s, double nm) {
  if (nm < s.nm.front() || nm > s.nm.back()) return 0;
  const auto after = std::upper_bound(s.nm.begin() + 1, s.nm.end() - 1, nm);
  const auto k = static_cast<std::size_t>(after - s.nm.begin());
  const double share = (nm - s.nm[k - 1]) / (s.nm[k] - s.nm[k - 1]);
  return (1 - share) * s.value[k - 1] + share * s.value[k];
}

// All points of both, in order.
std::vector<double> PointsOf(const Spectrum& a, const Spectrum& b) {
  std::vector<double> points;
  std::ranges::merge(a.nm, b.nm, std::back_inserter(points));
  return points;
}

// of(nm) at two Gauss nodes between neighbours, exact for cubics.
template <typename F>
double Integral(const std::vector<double>& points, F&& of) {
  constexpr double kNode = 0.5773502691896257645;  // 1 / sqrt(3)
  double sum = 0;
  for (std::size_t k = 0; k + 1 < points.size(); ++k) {
    const double middle = 0.5 * (points[k] + points[k + 1]),
                 half = 0.5 * (points[k + 1] - points[k]);
    if (half > 0) sum += half * (of(middle - half * kNode) + of(middle + half * kNode));
  }
  return sum;
}

double Above0(double integral) {
  if (!(integral > 0)) throw std::invalid_argument("spectra have no light in common");
  return integral;
}

// The two numbers of a line; absent: it holds something else.
std::optional<std::array<double, 2>> NumbersOf(std::string line) {
  std::ranges::replace_if(
      line, [](char c) { return c == ',' || c == ';' || c == '\t' || c == '\r'; }, ' ');
  std::istringstream words(line);
  std::array<double, 2> numbers{};
  std::string word;
  for (double& number : numbers) {
    if (!(words >> word)) return {};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(number))
      return {};
  }
  if (words >> word) return {};
  return numbers;
}

}  // namespace

Spectrum ReadSpectrum(const std::filesystem::path& file) {
  constexpr double kShortest = 1, kLongest = 1e5;
  constexpr std::size_t kMostPoints = 100000;
  std::istringstream lines(core::ReadFile(file));
  Spectrum spectrum;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    const auto values = NumbersOf(line);
    if (!values && number == 1) continue;  // names of columns
    const auto fail = [&](const std::string& problem) {
      throw InputError(file.string(), fmt::format("line {} {}", number, problem),
                       "give lines of a wavelength in nm, which rises, and a value");
    };
    if (!values) fail("is not two numbers");
    const auto [nm, value] = *values;
    if (!(nm >= kShortest && nm <= kLongest)) fail(fmt::format("is of {} nm", nm));
    if (!spectrum.nm.empty() && !(nm > spectrum.nm.back())) fail("does not rise");
    if (spectrum.nm.size() == kMostPoints) fail("is one of too many");
    spectrum.nm.push_back(nm);
    spectrum.value.push_back(value);
  }
  if (spectrum.nm.size() < 2)
    throw InputError(file.string(), fmt::format("holds {} wavelengths", spectrum.nm.size()),
                     "give two or more lines of a wavelength in nm and a value");
  return spectrum;
}

const Spectrum& LuminousEfficiency() {
  static const Spectrum kV = [] {
    Spectrum v;
    for (std::size_t k = 0; k < kEfficiency.size(); ++k) {
      v.nm.push_back(380 + 5.0 * static_cast<double>(k));
      v.value.push_back(kEfficiency[k]);
    }
    return v;
  }();
  return kV;
}

const Spectrum& IlluminantA() {
  static const Spectrum kA = [] {
    constexpr double kC2 = 1.435e7, kKelvin = 2848, kReference = 560;  // nm K, K, nm
    Spectrum a;
    for (int nm = 300; nm <= 1100; ++nm) {
      a.nm.push_back(nm);
      a.value.push_back(100 * std::pow(kReference / nm, 5) *
                        std::expm1(kC2 / (kKelvin * kReference)) /
                        std::expm1(kC2 / (kKelvin * nm)));
    }
    return a;
  }();
  return kA;
}

double IntegralOf(const Spectrum& a, const Spectrum& b) {
  return Integral(PointsOf(a, b), [&](double nm) { return ValueAt(a, nm) * ValueAt(b, nm); });
}

double SpectralMismatchFactor(const Spectrum& responsivity, const Spectrum& lamp,
                              const Spectrum& calibration) {
  const Spectrum& v = LuminousEfficiency();
  return Above0(IntegralOf(lamp, v)) / Above0(IntegralOf(lamp, responsivity)) *
         Above0(IntegralOf(calibration, responsivity)) / Above0(IntegralOf(calibration, v));
}

double SpectralMismatchIndex(const Spectrum& responsivity) {
  const Spectrum &v = LuminousEfficiency(), &a = IlluminantA();
  const double scale = Above0(IntegralOf(a, v)) / Above0(IntegralOf(a, responsivity));
  // |s* - V| has a kink where it changes its sign: nodes every quarter of a nm are finer than that
  // matters.
  std::vector<double> points = PointsOf(responsivity, v), finer;
  constexpr double kStep_nm = 0.25;
  for (std::size_t k = 0; k + 1 < points.size(); ++k) {
    const int parts = 1 + static_cast<int>((points[k + 1] - points[k]) / kStep_nm);
    for (int part = 0; part < parts; ++part)
      finer.push_back(points[k] + (points[k + 1] - points[k]) * part / parts);
  }
  finer.push_back(points.back());
  const double difference = Integral(finer, [&](double nm) {
    return std::abs(scale * ValueAt(responsivity, nm) - ValueAt(v, nm));
  });
  return difference / Integral(v.nm, [&](double nm) { return ValueAt(v, nm); });
}

}  // namespace luxfield::photometry
