// luxfield bench NAME: the commands behind docs/performance.md.
#include "luxfield/bench/verbs/verb_bench.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <memory>

#include "luxfield/bench/bench_accuracy.h"
#include "luxfield/bench/bench_budget.h"
#include "luxfield/bench/bench_conditioning.h"
#include "luxfield/bench/bench_environment.h"
#include "luxfield/bench/bench_errors.h"
#include "luxfield/bench/bench_exposures.h"
#include "luxfield/bench/bench_filters.h"
#include "luxfield/bench/bench_keep.h"
#include "luxfield/bench/bench_merge.h"
#include "luxfield/bench/bench_nearfield.h"
#include "luxfield/bench/bench_plan.h"
#include "luxfield/bench/bench_rays.h"
#include "luxfield/bench/bench_rigs.h"
#include "luxfield/bench/bench_sampling.h"
#include "luxfield/bench/bench_scale.h"
#include "luxfield/bench/bench_shadows.h"
#include "luxfield/bench/bench_signed.h"
#include "luxfield/bench/bench_soft_shadows.h"
#include "luxfield/bench/bench_solve.h"
#include "luxfield/bench/bench_stacks.h"
#include "luxfield/bench/bench_tradeoff.h"
#include "luxfield/bench/thesis_table.h"
#include "luxfield/bench/verbs/bench_rows.h"
#include "luxfield/bench/verbs/calibration_rows.h"
#include "luxfield/bench/verbs/tradeoff_report.h"
#include "luxfield/bench/verbs/verb_bench_all.h"
#include "luxfield/bench/verbs/verb_bench_balance.h"
#include "luxfield/bench/verbs/verb_bench_capture.h"
#include "luxfield/bench/verbs/verb_bench_classical.h"
#include "luxfield/bench/verbs/verb_bench_error_runs.h"
#include "luxfield/bench/verbs/verb_bench_errors.h"
#include "luxfield/bench/verbs/verb_bench_lamps.h"
#include "luxfield/bench/verbs/verb_bench_memory.h"
#include "luxfield/bench/verbs/verb_bench_peers.h"
#include "luxfield/bench/verbs/verb_bench_pictures.h"
#include "luxfield/bench/verbs/verb_bench_ray_files.h"
#include "luxfield/bench/verbs/verb_bench_spacing.h"
#include "luxfield/cli/program.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/cost_model.h"
#include "luxfield/render/device/device.h"

namespace luxfield::bench {
namespace {

struct CalibrateOptions {
  std::string device;
  int threads = 0;
};

// Measures the cost model, stores it and shows how well it fits.
core::Json Calibrate(const CalibrateOptions& how) {
  const auto device = render::Device::Open(how.device, how.threads);
  std::vector<render::CalibrationRun> runs;
  const auto model = render::Calibrate(device, &runs);
  const bool kept = render::KeepCostModel(device, model);
  if (!kept) fmt::print(stderr, "the model cannot be kept: see `luxfield cache`\n");
  return Finish(CalibrationRows(runs), device.info().name);
}

// Error against time, with its CSV and plots.
core::Json Tradeoff(const BenchTradeoffOptions& how, const std::filesystem::path& folder) {
  const core::Json rows = BenchTradeoff(how);
  const auto files = WriteTradeoff(rows, folder);
  core::Json result = FinishOnDevice(
      rows, how,
      {"scene", "shadows", "surface", "estimator", "spp", "knobs", "core_s", "fps", "build_core_s",
       "rel_rmse", "rel_mse", "mean_lab", "bias", "resolved", "pareto"});
  for (const auto& file : files) fmt::print("{}\n", file.string());
  ThesisTableOptions thesis;
  thesis.device = how.device;
  thesis.threads = how.threads;
  result["thesis"] = ThesisTable(thesis);
  PrintRows(result["thesis"], {"what", "unit", "thesis", "ours", "how"});
  return result;
}

// Whether errors asked for are kept, with what the rows add up to.
core::Json Accuracy(const BenchAccuracyOptions& how) {
  const core::Json rows = BenchAccuracy(how);
  core::Json result =
      FinishOnDevice(rows, how,
                     {"scene", "shadows", "surface", "asked", "estimated", "true", "kept",
                      "resolved", "estimator", "spp", "core_s", "choosing_s", "best_fixed",
                      "best_fixed_spp", "best_fixed_core_s", "time_ratio"});
  const core::Json summary = AccuracySummary(rows);
  fmt::print(
      "kept {} of {} ({} more that the reference is too noisy to tell); time over that of the best "
      "fixed setting: median {:.2f}, worst {:.2f}, at most 2 in {} of {}\n",
      summary["kept"].get<int>(), summary["resolved"].get<int>(), summary["unresolved"].get<int>(),
      summary["median_time_ratio"].get<double>(), summary["worst_time_ratio"].get<double>(),
      summary["within_twice_the_time"].get<int>(), summary["timed"].get<int>());
  result["summary"] = summary;
  return result;
}

// Four tables, one below the other.
core::Json Environment(const BenchEnvironmentOptions& how) {
  core::Json result = BenchEnvironment(how);
  for (const char* part : {"maps", "balance", "thesis", "speed", "tables", "sequence"}) {
    if (result[part].empty()) continue;
    PrintRows(result[part], {});
    fmt::print("\n");
  }
  if (!result["maps"].empty()) {
    const core::Json& all = result["maps"].back();
    fmt::print("{} z-values: chi-squared {:.1f}, {:+.2f} standard deviations\n",
               all["z_values"].get<int>(), all["chi_squared"].get<double>(),
               all["sigmas"].get<double>());
  }
  result["device"] = render::Device::Open(how.device, how.threads).info().name;
  result["threads"] = core::Threads();
  return result;
}

// A bench with files on disk: in its folder, or in a temporary one.
template <typename Options>
core::Json RunInFolder(core::Json (*bench)(const Options&), Options how) {
  const bool temporary = how.folder.empty();
  if (temporary)
    how.folder =
        std::filesystem::temp_directory_path() / fmt::format("luxfield-bench-{}", ::getpid());
  core::Json result = bench(how);
  if (temporary) std::filesystem::remove_all(how.folder);
  return result;
}

template <typename Options>
core::Json InFolder(core::Json (*bench)(const Options&), Options how,
                    const std::vector<std::string>& columns = {}) {
  return Finish(RunInFolder(bench, how), CpuName(), columns);
}

// Two tables.
core::Json Stacks(const BenchStacksOptions& how) {
  core::Json result = RunInFolder(BenchStacks, how);
  PrintRows(result["merges"], {"stack", "merger", "rms", "median", "seen", "invented", "sigma",
                               "calibrate_s", "merge_s", "refused"});
  fmt::print("\n");
  PrintRows(result["curves"], {"channel", "fit", "from", "to", "rms", "in_sigma", "steps"});
  result["device"] = CpuName();
  result["threads"] = core::Threads();
  return result;
}

void AddSize(CLI::App& app, int& width, int& height) {
  app.add_option("--width", width, "Picture width, pixels")->check(CLI::Range(1, 16384));
  app.add_option("--height", height, "Picture height, pixels")->check(CLI::Range(1, 16384));
}

void AddSamples(CLI::App& app, std::vector<int>& samples) {
  app.add_option("--spp", samples, "Samples per pixel to try");
}

void AddEstimators(CLI::App& app, std::vector<std::string>& estimators) {
  if (estimators.empty())
    app.add_option("--estimator", estimators, "Estimators (default: all)")->default_str("");
  else
    app.add_option("--estimator", estimators, "Estimators");
}

void AddReferenceSamples(CLI::App& app, int& samples) {
  app.add_option("--reference-spp", samples, "Samples per pixel of sampled references")
      ->check(CLI::Range(2, 1 << 24));
}

void AddScenes(CLI::App& app, std::vector<std::filesystem::path>& scenes) {
  app.add_option("--scene", scenes, "scene.toml files, lit by the lamps of `./run lamps`");
}

void AddNearfield(cli::Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<BenchNearfieldOptions>(
      program, benches, "nearfield", "Estimators against closed form and time",
      [](const auto& o) { return FinishOnDevice(BenchNearfield(o), o); });
  AddSize(app, how.width, how.height);
  AddSamples(app, how.samples_per_pixel);
  AddEstimators(app, how.estimators);
}

void AddSampling(cli::Program& program, CLI::App& benches) {
  AddDeviceBench<BenchSamplingOptions>(
      program, benches, "sampling", "What it costs to draw a light sample",
      [](const auto& o) { return FinishOnDevice(BenchSampling(o), o); });
}

// Medians, millions of rays in a core-second.
core::Json Rays(const BenchRaysOptions& how) {
  core::Json rows = core::Json::array();
  for (const RaySpeed& speed : BenchRays(how))
    rows.push_back({{"rays", speed.rays},
                    {"device", core::Median(speed.device)},
                    {"embree_single", core::Median(speed.embree_single)},
                    {"embree_packets", core::Median(speed.embree_packets)},
                    {"device_hits", speed.device_hits},
                    {"embree_hits", speed.embree_hits}});
  return FinishOnDevice(rows, how);
}

void AddRays(cli::Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<BenchRaysOptions>(
      program, benches, "rays", "Rays traced a core-second, in millions, beside Embree's", Rays);
  AddSize(app, how.width, how.height);
  app.add_option("--triangles", how.triangles, "Of the mesh, about")->check(CLI::Range(1, 1 << 26));
  app.add_option("--runs", how.runs, "Of which the median counts")->check(CLI::Range(1, 100));
}

// What both benches of shadows have in common is `how`'s; the sizes are their own where none is asked
// for.
core::Json Headlights(SoftShadowsOptions options, const BenchShadowsOptions& how,
                      const CLI::App& asked) {
  if (asked.count("--width")) options.width = how.width;
  if (asked.count("--height")) options.height = how.height;
  if (asked.count("--reference-spp")) options.reference_samples = how.reference_samples;
  options.pictures = how.pictures;
  options.device = how.device;
  options.threads = how.threads;
  return FinishOnDevice(core::Json::array({SoftShadowsRow(options, MeasureSoftShadows(options))}),
                        how);
}

void AddShadows(cli::Program& program, CLI::App& benches) {
  auto headlights = std::make_shared<SoftShadowsOptions>();
  auto two = std::make_shared<bool>(false);
  auto asked = std::make_shared<const CLI::App*>();
  const auto [app, how] = AddDeviceBench<BenchShadowsOptions>(
      program, benches, "shadows", "Shadow maps and traced shares against traced samples",
      [headlights, two, asked](const auto& o) {
        return *two ? Headlights(*headlights, o, **asked) : FinishOnDevice(BenchShadows(o), o);
      });
  *asked = &app;
  AddSize(app, how.width, how.height);
  AddSamples(app, how.samples_per_pixel);
  AddEstimators(app, how.estimators);
  AddReferenceSamples(app, how.reference_samples);
  app.add_option("--folder", how.pictures, "Where pictures go (default: nowhere)");
  auto* flag =
      app.add_flag("--headlights", *two,
                   "Two headlights of 11 x 9 images of 256 x 256 texels by volume with soft "
                   "shadow maps instead, 1024 x 768 and 256 reference samples unless asked for "
                   "otherwise: pictures per second and mean Lab");
  app.add_option("--map-size", headlights->map_size, "Of --headlights: texels along a map's side")
      ->check(CLI::Range(render::PatchShadows::kMinSize, render::PatchShadows::kMaxSize))
      ->needs(flag);
  app.add_option("--frames", headlights->motion_frames,
                 "Of --headlights: pictures of lamps that move a centimetre between them, whose "
                 "changes are compared with the reference's; 0: none")
      ->check(CLI::Range(0, 1 << 16))
      ->needs(flag);
  app.add_option(
         "--flight", headlights->flight_frames,
         "Of --headlights: pictures of a camera that moves a centimetre between them, whose "
         "changes are compared with the reference's; 0: none")
      ->check(CLI::Range(0, 1 << 16))
      ->needs(flag);
}

void AddSigned(cli::Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<BenchSignedOptions>(
      program, benches, "signed", "Negative coefficients lit as they are against C >= 0",
      [&program](auto& o) {
        o.seed = program.common().seed.value_or(1);
        return FinishOnDevice(BenchSigned(o), o);
      });
  app.add_option("--grid", how.grids, "Basis functions along each axis");
  app.add_option("--size", how.size, "Texels of an image along each axis");
  app.add_option("--receivers", how.receivers, "Surface points");
  app.add_option("--spp", how.samples_per_pixel, "Samples per pixel");
  app.add_option("--seeds", how.seeds, "Pictures that noise is taken over");
}

void AddErrors(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchErrorsOptions>();
  how->lab = "data/labs/small.toml";
  how->plan = "data/plans/small.toml";
  CLI::App& app =
      program.AddVerb(benches, "errors",
                      "Does the propagated sigma of C hold, and what does each systematic error do",
                      [how, &program] {
                        how->seed = program.common().seed.value_or(1);
                        return InFolder(BenchErrors, *how);
                      });
  app.add_option("--lab", how->lab, "The lab.toml whose [errors.*] state the sizes");
  app.add_option("--plan", how->plan, "The plan.toml");
  app.add_option("--folder", how->folder, "Scratch folder (default: a temporary one)");
  app.add_option("--seeds", how->seeds, "Sessions with random sources alone")
      ->check(CLI::Range(2, 10000));
  app.add_flag("--random-only", how->random_only, "Only the check of sigma");
}

void AddMergeBench(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchMergeOptions>();
  CLI::App& app =
      program.AddVerb(benches, "merge", "How fast a session is merged, against disk and memory",
                      [how] { return InFolder(BenchMerge, *how); });
  app.add_option("--grid-width", how->grid_width, "Filter positions along u")
      ->check(CLI::Range(1, 64));
  app.add_option("--grid-height", how->grid_height, "Filter positions along v")
      ->check(CLI::Range(1, 64));
  app.add_option("--exposures", how->exposures, "Exposures of a bracket")->check(CLI::Range(1, 16));
  app.add_option("--sensor", how->sensor, "Sensor side, pixels")->check(CLI::Range(16, 16384));
  app.add_option("--lattice", how->lattice, "Image side on I, texels")->check(CLI::Range(1, 4096));
  app.add_flag("--reflector", how->reflector, "See I at an angle, through a homography");
  app.add_flag("--keep", how->keep,
               "Keep the sessions in --folder, and start with those that an earlier run kept");
  app.add_option("--case", how->cases, "Cases whose names start so (default: all)")
      ->default_str("");
  app.add_option("--folder", how->folder, "Scratch folder (default: a temporary one)");
}

void AddExposures(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchExposuresOptions>();
  CLI::App& app = program.AddVerb(
      benches, "exposures", "Bias and spread of merged exposures against the Cramer-Rao bound",
      [how, &program] {
        how->seed = program.common().seed.value_or(1);
        return Finish(
            BenchExposures(*how), CpuName(),
            {"sensor", "e_per_s", "used", "bias", "bias_se", "spread_ratio", "sigma_ratio", "case",
             "flagged", "no_number", "bias_kept", "bias_zeroed", "bias_dropped"});
      });
  app.add_option("--pixels", how->pixels, "Pixels of every figure")->check(CLI::Range(2, 1 << 26));
  app.add_option("--stops", how->stops, "Range of the scene from 30 electrons per second up")
      ->check(CLI::Range(1, 30));
  app.add_option("--per-stop", how->per_stop, "Levels per stop")->check(CLI::Range(1, 100));
}

void AddRigs(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchRigsOptions>();
  CLI::App& app = program.AddVerb(
      benches, "rigs", "Noise of C and radiance behind single and dual filters", [how, &program] {
        how->seed = program.common().seed.value_or(1);
        return Finish(BenchRigs(*how), CpuName(),
                      {"noise", "rig", "sigma_c", "spread_c", "spread_l", "c_ratio", "l_ratio"});
      });
  app.add_option("--grid-width", how->grid_width, "Filter positions along u")
      ->check(CLI::Range(3, 64));
  app.add_option("--grid-height", how->grid_height, "Filter positions along v")
      ->check(CLI::Range(3, 64));
}

void AddFilters(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchFiltersOptions>();
  how->lab = "data/labs/small.toml";
  how->plan = "data/plans/small.toml";
  CLI::App& app = program.AddVerb(
      benches, "filters", "Error of C from a print that errs, ideal filter assumed and as measured",
      [how, &program] {
        how->seed = program.common().seed.value_or(1);
        return InFolder(
            BenchFilters, *how,
            {"case", "rel_rmse", "rel_l2", "over_floor", "solve", "condition", "noise_gain"});
      });
  app.add_option("--lab", how->lab, "The lab.toml");
  app.add_option("--plan", how->plan, "The plan.toml");
  app.add_option("--folder", how->folder, "Scratch folder (default: a temporary one)");
  app.add_option("--registration", how->registration, "Shift of the print, spacings");
  app.add_option("--density", how->density, "Relative error of its transmittance");
  app.add_option("--pixels", how->pixels, "Side of the photographs of the filter")
      ->check(CLI::Range(64, 8192));
}

void AddStacks(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchStacksOptions>();
  CLI::App& app = program.AddVerb(
      benches, "stacks", "Response curves and merges of picture stacks beside other programs'",
      [how, &program] {
        how->seed = program.common().seed.value_or(1);
        return Stacks(*how);
      });
  app.add_option("--width", how->width, "Of the simulated stacks, pixels; 0: leave them out")
      ->check(CLI::Range(64, 16384) | CLI::Range(0, 0));
  app.add_option("--height", how->height, "The same")->check(CLI::Range(16, 16384));
  app.add_option("--frobisher", how->frobisher,
                 "A folder with the Frobisher stack and its expected curves (default: none)");
  app.add_option("--channels", how->channels, "Of that stack");
  app.add_option("--folder", how->folder, "Scratch folder (default: a temporary one)");
}

void AddConditioning(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchConditioningOptions>();
  CLI::App& app = program.AddVerb(
      benches, "conditioning", "Condition numbers of the solve beside predicted ones", [how] {
        return Finish(BenchConditioning(*how), CpuName(),
                      {"case", "filters", "condition", "predicted", "noise_gain", "c_error",
                       "from_prior", "answer"});
      });
  app.add_option("--filters", how->counts, "Filters per axis to try");
}

void AddKeep(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchKeepOptions>();
  CLI::App& app = program.AddVerb(
      benches, "keep", "What the solve keeps of lamps that no basis holds", [how, &program] {
        how->seed = program.common().seed.value_or(1);
        return Finish(
            BenchKeep(*how), CpuName(),
            {"basis", "cells", "lamp", "keep", "solve", "flux_error", "irradiance_error",
             "negative", "damage_undone", "damage_undone_low", "damage_undone_high", "wall_s"});
      });
  app.add_option("--bases", how->bases, "Bases to solve in");
  app.add_flag("--irradiance-metric", how->irradiance_metric,
               "C >= 0 nearest in irradiance, too: about a second a row");
  app.add_option("--cells", how->cells, "Interior cells of the grids")->check(CLI::Range(1, 64));
  app.add_option("--lamps", how->lamps, "Lamps by name (default: all)");
  app.add_option("--texels", how->texels, "Of a side of the lattice")->check(CLI::Range(4, 512));
  app.add_option("--receivers", how->receivers, "That are lit")->check(CLI::Range(1, 100000));
}

void AddBudget(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchBudgetOptions>();
  CLI::App& app = program.AddVerb(
      benches, "budget", "The error budget against many simulated labs, source by source",
      [how, &program] {
        how->seed = program.common().seed.value_or(1);
        return InFolder(BenchBudget, *how,
                        {"source", "quantity", "runs", "value", "predicted", "observed", "ratio",
                         "error", "share", "bias"});
      });
  app.add_option("--folder", how->folder, "Scratch folder (default: a temporary one)");
  app.add_option("--runs", how->runs, "Labs per source")->check(CLI::Range(2, 100000));
  app.add_option("--budgets", how->budgets, "Labs whose budgets make the prediction")
      ->check(CLI::Range(1, 1000));
  app.add_flag("--dual", how->dual, "A rig with pairs of dual filters instead of single ones");
  app.add_option("--source", how->sources, "Sources to judge (default: all, and totals)")
      ->default_str("");
}

void AddPlanBench(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchPlanOptions>();
  CLI::App& app = program.AddVerb(
      benches, "plan", "Plans for a target: errors and times of captures against predicted ones",
      [how, &program] {
        how->seed = program.common().seed.value_or(1);
        return InFolder(
            BenchPlan, *how,
            {"target", "sources", "family", "positions", "spacing_mm", "truncation", "noise",
             "predicted", "observed", "ratio", "ratio_se", "capture_s", "rig_s", "wall_s"});
      });
  app.add_option("--lab", how->lab, "The simulated lab");
  app.add_option("--plan", how->plan, "What the search leaves alone");
  app.add_option("--scene", how->scene, "Whose picture the errors are of");
  app.add_option("--target", how->targets, "Relative errors to plan for");
  app.add_option("--runs", how->runs, "Captures of each")->check(CLI::Range(1, 1000));
  app.add_option("--texels", how->texels, "As of plan")->check(CLI::Range(4, 1024));
  app.add_option("--receivers", how->receivers, "As of plan")->check(CLI::Range(10, 100000));
  app.add_option("--folder", how->folder, "Scratch folder (default: a temporary one)");
}

void AddTradeoff(cli::Program& program, CLI::App& benches) {
  auto folder = std::make_shared<std::filesystem::path>("out/tradeoff");
  const auto [app, how] = AddDeviceBench<BenchTradeoffOptions>(
      program, benches, "tradeoff", "Error against time for every estimator and knob",
      [folder](const auto& o) { return Tradeoff(o, *folder); });
  AddScenes(app, how.scenes);
  AddSize(app, how.width, how.height);
  AddSamples(app, how.samples_per_pixel);
  AddEstimators(app, how.estimators);
  AddReferenceSamples(app, how.reference_samples);
  app.add_option("--folder", *folder, "Where CSV and plots go");
}

void AddAccuracy(cli::Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<BenchAccuracyOptions>(
      program, benches, "accuracy",
      "Are errors asked for kept, and at which time against the best fixed setting",
      [&program](auto& o) {
        o.seed = program.common().seed.value_or(1);
        return Accuracy(o);
      });
  how.scenes = BenchTradeoffOptions{}.scenes;
  AddScenes(app, how.scenes);
  AddSize(app, how.width, how.height);
  AddReferenceSamples(app, how.reference_samples);
  app.add_option("--error", how.targets, "Relative errors to ask for without shadows");
  app.add_option("--shadowed-error", how.shadowed_targets, "The same with shadows");
  app.add_option("--seeds", how.seeds, "Runs of each, of different random numbers")
      ->check(CLI::Range(1, 1000));
}

void AddScale(cli::Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<BenchScaleOptions>(
      program, benches, "scale",
      "Time and memory against images, resolution, receivers and triangles",
      [](const auto& o) { return FinishOnDevice(BenchScale(o), o); });
  AddEstimators(app, how.estimators);
  app.add_option("--spp", how.samples_per_pixel, "Samples per pixel");
  app.add_option("--grid", how.grids, "Images along a side; each number makes a row")
      ->check(CLI::Range(1, 100));
  app.add_option("--size", how.sizes, "Texels along a side of an image")
      ->check(CLI::Range(1, 1 << 12));
  app.add_option("--megapixels", how.megapixels, "Receivers, millions")
      ->check(CLI::Range(0.01, 100.0));
  app.add_option("--triangles", how.triangles, "Triangles of a mesh of hills")
      ->check(CLI::Range(2, 100000000));
}

void AddEnvironment(cli::Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<BenchEnvironmentOptions>(
      program, benches, "environment",
      "Environment maps: densities, errors of ways to share out samples, speed", Environment);
  app.add_option("--map", how.maps,
                 "Radiance and OpenEXR pictures (default: a sun and sky of ours)")
      ->default_str("");
  app.add_option("--part", how.parts,
                 "What to run of maps, balance, speed and tables (default: all)")
      ->default_str("")
      ->check(CLI::IsMember({"maps", "balance", "speed", "tables"}));
  app.add_option("--sequence", how.sequence,
                 "Folder or list of frames to time, one after the other (luxfield sky --day)");
  app.add_option("--face-size", how.face_size, "Texels along each face of the cube maps");
  AddSize(app, how.width, how.height);
  AddSamples(app, how.samples_per_pixel);
  AddReferenceSamples(app, how.reference_samples);
  app.add_option("--seeds", how.seeds, "Pictures that errors are averaged over")
      ->check(CLI::Range(1, 1000));
  app.add_option("--repeats", how.repeats, "The least time counts, 0: nothing is timed")
      ->check(CLI::Range(0, 1000));
}

}  // namespace

void AddBench(cli::Program& program) {
  CLI::App& benches = program.AddGroup(kBenchVerb);
  AddBenchAll(program, benches);
  program.AddVerb(benches, "solve",
                  "The Gram solve against a memory copy, and the non-negative one", [] {
                    return Finish(BenchSolve({}), CpuName(),
                                  {"case", "wall_s", "gb_per_s", "copy_ratio", "iterations",
                                   "kkt_residual", "signed_error", "clamped_error", "error"});
                  });
  AddNearfield(program, benches);
  AddBenchStatedErrors(program, benches);
  AddSampling(program, benches);
  AddRays(program, benches);
  AddShadows(program, benches);
  AddSigned(program, benches);
  AddEnvironment(program, benches);
  AddBenchBalance(program, benches);
  AddBenchCapture(program, benches);
  AddBenchSpacing(program, benches);
  AddBenchClassical(program, benches);
  AddBenchLamps(program, benches);
  AddBenchPeers(program, benches);
  AddBenchMemory(program, benches);
  AddBenchPictures(program, benches);
  AddBenchRayFiles(program, benches);
  AddErrors(program, benches);
  AddBenchErrorRuns(program, benches);
  AddBudget(program, benches);
  AddFilters(program, benches);
  AddConditioning(program, benches);
  AddKeep(program, benches);
  AddStacks(program, benches);
  AddMergeBench(program, benches);
  AddExposures(program, benches);
  AddRigs(program, benches);
  AddPlanBench(program, benches);
  AddTradeoff(program, benches);
  AddDeviceBench<CalibrateOptions>(
      program, benches, "calibrate",
      "What estimators cost on a device, kept for render --error and --time", Calibrate);
  AddAccuracy(program, benches);
  AddScale(program, benches);
}

}  // namespace luxfield::bench
