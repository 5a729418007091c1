// *.filter.exr, to the byte in docs/formats/filter.md.
#include "luxfield/lightfield/measured_filter.h"

#include <fmt/format.h>

#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/range.h"
#include "luxfield/core/warning.h"
#include "luxfield/lightfield/exr_geometry.h"

namespace luxfield::lightfield {
namespace {

constexpr int kVersion = 3, kMaxTexelsPerAxis = 16384;
constexpr const char* kRemedy = "make the file anew with `luxfield filter measure`";

std::vector<std::string> PartNames(FilterKind filter) {
  if (filter == FilterKind::kDual) return {"T.plus", "T.minus"};
  return {"T"};
}

void RequireNumber(const std::string& file, const char* field, double value, bool in_range,
                   const char* range) {
  if (!(core::Range{}.Holds(value) && in_range))
    throw InputError(file, fmt::format("{} = {} must be {}", field, value, range), kRemedy);
}

}  // namespace

std::vector<double> MeasuredFilter::factors() const {
  if (filter == FilterKind::kBasis) return {1 / filter_scale};
  const auto peaks = basis.DualPeaks();
  return {peaks[0], -peaks[1]};
}

void MeasuredFilter::Validate(const std::string& file) const {
  const auto positive = [&](const char* field, double value) {
    RequireNumber(file, field, value, value > 0, "above 0");
  };
  positive("luxfield:spacing_m", spacing_m);
  positive("luxfield:filter_scale", filter_scale);
  positive("luxfield:dx_m", lattice.ds_m);
  positive("luxfield:dy_m", lattice.dt_m);
  positive("luxfield:sum_sigma_ratio", sum_sigma_ratio);
  const auto finite = [&](const char* field, double value) {
    RequireNumber(file, field, value, true, "finite");
  };
  core::SuspectLength(file, "luxfield:spacing_m", spacing_m, 1);
  core::SuspectLength(file, "luxfield:dx_m", lattice.ds_m, 0.5);
  core::SuspectLength(file, "luxfield:dy_m", lattice.dt_m, 0.5);
  finite("luxfield:x0_m", lattice.s0_m);
  finite("luxfield:y1_m", lattice.t1_m);
  finite("luxfield:shift_x_m", shift_m.x);
  finite("luxfield:shift_y_m", shift_m.y);
  finite("luxfield:rotation_rad", rotation_rad);
  for (const auto& [field, value] : {std::pair{"luxfield:shift_sigma_m", shift_sigma_m},
                                     std::pair{"luxfield:rotation_sigma_rad", rotation_sigma_rad},
                                     std::pair{"luxfield:position_sigma_m", position_sigma_m},
                                     std::pair{"luxfield:stretch_sigma", stretch_sigma},
                                     std::pair{"luxfield:level_sigma", level_sigma}})
    RequireNumber(file, field, value, value >= 0, "at least 0");
  // Whoever takes it back does so to second order.
  RequireNumber(file, "luxfield:blur_m", blur_m, blur_m >= 0 && blur_m <= spacing_m / 8,
                "0 to an eighth of spacing_m");
  for (const int size : {lattice.width, lattice.height})
    if (size < 1 || size > kMaxTexelsPerAxis)
      throw InputError(
          file, fmt::format("has {} texels along an axis, not 1 to {}", size, kMaxTexelsPerAxis),
          kRemedy);
  if (filter == FilterKind::kDual) basis.DualValue(0);  // refuses a basis without dual filters
}

void WriteMeasuredFilter(const std::filesystem::path& path, const MeasuredFilter& filter) {
  filter.Validate(path.string());
  const auto names = PartNames(filter.filter);
  const auto texels = static_cast<std::size_t>(filter.lattice.width) * filter.lattice.height;
  if (filter.prints.size() != names.size())
    throw std::logic_error("measured filter: wrong number of prints");
  std::vector<core::ExrPartView> parts;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const MeasuredPrint& print = filter.prints[k];
    if (print.transmittance.size() != texels || print.sigma.size() != texels)
      throw std::logic_error("measured filter: a print does not have the lattice's size");
    parts.push_back({names[k],
                     filter.lattice.width,
                     filter.lattice.height,
                     {{"T", std::span(print.transmittance)}, {"sigma", std::span(print.sigma)}},
                     {}});
  }
  parts.front().attributes = {
      {"luxfield:kind", std::string("filter")},
      {"luxfield:version", kVersion},
      {"luxfield:filter", std::string(filter.filter == FilterKind::kDual ? "dual" : "basis")},
      {"luxfield:spacing_m", filter.spacing_m},
      {"luxfield:filter_scale", filter.filter_scale},
      {"luxfield:x0_m", filter.lattice.s0_m},
      {"luxfield:y1_m", filter.lattice.t1_m},
      {"luxfield:dx_m", filter.lattice.ds_m},
      {"luxfield:dy_m", filter.lattice.dt_m},
      {"luxfield:shift_x_m", filter.shift_m.x},
      {"luxfield:shift_y_m", filter.shift_m.y},
      {"luxfield:rotation_rad", filter.rotation_rad},
      {"luxfield:shift_sigma_m", filter.shift_sigma_m},
      {"luxfield:rotation_sigma_rad", filter.rotation_sigma_rad},
      {"luxfield:position_sigma_m", filter.position_sigma_m},
      {"luxfield:stretch_sigma", filter.stretch_sigma},
      {"luxfield:level_sigma", filter.level_sigma},
      {"luxfield:blur_m", filter.blur_m},
      {"luxfield:sum_sigma_ratio", filter.sum_sigma_ratio},
  };
  parts.front().attributes.merge(BasisAttributes(filter.basis));
  parts.front().attributes.merge(ProvenanceAttributes(filter.provenance));
  core::WriteExr(path, parts, core::ExrCompression::kZip);
}

MeasuredFilter ReadMeasuredFilter(const std::filesystem::path& path) {
  core::ExrReader reader(path);
  const std::string file = path.string();
  int first = reader.find_part("T");
  if (first < 0) first = reader.find_part("T.plus");
  if (first < 0)
    throw InputError(file, "has no part 'T' or 'T.plus', so it is no filter file",
                     "check that this is the kind of file the verb expects");
  if (const std::string kind = reader.GetString(first, "luxfield:kind"); kind != "filter")
    throw InputError(file, fmt::format("luxfield:kind = '{}' is not 'filter'", kind),
                     "check that this is the kind of file the verb expects");
  if (const int version = reader.GetInt(first, "luxfield:version"); version != kVersion)
    throw InputError(file,
                     fmt::format("luxfield:version = {} where {} is understood", version, kVersion),
                     "read it with the luxfield that wrote it");
  MeasuredFilter filter;
  const std::string kind = reader.GetString(first, "luxfield:filter");
  if (kind != "basis" && kind != "dual")
    throw InputError(file, fmt::format("luxfield:filter = '{}' is neither basis nor dual", kind),
                     kRemedy);
  filter.filter = kind == "dual" ? FilterKind::kDual : FilterKind::kBasis;
  filter.basis = ReadBasis(reader, first);
  const auto number = [&](const char* name) { return reader.GetDouble(first, name); };
  filter.spacing_m = number("luxfield:spacing_m");
  filter.filter_scale = number("luxfield:filter_scale");
  filter.lattice = {reader.parts()[first].width, reader.parts()[first].height,
                    number("luxfield:x0_m"),     number("luxfield:y1_m"),
                    number("luxfield:dx_m"),     number("luxfield:dy_m")};
  filter.shift_m = {number("luxfield:shift_x_m"), number("luxfield:shift_y_m")};
  filter.rotation_rad = number("luxfield:rotation_rad");
  filter.shift_sigma_m = number("luxfield:shift_sigma_m");
  filter.rotation_sigma_rad = number("luxfield:rotation_sigma_rad");
  filter.position_sigma_m = number("luxfield:position_sigma_m");
  filter.stretch_sigma = number("luxfield:stretch_sigma");
  filter.level_sigma = number("luxfield:level_sigma");
  filter.blur_m = number("luxfield:blur_m");
  filter.sum_sigma_ratio = number("luxfield:sum_sigma_ratio");
  filter.provenance = ReadProvenance(reader, first);
  filter.Validate(file);

  const auto names = PartNames(filter.filter);
  if (reader.parts().size() != names.size())
    throw InputError(file, fmt::format("has {} parts, not {}", reader.parts().size(), names.size()),
                     kRemedy);
  for (const std::string& name : names) {
    const int part = reader.find_part(name);
    if (part < 0) throw InputError(file, fmt::format("part '{}' is missing", name), kRemedy);
    if (reader.parts()[part].width != filter.lattice.width ||
        reader.parts()[part].height != filter.lattice.height)
      throw InputError(file, fmt::format("part '{}' differs in size from the first", name),
                       kRemedy);
    MeasuredPrint print{reader.ReadFloat(part, "T"), reader.ReadFloat(part, "sigma")};
    RequireFinite(reader, name, "T", print.transmittance);
    RequireFinite(reader, name, "sigma", print.sigma, false);
    for (const float t : print.transmittance)
      if (t < -1 || t > 2)
        throw InputError(file, fmt::format("part '{}' holds the transmittance {}", name, t),
                         "photograph the filter and the light without it with the same exposures");
    filter.prints.push_back(std::move(print));
  }
  return filter;
}

}  // namespace luxfield::lightfield
