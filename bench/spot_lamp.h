// Random lamps that no basis holds: sums of Gaussian spots on F.
#pragma once

#include <cstdint>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::bench {

struct SpotLampOptions {
  double smallest_m = 0, largest_m = 0;  // standard deviations, every size as likely as its double
  double reach_m = 0;                    // centres lie within +- reach_m
  double beam_m = 0;                     // standard deviation of a spot's strength over I
};

// 4 to 8 spots, each as strong as any and with a beam of its own over I. `geometry` has the grid of
// filters for which the lamp is meant; the lamp's own has four functions of `bspline2` a spacing
// that fill the same supports.
lightfield::LightField SpotLamp(lightfield::LuminaireGeometry geometry,
                                const SpotLampOptions& options, std::uint64_t seed, int number);

}  // namespace luxfield::bench
