// Model only what a scene requires: a smaller light field that lights a scene's receivers within an
// error.
//
// A reduced light field is a light field like any other; nothing behind this stage knows that it
// was reduced. In this order, each step with the coarsest setting whose error the target allows:
//
//   crop     texels that no receiver sees through any support, and rows and columns of images
//            without light, go: no error
//   merge    groups of neighbouring images become one. Seen at the depth tau* of the median
//            receiver (tau = delta / z), image m under the support centred on c_m is image C_m
//            shifted by (1 - tau*)(c_m - c_I) under the support centred on c_I:
//                C'_I(s) = sum_m w_Im k C_m(s + (1 - tau*)(c_m - c_I)),
//            w_Im linear between the coarse centres (flux and first moment are kept), k the ratio
//            of integral Phi_m over integral Phi_I. A scene far away needs one image: its far
//            field.
//   pool     k x k texels become their mean; flux is kept
//   drop     images that matter least become all zero
//   round    the mantissa keeps as many bits as needed, so that files compress
//
// The error is the relative RMSE of the irradiance over receivers that the picture shows: RMS of
// E' - E over mean E (luminance), both in closed form and double precision
// (lightfield/light_vector.h).
#pragma once

#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/preprocess/scene_receivers.h"

namespace luxfield::preprocess {

struct ReductionStep {
  std::string name;     // "as given", "crop", "merge", "pool", "drop", "round"
  std::string setting;  // "3 x 3 images", "mantissa of 9 bits"
  int images = 0;       // that are not all zero
  int grid_width = 0, grid_height = 0, width = 0, height = 0;
  double bytes = 0;      // of coefficients and their summed-area tables in memory
  double rel_error = 0;  // after this step, against the light field as given
  // Texels in the windows of a receiver, over all images: what `exact` reads for it. Mean.
  double texels_per_receiver = 0;
};

struct Reduction {
  lightfield::LightField field;
  std::vector<ReductionStep> steps;
  // Over receivers other than those that the settings were chosen by.
  double measured_error = 0;
  // Over all pictures of this view with 97.5 % confidence, from the scatter of squared errors.
  double error_bound = 0;
  double core_s = 0;  // CPU time of the reduction
  double core_s_per_receiver_before = 0, core_s_per_receiver_after = 0;  // of the closed form
};

// `chosen_by` and `judged_by` are independent samples of the picture's receivers, all luminaires
// that show this light field together. Throws InputError if max_rel_error is outside [1e-5, 1],
// receivers are missing, or the receivers get no light.
Reduction ReduceLightField(const lightfield::LightField& field, const SeenRectangle& seen,
                           const std::vector<Receiver>& chosen_by,
                           const std::vector<Receiver>& judged_by, double max_rel_error);

}  // namespace luxfield::preprocess
