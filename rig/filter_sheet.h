// The sheet that a filter is printed on, and the holder it is mounted in (docs/formats/filter.md,
// "Sheets"). Coordinates are metres about the filter's axis, x along u, y along v.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/lightfield/basis.h"
#include "luxfield/lightfield/geometry.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::rig {

struct RegistrationMark {
  lightfield::Vec2 centre_m;
  double radius_m = 0;
};

// A step of the wedge: printed with this code as it is, past any tone table.
struct WedgeStep {
  lightfield::Vec2 low_m, high_m;
  double code = 0;  // share of full scale
};

// What a printer makes of its codes: density over code, from a measured wedge. Linear in (-log10
// code, density) between the entries and along the last two beyond them.
struct ToneTable {
  // Falling codes from 1 on, strictly rising densities; empty: the printed transmittance is the
  // code.
  std::vector<double> code, density;

  // The code that prints this transmittance relative to clear film (code 1); 0 for 0.
  double Code(double transmittance) const;
  // Density of clear film.
  double clear_density() const { return density.empty() ? 0 : density.front(); }
};

// [tone] of a *.tone.toml. Throws InputError naming file and field.
ToneTable ReadToneTable(const std::filesystem::path& path);
void WriteToneTable(const std::filesystem::path& path, const ToneTable& table);

inline constexpr char kFilterSheetFormat[] = "luxfield filter sheet";  // "format" of the JSON

struct FilterSheet {
  lightfield::FilterKind filter = lightfield::FilterKind::kBasis;
  lightfield::Basis basis;
  double spacing_m = 0;
  double filter_scale = 1;
  double half_m = 0;  // half the sheet's side; it fills the holder's window
  std::vector<RegistrationMark>
      marks;                     // clear discs of the print: one per corner, one more top left
  std::vector<WedgeStep> wedge;  // 21 steps of 0.15 in density under the identity
  std::vector<RegistrationMark> holder_marks;  // holes of the opaque holder, outside the sheet

  // With S = n h the support: half_m = 0.7 S, marks of radius S / 50 at (+-0.58 S, +-0.58 S),
  // holder marks at 0.8 S: corners and middles of the sides. Throws InputError for a scale outside
  // (0, 1 / peak], a dual pair of a basis that has none, or a spacing that is not above 0.
  static FilterSheet Make(lightfield::FilterKind filter, const lightfield::Basis& basis,
                          double spacing_m, double filter_scale);

  int prints() const { return filter == lightfield::FilterKind::kDual ? 2 : 1; }
  // What the filter itself is to let through: filter_scale * Phi, or max(+-Phi*, 0) / peak for
  // print 0 (plus) and 1 (minus).
  double FilterTransmittance(lightfield::Vec2 offset_m, int print) const;
  // The whole sheet: filter, marks, and the wedge with its codes as transmittances; opaque between.
  double Transmittance(lightfield::Vec2 offset_m, int print) const;
  // The step that covers the offset; null: none.
  const WedgeStep* StepAt(lightfield::Vec2 offset_m) const;

 private:
  std::array<double, 2> peaks_{1, 1};
};

// *.sheet.json.
void WriteFilterSheet(const std::filesystem::path& path, const FilterSheet& sheet);
FilterSheet ReadFilterSheet(const std::filesystem::path& path);
FilterSheet ParseFilterSheet(const std::string& text, const std::string& file);
std::string SheetText(const FilterSheet& sheet);  // the same JSON on one line

}  // namespace luxfield::rig
