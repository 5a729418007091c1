// A light field by columns of its basis functions, of which it is the sum:
//
//   E(u->s) = sum_i E_i(u->s),   E_i(u->s) = sum_j C_ij(s) Phi_ij(u)
//
// so that whatever is linear in light, as irradiance is, can be summed over groups of columns, of
// which one is in memory at a time.
//
//   LightFieldFile file("lamp.lf.exr");
//   FieldColumns(file, 0, 4).ForEachGroup([&](const LightField& group, int first_column) {
//     irradiance += ExactIrradiance(group, p, n)[0];
//   });
#pragma once

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::lightfield {

class LightFieldFile;  // light_field_file.h

// Columns first .. first + count - 1 of a light field, as a light field of their own.
struct ColumnGroup {
  int first = 0, count = 0;

  LuminaireGeometry GeometryIn(const LuminaireGeometry& whole) const;
  // Number in `whole` of the group's image m.
  int ImageIn(const LuminaireGeometry& whole, int m) const;
};

// All columns, at most `at_once` a group, from the first on.
std::vector<ColumnGroup> GroupsOf(const LuminaireGeometry& whole, int at_once);

// The groups of a field, one after the other.
class FieldColumns {
 public:
  // Called with each group and the number of its first column in the whole, which rises.
  using Visitor = std::function<void(const LightField& group, int first)>;
  using Source = std::function<void(const Visitor& visit)>;

  // All of a light field, which must outlive this, as one group.
  FieldColumns(const LightField& field)  // NOLINT(google-explicit-constructor): a field has columns
      : geometry_(field.geometry), source_([&field](const Visitor& visit) { visit(field, 0); }) {}
  // `at_once` columns a group of field number `field` of a file, which must outlive this. Reading
  // throws what LightFieldFile::ReadImage throws.
  FieldColumns(LightFieldFile& file, std::size_t field, int at_once);
  // Whatever gives all columns of a field of that geometry, each time anew.
  FieldColumns(const LuminaireGeometry& geometry, Source source)
      : geometry_(geometry), source_(std::move(source)) {}

  const LuminaireGeometry& geometry() const { return geometry_; }  // of the whole
  void ForEachGroup(const Visitor& visit) const { source_(visit); }

 private:
  LuminaireGeometry geometry_;
  Source source_;
};

}  // namespace luxfield::lightfield
