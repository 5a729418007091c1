// How well the lamps of a scene were measured: X.sigma.lf.exr beside X.lf.exr, as `reconstruct --sigma`
// writes it.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "luxfield/photometry/lamp.h"
#include "luxfield/scene/scene.h"
#include "luxfield/view/lighting/lit_view.h"

namespace luxfield::view {

// The file of sigma(C) that belongs to a light field's.
std::filesystem::path SigmaBeside(const std::filesystem::path& light_field);

class MeasuredLamps {
 public:
  // Throws InputError for files of sigma that cannot be used.
  explicit MeasuredLamps(const scene::Scene& scene);

  // The relative standard uncertainty of the illuminance that lamps standing like that bring to a point
  // of the world which sees all of them, by the noise of the measurement (photometry/functional.h),
  //
  //   sqrt(sum_f u^2(sum_l s_l E_l)) / sum_l s_l E_l
  //
  // of lamps l of each file f, which share its noise;
  // empty where a lamp that lights it has no sigma or is coloured, where none does, and of scenes with
  // other lights.
  std::optional<double> RelativeSigma(lightfield::Vec3 p, lightfield::Vec3 normal,
                                      std::span<const scene::PlacedLamp> lamps) const;

 private:
  bool other_lights_;
  std::map<std::filesystem::path, photometry::Lamp> files_;  // those with sigma
  std::vector<const photometry::Lamp*> lamps_;               // in the scene's order; null: unknown
};

}  // namespace luxfield::view
