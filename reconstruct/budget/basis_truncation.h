// What the basis does not resolve of a lamp.
//
// A session cannot see it: E determines C, and nothing is left over. With a statement about the
// lamp (ErrorSizes::smallest_spot_m) it can tell what the filters leave open of lamps that look
// like this one (spot_posterior.h). Q(lamp) - Q(C) is a linear form of the lamp, per texel of I
// rho = q - X^T P^T w: what Q takes of the lamp less what it takes of its measurement. It has a
// mean, for filters and neighbours tell something of what the basis cannot hold, and a variance:
//
//   sigma^2 = (sum over texels of the means)^2 + (sum over texels of their standard deviations)^2
//
// since the lamp's details are the same ones for all texels. C itself is left as it is. Texels of I
// are pooled to at most 8 x 8, a ray has its own one. Lamps with finer or sharper structure than
// stated lose more.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/linear_functional.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/budget/spot_posterior.h"

namespace luxfield::reconstruct {

// What is asked of a lamp: the weights of any grid's coefficients.
struct LinearForm {
  std::function<lightfield::Weights(const lightfield::LuminaireGeometry&)> weights;
  // A ray's point on I: its texel alone counts, and weights are asked of a lattice of one texel,
  // on whose size they must not depend.
  std::optional<lightfield::Vec2> through_m;
};
struct Term {
  double factor = 1;
  LinearForm form;
};

struct TruncationOptions {
  double smallest_spot_m = 0;  // > 0
  double relative_noise = 0;   // of what a filter sees, besides the photons'
  // Whose `sigma` is the noise of what the filters saw; null: there is none.
  const lightfield::Measurements* measurements = nullptr;
};

class BasisTruncation {
 public:
  // Three channels are their luminance. `field` must outlive this. Throws InputError naming
  // smallest_spot_m where there are more than 1000 filters or more than 400 spots along an axis.
  BasisTruncation(const lightfield::LightField& field, lightfield::FilterKind filter,
                  const TruncationOptions& options);
  BasisTruncation(const BasisTruncation&) = delete;
  BasisTruncation& operator=(const BasisTruncation&) = delete;

  // Of the sum of the terms.
  double Sigma(const std::vector<Term>& terms) const;

 private:
  // Texels [row0, row1) x [column0, column1) of the lattice, taken together.
  struct Texels {
    int row0, row1, column0, column1;
  };
  struct Form {  // on a lattice of one or more texels, of the fine functions and of the field's own
    lightfield::Weights fine, own;
  };
  std::optional<SpotPosterior> Posterior(const Texels& texels) const;
  lightfield::LuminaireGeometry Fine(const lightfield::Lattice& lattice) const;
  lightfield::LuminaireGeometry Own(const lightfield::Lattice& lattice) const;
  Moments MomentsOf(const SpotPosterior& posterior, const Form& form, std::size_t texel,
                    std::size_t texels) const;

  const lightfield::LightField& field_;
  TruncationOptions options_;
  int finer_;
  SpotAxis u_, v_;
  lightfield::Lattice pooled_;
  std::vector<std::optional<SpotPosterior>> posteriors_;  // of its texels; none where all is dark
};

}  // namespace luxfield::reconstruct
