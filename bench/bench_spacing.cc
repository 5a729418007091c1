#include "luxfield/bench/bench_spacing.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "luxfield/capture/plan/plan.h"
#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/sim/tracer.h"
#include "luxfield/planning/lamp_picture.h"
#include "luxfield/reconstruct/solve/reconstruct.h"
#include "luxfield/render/renderer.h"

namespace luxfield::bench {
namespace {

using lightfield::BasisGrid;
using lightfield::LuminaireGeometry;
using lightfield::Vec2;

constexpr std::uint64_t kSeed = 1;

double LargestSide(const planning::Rectangle& r) { return std::max(r.x1 - r.x0, r.y1 - r.y0); }

// The lamp in the interior cells, on the axis of the supports.
LuminaireGeometry GeometryFor(const LuminaireGeometry& plan, const planning::TracedLamp& lamp,
                              double spacing_m, double delta_m, int texels) {
  const planning::Rectangle& lit = lamp.lit();
  const auto functions = [&](double length) {
    return static_cast<int>(std::ceil(length / spacing_m - 1e-9)) + plan.grid.basis.cells - 1;
  };
  LuminaireGeometry g = plan;
  g.delta_m = delta_m;
  g.channels = 1;
  g.grid = BasisGrid::Centred(plan.grid.basis, functions(lit.x1 - lit.x0),
                              functions(lit.y1 - lit.y0), spacing_m);
  g.grid.u0_m += 0.5 * (lit.x0 + lit.x1);
  g.grid.v0_m += 0.5 * (lit.y0 + lit.y1);
  // Directions that the lamp's middle and rim have through the plan's images.
  const double lamp_m = LargestSide(lit);
  const auto side = [&](double of_plan) {
    return std::min(lamp_m, of_plan) + std::max(of_plan - lamp_m, 0.0) * delta_m / plan.delta_m;
  };
  auto& lattice = g.lattice;
  const Vec2 middle{plan.lattice.s0_m + 0.5 * plan.lattice.extent_s_m(),
                    plan.lattice.t1_m - 0.5 * plan.lattice.extent_t_m()};
  if (texels > 0) lattice.width = lattice.height = texels;
  lattice.ds_m = side(plan.lattice.extent_s_m()) / lattice.width;
  lattice.dt_m = side(plan.lattice.extent_t_m()) / lattice.height;
  lattice.s0_m = middle.x * delta_m / plan.delta_m - 0.5 * lattice.extent_s_m();
  lattice.t1_m = middle.y * delta_m / plan.delta_m + 0.5 * lattice.extent_t_m();
  return g;
}

// What ideal filters see; as many rays through the lamp whatever the spacing.
lightfield::Measurements MeasureIdeally(const hal::sim::Lamp& lamp, const LuminaireGeometry& g,
                                        double lamp_m) {
  constexpr double kRays = 64;  // across the lamp; an even number a cell, or its middle is one
  const BasisGrid& grid = g.grid;
  hal::sim::TraceOptions options;
  options.delta_m = g.delta_m;
  options.cell_m = grid.spacing_m;
  options.cell_origin = {grid.u0_m, grid.v0_m};
  options.u_samples_per_cell =
      2 * std::max(2, static_cast<int>(std::lround(0.5 * kRays * grid.spacing_m / lamp_m)));
  std::vector<hal::sim::FilterPose> poses;
  for (int m = 0; m < grid.count(); ++m)
    poses.push_back({grid.centre(m % grid.width, m / grid.width), 0});
  const double half = 0.5 * grid.basis.cells;
  const auto images = hal::sim::TraceIrradiance(
      lamp,
      [&](Vec2 offset, int) {
        return grid.basis.Value(offset.x / grid.spacing_m + half) *
               grid.basis.Value(offset.y / grid.spacing_m + half);
      },
      half * grid.spacing_m, poses, g.lattice,
      std::vector<hal::sim::LatticeWindow>(poses.size(), {0, 0, g.lattice.width, g.lattice.height}),
      options);
  return planning::IdealMeasurements(g, images, lamp);
}

}  // namespace

nlohmann::json BenchSpacing(const BenchSpacingOptions& options) {
  auto lab = hal::sim::ReadLab(core::Config::FromFile(options.lab), kSeed);
  if (lab.lamp->field())
    throw InputError(options.lab.string(), "has a lamp that is a light field",
                     "give it a lamp of another kind");
  lab.channels = 1;
  const LuminaireGeometry plan = capture::ReadPlan(options.plan).geometry;
  std::vector<std::tuple<const char*, double, double>> cases;
  for (const double spacing_mm : options.spacings_mm)
    cases.emplace_back("spacing", 1e-3 * spacing_mm, plan.delta_m);
  for (const double delta_m : options.deltas_m)
    cases.emplace_back("delta", plan.grid.spacing_m, delta_m);

  std::filesystem::create_directories(options.folder);
  const auto file = options.folder / "ideal.lf.exr";
  const auto device = render::Device::Open(options.device, options.threads);
  scene::SceneOverrides overrides;
  overrides.light_fields["*"] = file;
  overrides.width = options.width;
  overrides.height = options.height;
  const scene::Scene scene = scene::ReadScene(options.scene, overrides);
  const planning::TracedLamp lamp(lab, plan);
  const double lamp_m = LargestSide(lamp.lit());
  std::optional<planning::LampPicture> truth;
  core::Json rows = core::Json::array();
  core::Progress progress("grids", cases.size());
  for (const auto& [vary, spacing_m, delta_m] : cases) {
    core::ThrowIfInterrupted();
    const LuminaireGeometry g = GeometryFor(plan, lamp, spacing_m, delta_m, options.texels);
    const auto field = reconstruct::Reconstruct(MeasureIdeally(*lab.lamp, g, lamp_m)).coefficients;
    lightfield::WriteLightField(file, field);
    render::LitScene lit(device, scene);
    if (!truth)
      truth = planning::TraceLampPicture(lit, scene, lamp, {.points = 610, .seed = kSeed});
    render::RenderOptions how;
    how.estimator = "exact";
    how.shadows = render::Shadows::kNone;
    const render::Frame frame = render::Renderer(lit, how).Render();
    const planning::StageError error = planning::ErrorAgainst(frame.irradiance, truth->irradiance);
    const double flux = planning::FluxThrough(g.lattice, planning::TracedLamp(lab, g), kSeed).value;
    rows.push_back({{"vary", vary},
                    {"spacing_mm", 1e3 * spacing_m},
                    {"delta_m", delta_m},
                    {"positions", g.grid.count()},
                    {"texel_mm", 1e3 * g.lattice.ds_m},
                    {"flux_error", planning::LuminousFlux(field) / flux - 1},
                    {"rel_rmse", error.rel_rmse},
                    {"rel_l2", error.rel_l2},
                    {"mean_lab", planning::Compare(frame.radiance, truth->radiance).mean_lab}});
    progress.Advance();
  }
  return rows;
}

}  // namespace luxfield::bench
