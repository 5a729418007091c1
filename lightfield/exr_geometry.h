// The geometry and provenance attributes that *.lf.exr, *.meas.exr and *.filter.exr share
// (docs/formats/light-field.md). Internal to lightfield/.
#pragma once

#include <span>
#include <string>

#include "luxfield/core/exr.h"
#include "luxfield/lightfield/light_field.h"

namespace luxfield::lightfield {

// What distinguishes the kinds of file.
struct ExrKind {
  const char* name;         // luxfield:kind
  const char* part_prefix;  // parts are PREFIX.JJ.II
  const char* channel_prefix;
  bool alone = true;  // the file holds no other parts
};
inline constexpr ExrKind kLightFieldKind{"light-field", "C", ""};
inline constexpr ExrKind kMeasurementsKind{"measurements", "E", "E."};

std::string PartName(const ExrKind& kind, int i, int j);  // "C.JJ.II"
// "Y" or "R", "G", "B".
std::span<const std::string> ChannelNames(int channels);

// Shared with *.filter.exr: the basis, and provenance.
core::ExrAttributes BasisAttributes(const Basis& basis);
Basis ReadBasis(const core::ExrReader& reader, int part);
core::ExrAttributes ProvenanceAttributes(const Provenance& provenance);
Provenance ReadProvenance(const core::ExrReader& reader, int part);

// Attributes of the first part; basis functions elsewhere are known by their part's name.
core::ExrAttributes GeometryAttributes(const ExrKind& kind, const LuminaireGeometry& geometry,
                                       const Provenance& provenance);

struct ExrGeometry {
  LuminaireGeometry geometry;
  Provenance provenance;
  std::vector<int> parts;  // part number of m = j * W + i
};

// Reads and validates everything but pixels: kind, version, geometry, one part of equal size per
// basis function, and that a file of this length can hold so many values at all.
ExrGeometry ReadGeometry(const core::ExrReader& reader, const ExrKind& kind);

// InputError naming file, part and channel if a value is NaN or infinite (or negative, where that
// makes no sense).
void RequireFinite(const core::ExrReader& reader, const std::string& part,
                   const std::string& channel, std::span<const float> values,
                   bool allow_negative = true);

}  // namespace luxfield::lightfield
