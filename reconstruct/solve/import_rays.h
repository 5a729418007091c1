// Ray files -> light fields: rays are carried along their lines to both planes, binned through the
// basis, and solved.
//
//   E_ij(texel) = sum over rays through the texel of flux Phi_ij(u) / texel area,
//   C = G_u^-1 E G_v^-T                                              (docs/theory.md, section 4)
//
// which is the least-squares fit of the rays' flux density sum flux delta(u - u_k) delta(s - s_k),
// texel by texel. The fit keeps integrals against every function in the span of the basis. The
// constant is one only in the inner cells, so light that is not in the span loses or gains flux
// near the border (a point four cells from it: 0.8 %); each texel is therefore scaled to the flux
// of its rays, and rays that cross F outside the inner cells are left out and counted. sigma is the
// counting noise: var(C_ij) = sum of flux^2 times the squared dual basis function at u, over the
// texel's rays. Arithmetic per texel in double; C and sigma float32.
//
// Rays are not kept, but for blocks and a sample of them: the file is gone through once for its
// flux and directions, three times or a few more to choose planes, and once for each field, whose
// sums E_ij and, for sigma, of squares are kept. Results do not depend on the blocks.
//
// One pair of planes takes a beam; light in all directions takes a field per face of a cube, each
// with the rays that go nearest to its axis (ray_lines.h), so that every ray is in one field.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/formats/ray_file.h"
#include "luxfield/lightfield/posed_light_field.h"
#include "luxfield/reconstruct/solve/ray_fit.h"
#include "luxfield/reconstruct/solve/ray_planes.h"

namespace luxfield::reconstruct {

enum class RayDirections {
  // One field, of all rays within |dx|, |dy| <= 2 dz, if at most 1 % of the flux is no kBeam's and
  // at most 0.01 % beyond that; else kCube.
  kAuto,
  kBeam,  // one field, of the rays of the face +z: |dx|, |dy| <= dz
  kOne,   // one field, of all rays with dz > 0
  kCube,  // a field for each face that has flux
};

enum class RayFluxFrom {
  kAuto,  // the header's where it states one within a factor of 100 of the rays', else the rays'
  kHeader,
  kRays,
  kValue,
};

enum class RaySigns {
  kAuto,         // non-negative, unless a channel's flux is negative (colours outside Rec. 709)
  kSigned,       // the least-squares fit
  kNonNegative,  // projected on C >= 0, keeping every texel's flux (non_negative.h)
};

struct ImportRaysOptions {
  // x_in_luminaire = rotation * x_in_file + translation.
  lightfield::RigidPose luminaire_from_file;
  RayDirections directions = RayDirections::kAuto;
  // Given: one field of all rays with dz > 0, F is z = 0 of the posed frame; channels and unit are
  // the file's.
  std::optional<lightfield::LuminaireGeometry> geometry;
  // Else the planes are chosen for each field. One field's F is moved along z to filter_z_m.
  RayPlaneOptions planes;
  // absent: 1; 0.99 for kOne with rays beyond |dx|, |dy| <= 2 dz, which no window can hold
  std::optional<double> coverage;
  RayFluxFrom flux_from = RayFluxFrom::kAuto;
  double flux = 0;  // kValue: of all rays, in the file's unit
  RaySigns signs = RaySigns::kAuto;
  bool sigma = true;  // the counting noise too; without it the fit needs half the memory
  // Refused where the fits take more; 0 for no limit.
  std::uint64_t memory_bytes = 0;
};

struct RayFieldReport {
  std::string name;  // of the face
  RayTally missed_filter_plane, missed_image_plane, used;
  double fitted_flux = 0;      // of the light field: luminance (Y) where it has three channels
  double negative_energy = 0;  // of the least-squares fit: sum of |C < 0| over sum of C > 0
  bool non_negative = false;   // C was projected on C >= 0
  double filter_z_m = 0;       // where F lies in the face's frame
  double relative_window = 1;  // of F, over that of 99 % of the flux
};

struct RayImportReport {
  std::optional<double> header_flux;           // of the kind the rays carry
  double ray_flux = 0;                         // sum over all rays as stored
  RayFluxFrom flux_from = RayFluxFrom::kRays;  // what the flux is, never kAuto
  double scale = 1;                            // of the rays
  // Rays no field takes the direction of: `backward` dz <= 0, `beside` forward, beyond the beam.
  RayTally all, backward, beside, missed_filter_plane, missed_image_plane, used;
  double fitted_flux = 0;
  double negative_energy = 0;  // over all fields, as a field's
  double filter_z_m = 0;       // of the first field
  std::vector<RayFieldReport> fields;

  double lost_share() const { return all.flux > 0 ? 1 - used.flux / all.flux : 0; }
};

struct RayImport {
  // W or lm sr^-1 m^-4; 3 channels if every ray has tristimulus values, else 1. One field lies in
  // the luminaire's frame moved to F; those of a cube have poses in it.
  std::vector<lightfield::PosedLightField> coefficients;
  std::vector<lightfield::PosedLightField> sigma;  // counting noise of the fit, if asked for
  RayImportReport report;
};

// Gives `take` every ray of a file, in its order, each time it is called, and returns the file
// without its rays: formats::StreamRays of a path.
using RayStream = std::function<formats::RayFile(const formats::RayTaker& take)>;

// Throws InputError if an option makes no sense, no ray crosses both planes, or the number of rays
// is another than before.
//
//   const auto led = ImportRays(
//       [](const auto& take) { return formats::StreamRays("led.tm25ray", take); });
RayImport ImportRays(const RayStream& rays, const ImportRaysOptions& options = {});

// Of rays in memory.
RayImport ImportRays(const formats::RayFile& file, const ImportRaysOptions& options = {});

// What a user has to know: flux that is lost, rescaled or uncertain, fits of noise. Sentences.
std::vector<std::string> Warnings(const RayImport& result);

}  // namespace luxfield::reconstruct
