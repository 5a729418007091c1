// The file that `reconstruct --sigma` wrote, as the noise of a lamp.
#pragma once

#include <string>
#include <vector>

#include "luxfield/lightfield/posed_light_field.h"
#include "luxfield/photometry/lamp.h"

namespace luxfield::cli {

struct LampNoise {
  std::string file;  // empty: none was given
  std::vector<lightfield::PosedLightField> sigma;
  std::vector<photometry::SolveMaps> maps;  // one for each
  std::string uncertainty;                  // what standard uncertainties are made of, a sentence
};

// Throws InputError for a regularised solution, of which sigma does not tell all.
LampNoise ReadLampNoise(const std::string& file);

// Nothing where no file was given. Throws InputError where the geometries differ.
void SetNoise(photometry::Lamp& lamp, const LampNoise& noise);

}  // namespace luxfield::cli
