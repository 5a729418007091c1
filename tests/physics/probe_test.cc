// A photograph of a mirroring ball or through a fisheye, ray-traced and taken by the simulated
// sensor through ND filters, becomes the map that lit it: files, merge, fit, resampling.
#include "luxfield/reconstruct/calibrate/mirror_ball/probe.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/environment/spherical_polygon.h"
#include "luxfield/hal/sim/sensor.h"

namespace luxfield {
namespace {

using environment::CubeMap;
using lightfield::Dot;
using lightfield::Normalized;
using lightfield::Vec2;
using lightfield::Vec3;
using testing::HasSubstr;

constexpr double kPi = std::numbers::pi;
constexpr int kWidth = 260, kHeight = 240;
constexpr double kReflectance = 0.7;  // of the ball; the fisheye lets as much through
constexpr reconstruct::Circle kTruth = {127.37, 122.81, 96.2};
constexpr double kDistance = 0.9, kRadius = 0.05;  // metres

enum class View { kBallFarAway, kBallNear, kFisheye };

// Soft light in texels of 3.75 degrees, and one of them a sun 2^17 times as bright. What a fisheye
// does not show is black.
CubeMap TrueMap(View view) {
  CubeMap cube(24);
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < 24; ++row)
      for (int column = 0; column < 24; ++column) {
        const Vec3 w = Normalized(
            environment::CubeVector({face, -1 + (column + 0.5) / 12, 1 - (row + 0.5) / 12}));
        for (int c = 0; c < 3; ++c)
          cube.at(face, row, column, c) = static_cast<float>(
              view == View::kFisheye && w.z < 0
                  ? 0
                  : 100 * (1 + 0.5 * w.z + 0.3 * w.x * w.y + 0.15 * std::sin(3 * w.y)));
      }
  const std::size_t sun = cube.texel_of({0.5, 0.55, 0.67});
  for (std::size_t c = 0; c < 3; ++c) cube.data[3 * sun + c] = 100 * 131072.0f;
  return cube;
}

// The camera looks towards -y: -x to its right, +z up; the fisheye's up, +y on top. Which texel a
// point of the picture shows, and by how much of its radiance: by the ball, or past it.
struct Seen {
  std::size_t texel;
  double share;
};
Seen Trace(const CubeMap& cube, View view, Vec2 p) {
  if (view == View::kFisheye) {
    const double x = (p.x - kTruth.x) / kTruth.radius, y = (kTruth.y - p.y) / kTruth.radius;
    const double q = std::hypot(x, y), slope = q > 0 ? std::sin(kPi / 2 * q) / q : 0;
    if (q > 1) return {0, 0};
    return {cube.texel_of({-slope * x, slope * y, std::cos(kPi / 2 * q)}), kReflectance};
  }
  if (view == View::kBallFarAway) {  // parallel rays, straight on beside the ball
    const double x = (p.x - kTruth.x) / kTruth.radius, y = (kTruth.y - p.y) / kTruth.radius;
    const double q = x * x + y * y;
    if (q > 1) return {cube.texel_of({0, -1, 0}), 1};
    const Vec3 n = {-x, std::sqrt(1 - q), y}, v = {0, -1, 0};
    return {cube.texel_of(v - 2 * Dot(v, n) * n), kReflectance};
  }
  const double focal = kTruth.radius / std::tan(std::asin(kRadius / kDistance));
  const auto ray = [&](Vec2 q) {
    return Normalized({-(q.x - 0.5 * kWidth) / focal, -1, (0.5 * kHeight - q.y) / focal});
  };
  const Vec3 v = ray(p), centre = kDistance * ray({kTruth.x, kTruth.y});
  const double b = Dot(v, centre), d = b * b - Dot(centre, centre) + kRadius * kRadius;
  if (d < 0) return {cube.texel_of(v), 1};
  const Vec3 n = (1 / kRadius) * ((b - std::sqrt(d)) * v - centre);
  return {cube.texel_of(v - 2 * Dot(v, n) * n), kReflectance};
}

// Radiance in the sensor's pixels: the mean over points, many where a pixel shows several things.
std::vector<float> Photograph(const CubeMap& cube, View view) {
  std::vector<float> pixels(std::size_t(kWidth) * kHeight);
  const auto mean = [&](int row, int column, int side) {
    double sum = 0;
    bool one = true;
    const Seen first = Trace(cube, view, {double(column), double(row)});
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const Seen seen = Trace(cube, view, {column + (x + 0.5) / side, row + (y + 0.5) / side});
        one &= seen.texel == first.texel && seen.share == first.share;
        sum += seen.share * cube.data[3 * seen.texel];
      }
    return std::pair(sum / (side * side), one);
  };
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      const auto [coarse, one] = mean(row, column, 4);
      pixels[std::size_t(row) * kWidth + column] =
          static_cast<float>(one ? coarse : mean(row, column, 24).first);
    }
  return pixels;
}

class ScratchFolder {
 public:
  ScratchFolder()
      : path_(std::filesystem::path(testing::TempDir()) / fmt::format("probe_{}", ::getpid())) {
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

constexpr double kElectronsPerRadiance = 1000;

// The bracket on disk: 0.4 s, a 32nd of it, and 0.4 s behind 10 and 17 stops.
std::filesystem::path Shoot(const std::filesystem::path& folder, const std::vector<float>& pixels,
                            View view, std::uint64_t seed, bool with_darkest) {
  hal::sim::SimulatedSensor model;
  model.width = kWidth, model.height = kHeight;
  model.bits = 16, model.black_dn = 500, model.saturation_dn = 60000, model.gain_dn_per_e = 1.5;
  model.responsivity_e_per_s_per_w_m2 = {kElectronsPerRadiance};
  model.photon_noise = true, model.read_noise_dn = 6, model.prnu = 0.004;
  const hal::sim::Sensor sensor(model, seed);
  std::ofstream toml(folder / "probe.toml");
  if (view == View::kFisheye)
    toml << fmt::format("[probe]\nkind = \"fisheye\"\nradiance_per_rate = [{}]\n",
                        1 / (kElectronsPerRadiance * kReflectance));
  else
    toml << fmt::format(
        "[probe]\nkind = \"mirror-ball\"\nreflectance = [{}]\nradiance_per_rate = [{}]\n",
        kReflectance, 1 / kElectronsPerRadiance);
  toml << "[camera]\ngain_dn_per_e = 1.5\nsaturation_dn = 60000\nblack_dn = 500\n"
          "read_noise_dn = 6\nprnu = 0.004\n";
  if (view == View::kFisheye)
    toml << "[lens]\nfield_of_view_deg = 180\nprojection = \"equidistant\"\n";
  if (view == View::kBallNear)
    toml << fmt::format("[perspective]\ndistance_m = {}\ndiameter_m = {}\n", kDistance,
                        2 * kRadius);
  const struct {
    double exposure_s, stops;
  } shots[] = {{0.4, 0}, {0.4 / 32, 0}, {0.4, 10}, {0.4, 17}};
  for (int k = 0; k < (with_darkest ? 4 : 3); ++k) {
    const auto& shot = shots[k];
    const auto frame = sensor.Expose(pixels, std::exp2(-shot.stops), 0, shot.exposure_s, k);
    core::WriteFileAtomically(folder / fmt::format("{}.tif", k), session::EncodeTiff(frame));
    toml << fmt::format("[[exposure]]\nfile = \"{}.tif\"\nexposure_s = {}\nnd_stops = {}\n", k,
                        shot.exposure_s, shot.stops);
  }
  return folder / "probe.toml";
}

// sqrt(sum ((n . w)+ Omega sigma)^2) over the pixels, and what the filled texels add, all of one
// kind.
double IrradianceSigma(const reconstruct::Probe& probe, const reconstruct::ProbePicture& picture,
                       const reconstruct::ProbeOptics& optics, Vec3 n) {
  double variance = 0, filled = 0;
  std::vector<Vec3> outline;
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      optics.PixelOutline(probe.rim.circle, row, column, 2, outline);
      if (outline.empty()) continue;
      const double part = std::max(0.0, std::abs(environment::PolygonSolidAngle(outline)) *
                                            Dot(n, Normalized(outline[0] + outline[2]))) *
                          picture.sigma.at(0, row, column);
      variance += part * part;
    }
  const auto angles = environment::TexelSolidAngles(probe.radiance.face_size);
  for (std::size_t t = 0; t < probe.coverage.size(); ++t) {
    if (probe.coverage[t] > 0) continue;
    const std::size_t side = probe.radiance.face_size;
    const int face = int(t / side / side), row = int(t / side % side), column = int(t % side);
    const Vec3 w = Normalized(environment::CubeVector(
        {face, -1 + 2 * (column + 0.5) / double(side), 1 - 2 * (row + 0.5) / double(side)}));
    filled += std::max(0.0, Dot(n, w)) * angles[t % angles.size()] * probe.sigma.data[3 * t];
  }
  return std::sqrt(variance + filled * filled);
}

class ProbeOf : public testing::TestWithParam<View> {};

TEST_P(ProbeOf, LightsAsTheMapThatItShows) {
  const View view = GetParam();
  const std::uint64_t seed = 5 + static_cast<int>(view);
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  const CubeMap truth = TrueMap(view);
  const ScratchFolder folder;
  const auto description = reconstruct::ReadProbeDescription(
      Shoot(folder.path(), Photograph(truth, view), view, seed, true));
  const auto picture = reconstruct::MergeProbe(description);
  const auto probe =
      reconstruct::MakeProbe(picture, description, reconstruct::FindRim(picture, description));

  const auto &fit = probe.rim.circle, &error = probe.rim.sigma;
  std::printf("  rim (%.3f, %.3f) %.3f, off by %.3f %.3f %.3f, sigma %.3f %.3f %.3f\n", fit.x,
              fit.y, fit.radius, fit.x - kTruth.x, fit.y - kTruth.y, fit.radius - kTruth.radius,
              error.x, error.y, error.radius);
  EXPECT_NEAR(fit.x, kTruth.x, 4 * error.x);
  EXPECT_NEAR(fit.y, kTruth.y, 4 * error.y);
  EXPECT_NEAR(fit.radius, kTruth.radius, 4 * error.radius);
  EXPECT_LT(error.radius, 0.1);

  reconstruct::ProbeOptics optics = description.optics;
  optics.principal_point = {0.5 * kWidth, 0.5 * kHeight};
  double worst = 0, worst_relative = 0;
  const double scalar = 4 * kPi * environment::MeanRadiance(truth)[0];
  for (int k = 0; k < 24; ++k) {  // 24 directions even over the sphere (a spiral)
    const double z = 1 - (2 * k + 1) / 24.0, phi = k * kPi * (3 - std::sqrt(5.0));
    const Vec3 n = {std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z};
    const double ours = environment::Irradiance(probe.radiance, n)[0],
                 theirs = environment::Irradiance(truth, n)[0];
    // The fit's own error turns every direction by up to so much, and E by as much of the whole.
    const double turn = 2 * (error.radius + error.x + error.y) / fit.radius;
    const double sigma = std::hypot(IrradianceSigma(probe, picture, optics, n), turn * scalar);
    worst = std::max(worst, std::abs(ours - theirs) / sigma);
    worst_relative = std::max(worst_relative, std::abs(ours - theirs) / scalar);
    EXPECT_NEAR(ours, theirs, 3 * sigma) << k;
  }
  std::printf("  irradiance of 24 orientations: worst %.2f sigma, %.3f %% of the scalar one\n",
              worst, 100 * worst_relative);
  EXPECT_LT(worst_relative, 0.01);
  // The sun is in the map, above what HALF holds.
  EXPECT_GT(*std::max_element(probe.radiance.data.begin(), probe.radiance.data.end()), 1e6f);
  // But for what the hole's border texels show a part of, or the fisheye's margin of two pixels and
  // a pixel's diagonal.
  if (view == View::kFisheye) {
    EXPECT_NEAR(probe.seen_sr, 2 * kPi, 2 * kPi * std::sin(kPi / 2 * 3.5 / kTruth.radius));
  } else {
    EXPECT_NEAR(probe.seen_sr + probe.filled_sr, 4 * kPi, 0.25);
  }
  // The sky, texel by texel, but for what touches the sun.
  double squares = 0, weights = 0;
  const auto angles = environment::TexelSolidAngles(probe.radiance.face_size);
  const int n = probe.radiance.face_size;
  const Vec3 sun = Normalized(Vec3{0.5, 0.55, 0.67});
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < n; ++row)
      for (int column = 0; column < n; ++column) {
        const std::size_t t = probe.radiance.texel(face, row, column);
        const Vec3 w = Normalized(
            environment::CubeVector({face, -1 + (2 * column + 1.0) / n, 1 - (2 * row + 1.0) / n}));
        if (probe.coverage[t] < 0.99 || Dot(w, sun) > std::cos(0.15)) continue;
        const double exact = truth.data[3 * truth.texel_of(w)],
                     angle = angles[static_cast<std::size_t>(row) * n + column];
        squares += angle * std::pow(probe.radiance.data[3 * t] / exact - 1, 2);
        weights += angle;
      }
  std::printf("  sky: %.2f %% rms of %.2f sr\n", 100 * std::sqrt(squares / weights), weights);
  EXPECT_LT(std::sqrt(squares / weights), 0.03);

  // The file is an environment map as any other.
  const auto path = folder.path() / "map.exr";
  reconstruct::WriteProbe(path, probe, description);
  const auto back = environment::ReadEnvironmentPicture(path);
  EXPECT_EQ(back.layout, environment::EnvironmentLayout::kCube);
  const CubeMap again = environment::MakeCubeMap(back);
  ASSERT_EQ(again.face_size, probe.radiance.face_size);
  for (std::size_t k = 0; k < again.data.size(); ++k)
    EXPECT_NEAR(again.data[k], probe.radiance.data[k], 1e-5 * probe.radiance.data[k] + 1e-6);
  const core::ExrReader reader(path);
  EXPECT_TRUE(reader.has_channel(0, "sigma.G"));
  EXPECT_TRUE(reader.has_channel(0, "coverage.Y"));
}

INSTANTIATE_TEST_SUITE_P(BallsAndSky, ProbeOf,
                         testing::Values(View::kBallFarAway, View::kBallNear, View::kFisheye));

TEST(Probe, RefusesASunThatSaturatesEverywhere) {
  const ScratchFolder folder;
  const auto description = reconstruct::ReadProbeDescription(
      Shoot(folder.path(), Photograph(TrueMap(View::kBallFarAway), View::kBallFarAway),
            View::kBallFarAway, 1, false));
  const auto picture = reconstruct::MergeProbe(description);
  try {
    reconstruct::MakeProbe(picture, description, reconstruct::FindRim(picture, description));
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("2.tif"));  // 0.4 s behind 10 stops lets through least
    EXPECT_THAT(error.what(), HasSubstr("saturated"));
  }
}

TEST(Probe, DescriptionsNameFileAndField) {
  const ScratchFolder folder;
  const auto path = folder.path() / "probe.toml";
  const std::string camera = "[camera]\ngain_dn_per_e = 1\nsaturation_dn = 100\n";
  const std::string exposure = "[[exposure]]\nfile = \"a.tif\"\nexposure_s = 1\n";
  const struct {
    std::string text, field;
  } cases[] = {
      {"[probe]\nkind = \"egg\"\n" + camera + exposure, "kind"},
      {"[probe]\nkind = \"fisheye\"\n" + camera + exposure, "lens"},
      {"[probe]\nkind = \"mirror-ball\"\n" + camera, "exposure"},
      {"[probe]\nkind = \"mirror-ball\"\nreflectance = [0.5, 0.5]\n" + camera + exposure,
       "reflectance"},
      {"[probe]\nkind = \"mirror-ball\"\nreflectance = [1.5]\n" + camera + exposure, "reflectance"},
      {"[probe]\nkind = \"mirror-ball\"\nreflectanse = [1]\n" + camera + exposure, "reflectanse"},
      {"[probe]\nkind = \"mirror-ball\"\n" + camera + exposure +
           "[perspective]\ndistance_m = 1\ndiameter_m = 2\n",
       "distance_m"},
      {"[probe]\nkind = \"mirror-ball\"\n" + camera + exposure + "attenuation = 2\n",
       "attenuation"},
      {"[probe]\nkind = \"mirror-ball\"\n" + camera + exposure +
           "nd_stops = 1\nattenuation = 0.5\n",
       "nd_stops"}};
  for (const auto& c : cases) {
    std::ofstream(path) << c.text;
    try {
      reconstruct::ReadProbeDescription(path);
      ADD_FAILURE() << "accepted: " << c.text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(path.string()));
      EXPECT_THAT(error.what(), HasSubstr(c.field));
    }
  }
  std::ofstream(path) << "[probe]\nkind = \"mirror-ball\"\n" + camera + exposure;
  EXPECT_THROW(reconstruct::MergeProbe(reconstruct::ReadProbeDescription(path)), InputError);
}

}  // namespace
}  // namespace luxfield
