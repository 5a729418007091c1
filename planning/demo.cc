#include "luxfield/planning/demo.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "luxfield/core/colour.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/planning/lamp_picture.h"
#include "luxfield/planning/traced_lamp.h"
#include "luxfield/preprocess/table_io.h"
#include "luxfield/render/film/film.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/stated.h"

namespace luxfield::planning {
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
  const session::SessionReader reader(session);
  const session::PlanFile plan = session::PlanOf(reader);
  result.ladder_s = session::Stated(plan.exposure, "exposure", "plan.json").ladder_s;
  std::map<std::pair<int, int>, std::array<double, 3>> brackets;  // time, shortest, longest
  for (const auto& frame : reader.frames()) {
    if (frame.kind != session::FrameKind::kPosition) continue;
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

// The flux that an estimator takes from the tables.
double TablesFlux(const preprocess::Tables& tables, const lightfield::LuminaireGeometry& geometry) {
  double sum = 0;
  for (int m = 0; m < tables.count(); ++m) sum += tables.Total(m);
  return sum * geometry.lattice.texel_area_m2() * geometry.grid.PhiIntegral();
}

// The scene, all luminaires showing one light field.
render::Frame Picture(const render::Device& device, const DemoOptions& options,
                      const std::filesystem::path& light_field, const std::filesystem::path& tables,
                      const std::string& estimator, render::Shadows shadows) {
  scene::SceneOverrides overrides;
  overrides.light_fields["*"] = light_field;
  if (!tables.empty()) overrides.tables["*"] = tables;
  render::RenderOptions how;
  how.estimator = estimator;
  how.samples_per_pixel = options.samples_per_pixel;
  how.shadows = shadows;
  how.seed = options.seed.value_or(1);
  render::LitScene scene(device, scene::ReadScene(options.scene, overrides));
  return render::Renderer(scene, how).Render();
}

constexpr std::uint64_t kJudgingSeed = 1;
constexpr int kTexelsJudged = 40000;

// Against the lamp itself, and against what an ideal measurement on the same grid gives.
struct Errors {
  StageError lamp, projection;
};

// Errors of the signed coefficients; sets those of the others, and the flux.
Errors JudgeFields(const lightfield::LightField& measured, const TracedLamp& lamp,
                   DemoResult* result) {
  const auto compared =
      CompareWithLamp({&measured, &result->coefficients, &result->truth}, lamp, kJudgingSeed);
  result->non_negative_error = compared[1];
  result->floor = compared[2];
  result->non_negative_projection = CompareWithTruth(result->coefficients.data, result->truth.data);
  const TracedFlux flux = FluxThrough(measured.geometry.lattice, lamp, kJudgingSeed);
  result->flux = {flux.value, flux.standard_error, LuminousFlux(measured),
                  LuminousFlux(result->coefficients), LuminousFlux(result->truth)};
  return {compared[0], CompareWithTruth(measured.data, result->truth.data)};
}

core::Difference Better(const core::Difference& a, const core::Difference& b) {
  return a.mean_lab <= b.mean_lab ? a : b;
}

// Irradiance without shadows lit by the measurement; sets the pictures and the floor's irradiance.
Errors JudgePictures(const render::Device& device, const DemoOptions& options,
                     const std::filesystem::path& measured_file,
                     const std::filesystem::path& truth_file,
                     const std::filesystem::path& ideal_file, const TracedLamp& lamp,
                     DemoResult* result) {
  const auto exact = [&](const std::filesystem::path& light_field) {
    return Picture(device, options, light_field, {}, "exact", render::Shadows::kNone);
  };
  const render::Frame measured = exact(measured_file), projected = exact(truth_file),
                      ideal = exact(ideal_file);
  scene::SceneOverrides overrides;
  overrides.light_fields["*"] = truth_file;
  const scene::Scene scene = scene::ReadScene(options.scene, overrides);
  const LampPicture truth =
      TraceLampPicture(render::LitScene(device, scene), scene, lamp, {.seed = kJudgingSeed});
  const auto half_of = [](core::Difference d) {  // the standard error of the halves' mean
    return core::Difference{0.5 * d.rel_rmse, 0.25 * d.rel_mse, 0.5 * d.bias,
                            0.5 * d.max_abs,  0.5 * d.mean_lab, d.mean_reference};
  };
  result->pictures = {
      Compare(measured.radiance, truth.radiance),
      core::Compare(measured.radiance, projected.radiance),
      Better(Compare(projected.radiance, truth.radiance), Compare(ideal.radiance, truth.radiance)),
      Compare(result->frame.radiance, truth.shadowed),
      half_of(core::Compare(truth.radiance.a, truth.radiance.b))};
  const StageError by_projection = ErrorAgainst(projected.irradiance, truth.irradiance),
                   by_ideal = ErrorAgainst(ideal.irradiance, truth.irradiance);
  result->floor_irradiance = {std::min(by_projection.rel_rmse, by_ideal.rel_rmse),
                              std::min(by_projection.rel_l2, by_ideal.rel_l2)};
  return {ErrorAgainst(measured.irradiance, truth.irradiance),
          CompareWithTruth(measured.irradiance.data, projected.irradiance.data)};
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
  result.frame = Picture(device, options, light_field_file, file("headlight.tab.exr"),
                         options.estimator, render::Shadows::kTraced);
  render::WriteFrame(file("picture.exr"), result.frame);
  const double render_s = Now() - start;
  const double total_s = Now() - begin;

  // From here on the truth: nothing above has seen it.
  start = Now();
  const hal::sim::SimulatedLab lab(options.lab, options.seed);
  const auto& geometry = result.coefficients.geometry;
  const hal::sim::LabDescription description =
      hal::sim::ReadLab(core::Config::FromFile(options.lab), options.seed);
  const auto traced = lab.true_irradiance(geometry);
  result.truth = lab.truth(geometry);
  const auto ideal =
      reconstruct::Reconstruct(IdealMeasurements(geometry, traced, *description.lamp));
  const auto truth_file = file("truth.lf.exr");
  lightfield::WriteLightField(truth_file, result.truth);
  lightfield::WriteLightField(file("ideal.lf.exr"), ideal.coefficients);
  const TracedLamp lamp(description, geometry);
  const Errors merged{
      IrradianceAgainstLamp(measured.measurements, lamp, kTexelsJudged, kJudgingSeed),
      IrradianceError(measured.measurements, traced)};
  const Errors solved = JudgeFields(measured.reconstruction.coefficients, lamp, &result);
  const double table_flux = TablesFlux(tables, geometry);
  const double table_error = TableError(tables, result.coefficients);
  const Errors lit = JudgePictures(device, options, light_field_file, truth_file,
                                   file("ideal.lf.exr"), lamp, &result);

  const auto both = [](double error) { return StageError{error, error}; };
  // Frames have no truth of their own that merge does not judge; what capture answers for is a
  // steady lamp.
  const StageError lamp_range =
      both(result.merge.largest_lamp_factor - result.merge.least_lamp_factor);
  result.stages = {
      {"capture", measured.capture_s, lamp_range, lamp_range,
       "range of the lamp's level over the session (merge divides it out)"},
      {"merge", measured.merge_s, merged.lamp, merged.projection,
       "irradiance behind the filters, against the lamp's (projection: the lab's own samples of "
       "it)"},
      {"reconstruct", measured.reconstruct_s, solved.lamp, solved.projection,
       "radiance of all rays, against the lamp's (projection: coefficients)"},
      {"preprocess", preprocess_s, both(std::abs(table_flux / result.flux.lamp - 1)),
       both(table_error),
       "flux of the tables, against the lamp's (projection: worst total, against a double sum)"},
      {"render", render_s, lit.lamp, lit.projection,
       "irradiance of the scene without shadows, against the lamp's"}};
  result.judging_s = Now() - start;
  result.total_wall_s = total_s;
  return result;
}

}  // namespace luxfield::planning
