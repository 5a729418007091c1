// Ray files -> light field: rays are carried along their lines to both planes, binned through the
// basis, and solved.
//
//   E_ij(texel) = sum over rays through the texel of flux Phi_ij(u) / texel area,    C = G_u^-1 E
//   G_v^-T  (THEORY.md 4)
//
// which is the least-squares fit of the rays' flux density sum flux delta(u - u_k) delta(s - s_k),
// texel by texel. The fit keeps integrals against every function in the span of the basis. The
// constant is one only in the inner cells, so light that is not in the span loses or gains flux
// near the border (a point four cells from it: 0.8 %); each texel is therefore scaled to the flux
// of its rays, and rays that cross F outside the inner cells are left out and counted. sigma is the
// counting noise: var(C_ij) = sum of flux^2 times the squared dual basis function at u, over the
// texel's rays. Arithmetic per texel in double; C and sigma float32.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "lightfield/light_field.h"
#include "lightfield/ray_file.h"

namespace luxfield::reconstruct {

// x_in_luminaire = rotation * x_in_file + translation; metres.
struct LuminaireFromFile {
  std::array<double, 9> rotation{1, 0, 0, 0, 1,
                                 0, 0, 0, 1};  // row-major, orthonormal to 1e-6, right-handed
  lightfield::Vec3 translation_m;

  lightfield::Vec3 Point(lightfield::Vec3 p) const { return Direction(p) + translation_m; }
  lightfield::Vec3 Direction(lightfield::Vec3 d) const;
};

struct ImportRaysOptions {
  LuminaireFromFile luminaire_from_file;
  // The planes. Given: F is z = 0 of the posed frame, and channels and unit are taken from the
  // file. Absent: chosen from the rays (ChoosePlanes), which also moves F along z.
  std::optional<lightfield::LuminaireGeometry> geometry;

  // For the choice of planes:
  lightfield::Basis basis = lightfield::Basis::Make(lightfield::BasisKind::kBspline2);
  int grid_width = 11, grid_height = 9;
  int lattice_width = 128, lattice_height = 128;
  std::optional<double>
      filter_z_m;                 // z of F in the posed frame; absent: where the beam is narrowest
  std::optional<double> delta_m;  // absent: twice the light's extent on F, or 0.1 m for a point
  double coverage = 0.8;          // least share of the forward flux that both windows are to catch

  bool non_negative = false;  // project on C >= 0, keeping every texel's flux
};

struct ChosenPlanes {
  lightfield::LuminaireGeometry geometry;
  double filter_z_m = 0;
};

// Narrowest: the z that minimises the variance of the crossings, weighted by flux cos^4 so that
// grazing rays do not rule. The windows on F and I are flux quantiles per axis; the window on F
// fills the inner cells but for one cell on each side. Throws InputError if no ray goes forward or
// an option makes no sense.
ChosenPlanes ChoosePlanes(const lightfield::RayFile& file, const ImportRaysOptions& options);

struct RayTally {
  std::uint64_t rays = 0;
  double flux = 0;  // after scaling, in the file's unit
};

struct RayImportReport {
  std::optional<double> header_flux;  // of the kind the rays carry
  double ray_flux = 0;                // sum over all rays as stored
  double scale = 1;                   // header_flux / ray_flux; 1 where the header is silent
  RayTally all, backward, missed_filter_plane, missed_image_plane, used;
  double fitted_flux = 0;      // of the light field: luminance (Y) where it has three channels
  double negative_energy = 0;  // of the least-squares fit: sum of |C < 0| over sum of C > 0
  double filter_z_m = 0;       // where F lies in the posed frame
};

struct RayImport {
  lightfield::LightField
      coefficients;  // W or lm sr^-1 m^-4; 3 channels if every ray has tristimulus values, else 1
  lightfield::LightField sigma;  // counting noise of the least-squares fit
  RayImportReport report;
};

// Throws InputError as ChoosePlanes does, and if no ray crosses both windows.
RayImport ImportRays(const lightfield::RayFile& file, const ImportRaysOptions& options = {});

nlohmann::json ToJson(const RayImportReport& report);

}  // namespace luxfield::reconstruct
