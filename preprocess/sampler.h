// Drawing directions towards a measured luminaire on the host, in double precision: what a light of
// another renderer (a plugin of pbrt, Mitsuba, Blender ...) asks for.
//
// A receiver is a point p, metres in the luminaire's frame, in front of F (p.z > 0), and a unit
// normal n; luminaire_from_world takes points of the world into that frame. A direction w
// (unit, towards the lamp: w.z < 0) meets F at u and I at s:
//
//   u = p - (p.z / w.z) w,   s = tau p + (1 - tau) u,   tau = delta / p.z   (x and y of each)
//
// Sample draws one of the knot cells on F and u inside it (docs/theory.md 6, correction 3):
//
//   cell c      with probability P_c = w_c M_c / sum w M,
//               M_c = integral over the cell of Q_c(s(u)) du,   w_c = (n.(u_c - p))+, at least a
//               quarter of its largest value in the cell, 0 for cells below the horizon
//   u in it     with density Q_c(s(u)) / M_c per area,
//   so that     pdf(w) = sum_c P_c Q_c(s(u)) / M_c  r^3 / p.z   sr^-1,   r = |u - p|
//
// with Q_c of cell_tables.h. The weight L (n.w)+ / pdf of a sample is bounded by 4 q times its mean
// over all cells, q <= 1, 4, 9, 9 for box, bilinear, quadratic, bspline2. Coefficients may have any
// sign: a density cannot, and the weight then takes the sign of L.
//
//   preprocess::LightFieldSampler sampler(lightfield::ReadLightField("lamp.lf.exr"));
//   const preprocess::ReceiverSampler lamp = sampler.At({p, n});     // once per shading point
//   if (const auto sample = lamp.Sample({random(), random()}))
//     for (int c = 0; c < 3; ++c)
//       radiance[c] += brdf[c] * visibility * sample->weight[c];       // weight = L (n.w)+ / pdf
//   const double pdf = lamp.Pdf(w);                                    // for MIS with other samples
//
// Cost: a sampler holds (W + n - 1)(H + n - 1) tables of 8 bytes a texel beside the light field; At
// reads four entries of each, Sample two binary searches. All methods are const and may be called
// from any number of threads.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/preprocess/cell_tables.h"
#include "luxfield/preprocess/light_vector_volume.h"

namespace luxfield::preprocess {

struct LightSample {
  lightfield::Vec2 u, s;             // on F and on I, metres, luminaire frame
  lightfield::Vec3 direction;        // unit, from the receiver to u
  double distance_m = 0;             // |u - p|; I lies at |p.z - delta| / p.z of it from p
  std::array<double, 3> radiance{};  // L(u -> s); one channel is repeated into all three
  double pdf = 0;                    // sr^-1, above 0
  std::array<double, 3> weight{};    // L (n.w)+ / pdf: an unbiased estimate of the irradiance
};

class LightFieldSampler;

// The lamp seen from one receiver. The sampler must outlive it.
class ReceiverSampler {
 public:
  // xi in [0, 1)^2. None where no light can reach the receiver: p.z <= 0, all of F below the
  // horizon, or only dark texels in sight. A sample below the horizon of a cell that it cuts is
  // returned with weight 0.
  std::optional<LightSample> Sample(lightfield::Vec2 xi) const;

  // The density with which Sample draws w (unit, from the receiver to the lamp), sr^-1; 0 where it
  // does not. Over all directions it integrates to 1, unless Sample returns none.
  double Pdf(lightfield::Vec3 direction) const;

  // L that arrives from direction w; 0 from elsewhere than the lamp.
  std::array<double, 3> Radiance(lightfield::Vec3 direction) const;

  // The irradiance in closed form (light_vector.h), without sampling and shadows.
  std::array<double, 3> Irradiance() const;

 private:
  friend class LightFieldSampler;

  // A cell's window on I in columns and rows of the lattice, (x, y)(f) = origin + f * size for the
  // fraction f of the way through the cell; sizes are negative between the planes.
  struct Window {
    double x = 0, y = 0, width = 0, height = 0;
  };

  ReceiverSampler(const LightFieldSampler& sampler, const Receiver& receiver);
  Window WindowOf(int a, int b) const;
  double CellWeight(int a, int b) const;
  double DensityOverMass(int cell, lightfield::Vec2 fraction, const Window& window,
                         double mass) const;

  const LightFieldSampler* sampler_;
  Receiver receiver_;
  double tau_ = 0;
  // Of each cell: M_c / h^2, and the sum of w M up to and with it over that of all.
  std::vector<double> mass_, cumulative_;
};

class LightFieldSampler {
 public:
  // Builds the cell tables. `name` is for messages; InputError as BuildCellTables and
  // LuminaireGeometry::Validate.
  explicit LightFieldSampler(lightfield::LightField field, const std::string& name = "light field");

  // `receiver.n` must be a unit vector; p in front of F (others see nothing).
  ReceiverSampler At(const Receiver& receiver) const { return {*this, receiver}; }

  const lightfield::LightField& field() const { return field_; }
  const CellTables& tables() const { return tables_; }

 private:
  lightfield::LightField field_;
  CellTables tables_;
};

}  // namespace luxfield::preprocess
