#include "study/demo.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "core/file.h"
#include "core/json.h"
#include "hal/sim/simulated_lab.h"
#include "preprocess/table_io.h"
#include "render/film.h"

namespace luxfield::study {
namespace {

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The demo deletes what an earlier demo left, never anything else.
void PrepareFolder(const std::filesystem::path& folder) {
  const auto mark = folder / "summary.json";
  if (std::filesystem::exists(folder) && !std::filesystem::is_empty(folder)) {
    if (!std::filesystem::exists(mark) && !std::filesystem::exists(folder / "session"))
      throw InputError(folder.string(), "holds files that are not an earlier demo's",
                       "choose another --output");
    std::filesystem::remove_all(folder);
  }
  std::filesystem::create_directories(folder);
}

// Shortest and longest exposure of every position, in the order they were taken.
void ReadBrackets(const std::filesystem::path& session, DemoResult& result) {
  const core::SessionReader reader(session);
  result.ladder_s = core::Field<std::vector<double>>(
      core::Field<core::Json>(reader.plan(), "exposure", "plan.json"), "ladder_s", "plan.json");
  std::map<std::pair<int, int>, std::array<double, 3>> brackets;  // time, shortest, longest
  for (const auto& frame : reader.frames()) {
    if (frame.kind != core::FrameKind::kPosition) continue;
    auto [it, added] = brackets.try_emplace(
        {frame.i, frame.j}, std::array{frame.t_start_s, frame.exposure_s, frame.exposure_s});
    it->second[1] = std::min(it->second[1], frame.exposure_s);
    it->second[2] = std::max(it->second[2], frame.exposure_s);
  }
  std::vector<std::array<double, 3>> ordered;
  ordered.reserve(brackets.size());
  for (const auto& [position, bracket] : brackets) ordered.push_back(bracket);
  std::sort(ordered.begin(), ordered.end());
  for (const auto& bracket : ordered) {
    result.shortest_s.push_back(bracket[1]);
    result.longest_s.push_back(bracket[2]);
  }
}

// Worst relative error of an image's total in the tables against a double sum of its texels.
double TableError(const preprocess::Tables& tables, const lightfield::LightField& field) {
  double worst = 0;
  for (int m = 0; m < tables.count(); ++m) {
    double sum = 0;
    for (std::size_t k = 0; k < field.geometry.plane_size(); ++k)
      sum += preprocess::TexelMagnitude(field, m, k);
    if (sum > 0) worst = std::max(worst, std::abs(tables.Total(m) / sum - 1));
  }
  return worst;
}

}  // namespace

DemoResult RunDemo(const DemoOptions& options) {
  DemoResult result;
  PrepareFolder(options.folder);
  const double begin = Now();
  const auto file = [&](const char* name) { return options.folder / name; };

  ChainOptions chain;
  chain.lab = options.lab;
  chain.plan = options.plan;
  chain.folder = options.folder;
  chain.name = "headlight";
  chain.seed = options.seed;
  ChainResult measured = RunChain(chain);
  lightfield::WriteLightField(file("headlight.sigma.lf.exr"), measured.reconstruction.sigma);
  result.capture = measured.capture;
  result.merge = measured.merge;
  double start = Now();
  auto non_negative =
      reconstruct::Reconstruct(measured.measurements, {reconstruct::Precision::kFloat, true});
  result.coefficients = std::move(non_negative.coefficients);
  result.coefficients.provenance["non_negative"] = "yes";
  result.reconstruction = non_negative.report;
  const auto light_field_file = file("headlight.lf.exr");
  lightfield::WriteLightField(light_field_file, result.coefficients);
  result.non_negative_s = Now() - start;
  ReadBrackets(options.folder / "session", result);

  start = Now();
  const std::string hash = core::Sha256OfFile(light_field_file);
  const auto tables = preprocess::BuildTables(result.coefficients, light_field_file.string(), hash);
  preprocess::WriteTables(file("headlight.tab.exr"), tables);
  const double preprocess_s = Now() - start;

  start = Now();
  const render::Device device = render::Device::Open(options.device, options.threads);
  result.device = device.info().name;
  result.estimator = options.estimator;
  const auto picture = [&](const std::filesystem::path& light_field,
                           const std::filesystem::path& table_file, const std::string& estimator,
                           render::Shadows shadows) {
    scene::SceneOverrides overrides;
    overrides.light_fields["*"] = light_field;
    if (!table_file.empty()) overrides.tables["*"] = table_file;
    render::RenderOptions how;
    how.estimator = estimator;
    how.samples_per_pixel = options.samples_per_pixel;
    how.shadows = shadows;
    how.seed = options.seed.value_or(1);
    render::LitScene scene(device, scene::ReadScene(options.scene, overrides));
    return render::Renderer(scene, how).Render();
  };
  result.frame = picture(light_field_file, file("headlight.tab.exr"), options.estimator,
                         render::Shadows::kTraced);
  render::WriteFrame(file("picture.exr"), result.frame);
  const double render_s = Now() - start;
  const double total_s = Now() - begin;
  const double table_error = TableError(tables, result.coefficients);

  // From here on the truth: nothing above has seen it.
  const capture::Plan plan = capture::ReadPlan(options.plan);
  const hal::sim::SimulatedLab lab(options.lab, options.seed);
  const auto& geometry = result.coefficients.geometry;
  const auto true_irradiance = lab.true_irradiance(geometry);
  result.truth = lab.truth(geometry);
  const auto truth_file = file("truth.lf.exr");
  lightfield::WriteLightField(truth_file, result.truth);
  const render::Frame unshadowed = picture(light_field_file, {}, "exact", render::Shadows::kNone);
  const render::Frame ideal = picture(truth_file, {}, "exact", render::Shadows::kNone);
  result.picture = core::Compare(unshadowed.radiance, ideal.radiance);

  // Frames have no truth of their own that merge does not judge; what capture answers for is a
  // steady lamp.
  const double lamp_range = result.merge.largest_lamp_factor - result.merge.least_lamp_factor;
  result.stages = {
      {"capture",
       measured.capture_s,
       {lamp_range, lamp_range},
       "range of the lamp's level over the session (merge divides it out)"},
      {"merge", measured.merge_s, IrradianceError(measured.measurements, true_irradiance),
       "irradiance behind the filters, against the lab's own"},
      {"reconstruct", measured.reconstruct_s,
       CompareWithTruth(measured.reconstruction.coefficients.data, result.truth.data),
       "coefficients, against the lamp's projection onto the basis"},
      {"preprocess",
       preprocess_s,
       {table_error, table_error},
       "worst total of a table, against a double sum"},
      {"render", render_s, CompareWithTruth(unshadowed.irradiance.data, ideal.irradiance.data),
       "irradiance of the scene without shadows, against the true light field's"}};
  result.non_negative_error = CompareWithTruth(result.coefficients.data, result.truth.data);
  result.total_wall_s = total_s;
  return result;
}

}  // namespace luxfield::study
