// The luminaire as data: coefficient images C_ij on I and the basis Phi_ij on F (docs/theory.md 2).
//
//   L(u->s) = delta^2 / cos^4(theta) * sum_ij C_ij(s) Phi_ij(u)      W sr^-1 m^-2
//
// C_ij (W sr^-1 m^-4) is constant over a texel. E(u->s) = sum C_ij(s) Phi_ij(u) is a flux density:
// d^4 Phi = E du ds.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/basis.h"
#include "luxfield/lightfield/geometry.h"

namespace luxfield::lightfield {

enum class FluxUnit { kWatt, kLumen, kRelative };
std::string FluxUnitName(FluxUnit unit);  // "W", "lm", "relative"
FluxUnit FluxUnitFromName(const std::string& name);

// What plane F and I, the basis and the lattice are: shared by measurements, light fields and
// tables.
struct LuminaireGeometry {
  double delta_m = 0;  // distance from F to I, > 0
  BasisGrid grid;
  Lattice lattice;
  int channels = 1;  // 1: luminance ("Y"); 3: linear Rec. 709 ("R", "G", "B")
  FluxUnit unit = FluxUnit::kRelative;

  std::size_t plane_size() const {
    return static_cast<std::size_t>(lattice.width) * lattice.height;
  }
  std::size_t value_count() const { return plane_size() * channels * grid.count(); }
  // Throws InputError naming `file` and the field if a value makes no sense (sizes, spacings,
  // non-finite ...), and warns on stderr of lengths that no lamp has (core/warning.h).
  void Validate(const std::string& file) const;
  bool operator==(const LuminaireGeometry&) const = default;
};

// Where a derived file came from: option and input names to values (hashes, versions). No clock
// time.
using Provenance = std::map<std::string, std::string>;

struct LightField {
  LuminaireGeometry geometry;
  Provenance provenance;
  // data[((m * channels + channel) * height + row) * width + column], m = j * W + i
  std::vector<float> data;

  LightField() = default;
  explicit LightField(const LuminaireGeometry& g) : geometry(g), data(g.value_count(), 0.0f) {}

  std::span<float> image(int m, int channel) {
    return std::span(data).subspan(
        (static_cast<std::size_t>(m) * geometry.channels + channel) * geometry.plane_size(),
        geometry.plane_size());
  }
  std::span<const float> image(int m, int channel) const {
    return std::span(data).subspan(
        (static_cast<std::size_t>(m) * geometry.channels + channel) * geometry.plane_size(),
        geometry.plane_size());
  }
};

// L(u->s), one value per channel (1 channel is repeated into all three); 0 outside the lattice or
// the supports.
std::array<double, 3> Radiance(const LightField& field, Vec2 u, Vec2 s);

// E_ij's analogue without filter: E(u->s) = sum C Phi, the flux density per du ds.
std::array<double, 3> FluxDensity(const LightField& field, Vec2 u, Vec2 s);

// Total flux per channel: sum_ij (integral C_ij)(integral Phi_ij), in the field's unit.
std::array<double, 3> TotalFlux(const LightField& field);

// Far-field intensity per channel, unit sr^-1, in the direction (need not be normalised; z <= 0
// gives 0; docs/theory.md 2):
//
//   I = delta^2 / cos^3 * integral_F sum C(s) Phi(u) du,   s = u + delta dir_xy / dir_z
//
// Exact for piecewise constant C: the integrand is piecewise polynomial between the texel edges and
// knots.
std::array<double, 3> FarFieldIntensity(const LightField& field, Vec3 direction);

// *.lf.exr: one part per basis function named "C.JJ.II" (docs/formats/light-field.md). Reading
// throws InputError for missing, truncated, wrong-type, NaN-laden or inconsistent files.
void WriteLightField(const std::filesystem::path& path, const LightField& field);
LightField ReadLightField(const std::filesystem::path& path);

// Some rows of a light field of geometry `whole`: `rows` has these rows as its lattice. A file whose
// attributes are the whole's and whose images have these rows alone; images of files of all rows, one
// below the other, are those of the whole. It is no light field that ReadLightField takes.
void WriteLightFieldRows(const std::filesystem::path& path, const LuminaireGeometry& whole,
                         const LightField& rows);

}  // namespace luxfield::lightfield
