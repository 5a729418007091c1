#include "luxfield/bench/bench_environment.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <optional>

#include "luxfield/bench/ball_scene.h"
#include "luxfield/bench/bench_environment_sequence.h"
#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/environment/sun_sky.h"
#include "luxfield/planning/reference_picture.h"
#include "luxfield/render/estimators/environment.h"
#include "luxfield/render/scene/device_scene.h"

namespace luxfield::bench {
namespace {

using environment::CubeMap;
using lightfield::Vec3;
using render::EnvironmentKnobs;
using render::SampleSets;
using render::TileBalance;

constexpr std::uint64_t kSeed = 3, kReferenceSeed = 1003;
constexpr int kOrientations = 24, kOrientationSamples = 64;

struct Map {
  std::string name;
  CubeMap cube;
};

// A sun of 40 degrees' elevation or so over Central Europe.
Map OurSky(int face_size) {
  const auto sun =
      environment::FindSun({48.1, 11.6}, std::chrono::sys_days(std::chrono::year{2024} / 6 / 21) +
                                             std::chrono::hours(15));
  const environment::SunSky sky(sun, 3, 0.2);
  const int height = std::max(64, 2 * face_size);
  return {"sun and sky",
          environment::MakeCubeMap(
              {sky.Picture(environment::EnvironmentLayout::kLatitudeLongitude, height),
               environment::EnvironmentLayout::kLatitudeLongitude},
              face_size)};
}

std::vector<Map> ReadMaps(const BenchEnvironmentOptions& options) {
  if (options.maps.empty()) return {OurSky(options.face_size)};
  std::vector<Map> maps;
  for (const auto& path : options.maps)
    maps.push_back({path.stem().string(),
                    MakeCubeMap(environment::ReadEnvironmentPicture(path), options.face_size)});
  return maps;
}

struct Setting {
  std::string name;
  EnvironmentKnobs knobs;
  int samples;
};

std::string BalanceName(const EnvironmentKnobs& knobs) {
  static constexpr const char* kNames[] = {"cosine", "uniform", "energy", "none"};
  return kNames[static_cast<int>(knobs.balance)];
}

// Something to light, and what lights it.
class Bench {
 public:
  explicit Bench(const render::Device& device)
      : device_(device), estimator_(device), useful_(device, "-D COUNT_USEFUL=1") {}

  struct Lit {
    std::vector<cl_float4> light;  // reflected, of a Lambertian G-buffer irradiance
    double samples = 0, wall_s = 0, core_s = 0;
  };
  Lit Light(const render::GBuffer& gbuffer, const render::EnvironmentLight& light,
            const Setting& setting, std::uint64_t seed, bool useful = false,
            const render::RayScene* rays = nullptr) {
    render::EstimatorOptions options;
    options.samples_per_pixel = setting.samples;
    options.seed = seed;
    options.knobs.environment = setting.knobs;
    render::Lighting lighting(device_, gbuffer);
    device_.Finish();
    const core::Stopwatch stopwatch;
    (useful ? useful_ : estimator_).Light({gbuffer, {.rays = rays}}, light, options, lighting);
    device_.Finish();
    Lit lit;
    lit.wall_s = stopwatch.WallSeconds();
    lit.core_s = stopwatch.CoreSeconds();
    lit.light = (gbuffer.glossy() ? lighting.reflected : lighting.irradiance).Download<cl_float4>();
    for (const cl_uint n : lighting.samples.Download<cl_uint>()) lit.samples += n;
    return lit;
  }

  const render::Device& device() const { return device_; }

 private:
  render::Device device_;
  render::EnvironmentEstimator estimator_, useful_;
};

render::EnvironmentLight Show(const Bench& bench, const CubeMap& map,
                              const EnvironmentKnobs& knobs) {
  render::EnvironmentLight light(bench.device(), map.face_size, {knobs.tiles, knobs.compensation});
  light.Show(map);
  return light;
}

// Largest |integral of the density over a tile - 1|, from the densities and energies that kernels
// read: weight dw = w dx dy, w constant over a texel of area 4 / N^2.
double PdfError(const render::EnvironmentLight& light) {
  const auto texels = light.texels().Download<cl_float4>();
  const auto energies = light.energies().Download<float>();
  const std::size_t per_tile = texels.size() / energies.size();
  const double area = 4 / std::pow(light.face_size(), 2);
  double worst = 0;
  for (std::size_t tile = 0; tile < energies.size(); ++tile) {
    double sum = 0;
    for (std::size_t k = 0; k < per_tile; ++k) sum += texels[tile * per_tile + k].s[3] * area;
    if (energies[tile] > 0)
      worst = std::max(worst, std::abs(sum / static_cast<double>(energies[tile]) - 1));
  }
  return worst;
}

// Unit vectors spread over the sphere, rounded as kernels see them.
std::vector<cl_float4> Orientations() {
  std::vector<cl_float4> normals;
  for (int k = 0; k < kOrientations; ++k) {
    const double z = 1 - (2 * k + 1.0) / kOrientations, r = std::sqrt(1 - z * z),
                 phi = 0.3 + k * std::numbers::pi * (3 - std::sqrt(5.0));
    normals.push_back({{static_cast<float>(r * std::cos(phi)),
                        static_cast<float>(r * std::sin(phi)), static_cast<float>(z), 0}});
  }
  return normals;
}

// The same, each turned the shortest way that lays a corner of the cube on the horizon.
std::vector<cl_float4> EdgeOrientations() {
  std::vector<cl_float4> normals = Orientations();
  for (cl_float4& normal : normals) {
    const Vec3 n{normal.s[0], normal.s[1], normal.s[2]};
    Vec3 nearest = Normalized(Vec3{1, 1, 1});
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0}) {  // opposite corners share a plane
        const Vec3 corner = Normalized(Vec3{x, y, 1});
        if (std::abs(Dot(n, corner)) < std::abs(Dot(n, nearest))) nearest = corner;
      }
    const Vec3 turned = Normalized(n - Dot(n, nearest) * nearest);
    normal = {{static_cast<float>(turned.x), static_cast<float>(turned.y),
               static_cast<float>(turned.z), 0}};
  }
  return normals;
}

// Pixels and seeds that draw independently: pixels with samples of their own are as good as seeds,
// and so are the sets of 4 x 4 pixels. Seeds cost a launch each.
struct Copies {
  int width, height, seeds;
};
Copies CopiesOf(SampleSets sets, int copies) {
  if (sets == SampleSets::kScrambled) return {copies, 1, 1};
  if (sets == SampleSets::kInterleaved) return {4, 4, copies / 16};
  return {1, 1, copies / 16};
}

// Luminance of the irradiance, drawn independently so many times for each normal.
using Draws = std::vector<std::vector<double>>;
Draws DrawIrradiance(Bench& bench, const render::EnvironmentLight& light, const Setting& setting,
                     const std::vector<cl_float4>& normals, int copies) {
  const auto [width, height, seeds] = CopiesOf(setting.knobs.sets, copies);
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  const cl_float4 origin{{0, 0, 0, 1}};
  Draws draws(normals.size());
  for (std::size_t k = 0; k < normals.size(); ++k) {
    render::GBuffer gbuffer(bench.device(), width, height);
    gbuffer.normal.Upload(std::span<const cl_float4>(std::vector(pixels, normals[k])));
    gbuffer.position.Upload(std::span<const cl_float4>(std::vector(pixels, origin)));
    for (int seed = 0; seed < seeds; ++seed)
      for (const auto& e : bench.Light(gbuffer, light, setting, kSeed + k * seeds + seed).light)
        draws[k].push_back(core::Luminance({e.s[0], e.s[1], e.s[2]}));
  }
  return draws;
}

// Errors of the means against the texel sums, in standard errors.
std::vector<double> ZValues(const CubeMap& map, const std::vector<cl_float4>& normals,
                            const Draws& draws) {
  std::vector<double> z;
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const auto& n = normals[k].s;
    const double exact = core::Luminance(environment::Irradiance(map, {n[0], n[1], n[2]}));
    double mean = 0, deviations = 0;
    int count = 0;
    for (const double value : draws[k]) {
      const double difference = value - mean;
      mean += difference / ++count;
      deviations += difference * (value - mean);
    }
    // Rounding of float32 sums, where there is hardly any noise.
    const double scatter = std::hypot(std::sqrt(deviations / (count - 1.0) / count), 1e-6 * exact);
    z.push_back(scatter > 0 ? (mean - exact) / scatter : 0);
  }
  return z;
}

double SumOfSquares(const std::vector<double>& z) {
  return std::inner_product(z.begin(), z.end(), z.begin(), 0.0);
}
double Worst(const std::vector<double>& z) {
  double worst = 0;
  for (const double value : z) worst = std::max(worst, std::abs(value));
  return worst;
}

// Rows of a map; its z-values are appended to `pool`, those on edges to `edge_pool`.
nlohmann::json MapRows(Bench& bench, const Map& map, int copies, std::vector<double>& pool,
                       std::vector<double>& edge_pool) {
  const auto normals = Orientations(), edges = EdgeOrientations();
  const auto scrambled = SampleSets::kScrambled;
  nlohmann::json rows = nlohmann::json::array();
  for (const auto& [name, knobs] : std::initializer_list<std::pair<const char*, EnvironmentKnobs>>{
           {"cosine", {TileBalance::kCosine, 1, scrambled}},
           {"cosine, 4 x 4 tiles", {TileBalance::kCosine, 4, scrambled}},
           {"uniform", {TileBalance::kUniform, 1, scrambled}},
           {"energy", {TileBalance::kEnergy, 1, scrambled}},
           {"none", {TileBalance::kNone, 1, scrambled}},
           {"compensated", {TileBalance::kCosine, 1, scrambled, 0.5f, 1}},
           {"light alone", {TileBalance::kCosine, 1, scrambled, 0}},
           {"cosine, shared", {TileBalance::kCosine, 1, SampleSets::kShared}},
           {"cosine, interleaved", {TileBalance::kCosine, 1, SampleSets::kInterleaved}}}) {
    const Setting setting{name, knobs, kOrientationSamples};
    const auto light = Show(bench, map.cube, knobs);
    const auto z = ZValues(map.cube, normals,
                           DrawIrradiance(bench, light, setting, normals, copies)),
               edge_z =
                   ZValues(map.cube, edges, DrawIrradiance(bench, light, setting, edges, copies));
    pool.insert(pool.end(), z.begin(), z.end());
    edge_pool.insert(edge_pool.end(), edge_z.begin(), edge_z.end());
    rows.push_back({{"map", map.name},
                    {"strategy", setting.name},
                    {"pdf_error", PdfError(light)},
                    {"z_mean_square", SumOfSquares(z) / kOrientations},
                    {"z_worst", Worst(z)},
                    {"edge_z_mean_square", SumOfSquares(edge_z) / kOrientations},
                    {"edge_z_worst", Worst(edge_z)}});
  }
  return rows;
}

nlohmann::json PooledRow(const std::vector<double>& z, const std::vector<double>& edge_z) {
  const double sum = SumOfSquares(z) + SumOfSquares(edge_z);
  const auto count = static_cast<double>(z.size() + edge_z.size());
  return {{"map", "all"},
          {"strategy", "all"},
          {"z_mean_square", SumOfSquares(z) / static_cast<double>(z.size())},
          {"z_worst", Worst(z)},
          {"edge_z_mean_square", SumOfSquares(edge_z) / static_cast<double>(edge_z.size())},
          {"edge_z_worst", Worst(edge_z)},
          {"z_values", z.size() + edge_z.size()},
          {"chi_squared", sum},
          {"sigmas", (sum - count) / std::sqrt(2 * count)}};
}

struct View {
  render::DeviceScene scene;
  render::GBuffer gbuffer;
  std::vector<std::size_t> hit;
  std::vector<cl_float4> albedo;
};

View MakeView(const Bench& bench, int width, int height, bool glossy) {
  scene::Scene scene = BallScene(width, height);
  if (!glossy) scene::MakeLambertian(scene.geometry);
  View view{UploadScene(bench.device(), scene.geometry),
            render::GBuffer(bench.device(), width, height, glossy),
            {},
            {}};
  render::PrimaryVisibility(bench.device())
      .Render(view.scene, scene.camera, 0, {0.5, 0.5}, view.gbuffer);
  const auto position = view.gbuffer.position.Download<cl_float4>();
  for (std::size_t k = 0; k < position.size(); ++k)
    if (position[k].s[3] != 0) view.hit.push_back(k);
  view.albedo = view.gbuffer.albedo.Download<cl_float4>();
  return view;
}

// The radiance of the pixels that hit something.
core::Image Radiance(const View& view, const std::vector<cl_float4>& light) {
  core::Image image(static_cast<int>(view.hit.size()), 1, 3);
  for (std::size_t k = 0; k < view.hit.size(); ++k)
    for (int c = 0; c < 3; ++c)
      image.at(c, 0, static_cast<int>(k)) =
          light[view.hit[k]].s[c] *
          (view.gbuffer.glossy() ? 1.0f
                                 : view.albedo[view.hit[k]].s[c] * std::numbers::inv_pi_v<float>);
  return image;
}

nlohmann::json BalanceRows(Bench& bench, const Map& map, const BenchEnvironmentOptions& options) {
  nlohmann::json rows = nlohmann::json::array();
  const auto scrambled = SampleSets::kScrambled, shared = SampleSets::kShared;
  for (const bool glossy : {false, true}) {
    const View view = MakeView(bench, options.error_width, options.error_height, glossy);
    const Setting best{
        "reference", {TileBalance::kCosine, 4, scrambled}, options.reference_samples / 2};
    const auto reference_light = Show(bench, map.cube, best.knobs);
    const auto half = [&](std::uint64_t seed) {
      return Radiance(view, bench.Light(view.gbuffer, reference_light, best, seed).light);
    };
    const planning::ReferencePicture reference =
        planning::MakeReference(half(kReferenceSeed), half(kReferenceSeed + 1));
    for (const Setting& setting : {Setting{"", {TileBalance::kCosine, 1, shared}, 60},
                                   Setting{"", {TileBalance::kUniform, 1, shared}, 60},
                                   Setting{"", {TileBalance::kUniform, 1, shared}, 180},
                                   Setting{"", {TileBalance::kCosine, 1, scrambled}, 60},
                                   Setting{"", {TileBalance::kUniform, 1, scrambled}, 60},
                                   Setting{"", {TileBalance::kUniform, 1, scrambled}, 180},
                                   Setting{"", {TileBalance::kEnergy, 1, scrambled}, 60},
                                   Setting{"", {TileBalance::kNone, 1, scrambled}, 60},
                                   Setting{"", {TileBalance::kCosine, 2, scrambled}, 60},
                                   Setting{"", {TileBalance::kCosine, 4, scrambled}, 60},
                                   Setting{"", {TileBalance::kCosine, 1, scrambled, 0.5f, 1}, 60},
                                   Setting{"", {TileBalance::kNone, 1, scrambled, 0.5f, 1}, 60}}) {
      const auto light = Show(bench, map.cube, setting.knobs);
      double square = 0, lab = 0, samples = 0, core_s = 0;
      for (int seed = 0; seed < options.seeds; ++seed) {
        const auto lit = bench.Light(view.gbuffer, light, setting, kSeed + seed);
        const auto difference = planning::Compare(Radiance(view, lit.light), reference);
        square += difference.rel_rmse * difference.rel_rmse / options.seeds;
        lab += difference.mean_lab / options.seeds;
        samples = lit.samples;
        if (seed == 0 || lit.core_s < core_s) core_s = lit.core_s;
      }
      const double useful = bench.Light(view.gbuffer, light, setting, kSeed, true).samples;
      rows.push_back({{"map", map.name},
                      {"surface", glossy ? "glossy" : "lambert"},
                      {"balance", BalanceName(setting.knobs)},
                      {"tiles", setting.knobs.tiles},
                      {"sets", setting.knobs.sets == shared ? "shared" : "scrambled"},
                      {"compensation", setting.knobs.compensation},
                      {"spp", setting.samples},
                      {"rel_rmse", std::sqrt(square)},
                      {"mean_lab", lab},
                      {"useful", useful / samples},
                      {"samples", samples / static_cast<double>(view.hit.size())},
                      {"core_s", core_s},
                      {"reference_rel_rmse", reference.rel_rmse}});
    }
  }
  return rows;
}

nlohmann::json ThesisRows(const nlohmann::json& balance) {
  nlohmann::json rows = nlohmann::json::array();
  const auto is = [](const nlohmann::json& row, const char* name, int samples) {
    return row["balance"] == name && row["spp"] == samples && row["tiles"] == 1 &&
           row["compensation"] == 0;
  };
  for (const auto& even : balance) {
    if (!is(even, "uniform", 180)) continue;
    for (const auto& balanced : balance) {
      if (!is(balanced, "cosine", 60) || balanced["map"] != even["map"] ||
          balanced["surface"] != even["surface"] || balanced["sets"] != even["sets"])
        continue;
      const auto ratio = [&](const char* what) {
        return balanced[what].get<double>() / even[what].get<double>();
      };
      rows.push_back({{"map", even["map"]},
                      {"surface", even["surface"]},
                      {"sets", even["sets"]},
                      {"error_ratio", ratio("rel_rmse")},
                      {"lab_ratio", ratio("mean_lab")},
                      {"useful_60", balanced["useful"]},
                      {"useful_180", even["useful"]}});
    }
  }
  return rows;
}

nlohmann::json SpeedRows(Bench& bench, const Map& map, const BenchEnvironmentOptions& options) {
  nlohmann::json rows = nlohmann::json::array();
  for (const bool glossy : {false, true}) {
    const View view = MakeView(bench, options.width, options.height, glossy);
    for (const SampleSets sets : {SampleSets::kShared, SampleSets::kScrambled}) {
      const EnvironmentKnobs knobs{TileBalance::kCosine, 1, sets};
      const auto light = Show(bench, map.cube, knobs);
      bench.Light(view.gbuffer, light, {"", knobs, 2}, kSeed);  // compiles
      for (const bool shadows : {false, true})
        for (const int samples : options.samples_per_pixel) {
          std::optional<Bench::Lit> least;
          for (int run = 0; run < options.repeats; ++run) {
            const auto lit = bench.Light(view.gbuffer, light, {"", knobs, samples}, kSeed, false,
                                         shadows ? view.scene.rays.get() : nullptr);
            if (!least || lit.core_s < least->core_s) least = lit;
          }
          rows.push_back({{"surface", glossy ? "glossy" : "lambert"},
                          {"shadows", shadows ? "traced" : "none"},
                          {"sets", sets == SampleSets::kShared ? "shared" : "scrambled"},
                          {"spp", samples},
                          {"samples_per_s", least->samples / least->wall_s},
                          {"core_ns_per_sample", 1e9 * least->core_s / least->samples},
                          {"fps", 1 / least->wall_s}});
        }
    }
  }
  return rows;
}

nlohmann::json TableRows(const Bench& bench, const BenchEnvironmentOptions& options) {
  nlohmann::json rows = nlohmann::json::array();
  for (const int face_size : {128, 256, 512}) {
    const Map map = OurSky(face_size);
    for (const int tiles : {1, 4}) {
      render::EnvironmentLight light(bench.device(), face_size, {tiles, 0});
      double tables_s = INFINITY, core_s = INFINITY, frame_s = INFINITY;
      for (int run = 0; run <= options.repeats; ++run) {
        bench.device().Finish();
        const core::Stopwatch frame;
        light.Show(map.cube);
        bench.device().Finish();
        frame_s = std::min(frame_s, frame.WallSeconds());
        const core::Stopwatch tables;
        light.MakeTables();
        bench.device().Finish();
        tables_s = std::min(tables_s, tables.WallSeconds());
        core_s = std::min(core_s, tables.CoreSeconds());
      }
      rows.push_back({{"face_size", face_size},
                      {"tiles", tiles},
                      {"tables_ms", 1e3 * tables_s},
                      {"core_ms", 1e3 * core_s},
                      {"upload_ms", 1e3 * std::max(0.0, frame_s - tables_s)}});
    }
  }
  return rows;
}

}  // namespace

nlohmann::json BenchEnvironment(const BenchEnvironmentOptions& options) {
  if (std::min({options.face_size, options.width, options.height, options.error_width,
                options.error_height, options.seeds}) < 1 ||
      options.copies < 32 || options.repeats < 0 || options.reference_samples < 2)
    throw InputError(
        "bench environment: sizes and seeds must be at least 1, copies at least 32, repeats at "
        "least 0, samples of a "
        "reference at least 2");
  if (options.face_size % 4 != 0)
    throw InputError("bench environment: the face size must be a multiple of 4, for its tiles");
  const auto wanted = [&](const char* part) {
    const auto& parts = options.parts;
    return parts.empty() || std::find(parts.begin(), parts.end(), part) != parts.end();
  };
  Bench bench(render::Device::Open(options.device, options.threads));
  const std::vector<Map> maps = ReadMaps(options);
  const nlohmann::json none = nlohmann::json::array();
  nlohmann::json result{{"maps", none}, {"balance", none}, {"speed", none}, {"tables", none}};
  std::vector<double> z, edge_z;
  for (const Map& map : maps) {
    if (wanted("maps"))
      for (const auto& row : MapRows(bench, map, options.copies, z, edge_z))
        result["maps"].push_back(row);
    if (wanted("balance"))
      for (const auto& row : BalanceRows(bench, map, options)) result["balance"].push_back(row);
  }
  if (wanted("maps")) result["maps"].push_back(PooledRow(z, edge_z));
  result["thesis"] = ThesisRows(result["balance"]);
  if (wanted("speed") && options.repeats > 0)
    result["speed"] = SpeedRows(bench, maps.front(), options);
  if (wanted("tables") && options.repeats > 0) result["tables"] = TableRows(bench, options);
  result["sequence"] = options.sequence.empty() ? none : SequenceRows(bench.device(), options);
  return result;
}

}  // namespace luxfield::bench
