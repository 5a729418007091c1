// A small lab for Monte-Carlo runs of the error budget: 3 x 3 filters, 32 x 32 pixels, a lamp that
// is smooth and lies in the span of the basis, every error source with its size, large enough to
// be seen alone and small enough to be of first order. Its filters are `bspline2`, or dual pairs of
// `quadratic` (a = 1/2).
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/planning/lab_variant.h"
#include "luxfield/reconstruct/budget/budget_settings.h"

namespace luxfield::bench {

// Of the exposures of a bracket: one or two that dark places need, or up to four, which share
// enough pixels to find their times from.
enum class Ladder { kShort, kLong };

// Writes lab.toml, plan.toml and the lamp into `folder`.
void WriteBudgetLab(const std::filesystem::path& folder, bool dual, Ladder ladder = Ladder::kShort);
// The same with filters x filters and without the lamp, lamp.lf.exr, which is to have the geometry
// that is returned, or a finer grid: its texels begin and end where those of plan and camera do.
lightfield::LuminaireGeometry WriteBudgetLab(const std::filesystem::path& folder, bool dual,
                                             int filters, Ladder ladder = Ladder::kShort);

// What a budget of that lab is asked: a bright and a dim ray, two receivers, and the flux.
void AskOfBudgetLab(reconstruct::BudgetSettings* settings);

// The quantities by the closed forms, in the order of the budget.
std::vector<double> QuantitiesOf(const lightfield::LightField& field,
                                 const reconstruct::BudgetSettings& asked);

// A row of `bench budget` (bench_budget.h).
nlohmann::json BudgetRow(const std::string& source, const std::string& quantity, int runs,
                         double value, double predicted, double observed);

// The sizes that the [errors.*] of a lab file state, as standard deviations over many labs: what is
// a fixed error of one lab (registration, density, stray light, the lamp's wander) is taken as one
// draw.
reconstruct::ErrorSizes SizesOfLab(const std::filesystem::path& lab);

// Of image_from_sensor; a lab file cannot state what the lab does not know.
constexpr double kImageShift_m = 3e-4;

// The geometry's calibration that run `run` is merged with: the truth, off by an image shift and by
// errors of its parameters, normal with the covariance that the file states (neighbours correlate
// by 0.48).
void WriteGeometryOfRun(const std::filesystem::path& file, const reconstruct::ErrorSizes& sizes,
                        const std::string& source, std::uint64_t seed, int run);

constexpr const char *kTotal = "total", *kScaledTotal = "total, scaled by the meter";

// Sources as the budget has them and what to switch on for each.
struct BudgetCase {
  std::string name;                  // as ErrorSourceName, or one of the totals
  std::vector<std::string> enabled;  // [errors.*] tables
  bool scaled = false;               // by the light meter
  // Deviations are not from the lab without errors but from the same session, with all its errors,
  // without this one: images registered beside their place carry noise and pattern of other pixels,
  // and estimated exposure times that of the pixels they come from.
  bool beside_others = false;
  bool estimated = false;  // exposure times are estimated from the frames

  // Of the row.
  std::string Label() const { return name + (estimated ? ", exposures estimated" : ""); }
};
std::vector<BudgetCase> BudgetCases();
// Whose errors the lab of a case has: its own name, or kTotal. Cases of one are captured alike.
std::string LabOf(const BudgetCase& what);

// All [errors.*] tables of the lab.
std::vector<std::string> AllErrors();

// Three readings of a meter: of the given irradiances without errors, or as drawn for a run (their
// own errors independent, the calibration's common), both normal.
reconstruct::Meter MeterOfBudgetLab();
void ReadMeter(reconstruct::Meter* meter, const std::vector<double>& irradiance, std::uint64_t seed,
               int run);

// The errors of run `run`: fixed errors drawn from their sizes, those of `source` alone (totals:
// all). Normal; stray light is the absolute value of one; the wander a sine of Rayleigh amplitude
// and even phase.
std::vector<planning::LabNumbers> DrawErrors(const reconstruct::ErrorSizes& sizes,
                                             const std::string& source, std::uint64_t seed,
                                             int run);

}  // namespace luxfield::bench
