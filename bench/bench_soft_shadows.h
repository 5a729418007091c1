// The thesis' flagship: two headlights with shadows, frame by frame, by `volume` with soft shadow
// maps (docs/theory.md 7.5), its speed and its error against traced truth.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/render/accuracy/car2.h"
#include "luxfield/render/lights/patch_shadows.h"

namespace luxfield::bench {

struct SoftShadowsOptions {
  render::SyntheticCar2Options lamp;  // 11 x 9 images of 256^2
  int width = 1024, height = 768;
  int map_size = 384;           // texels along each side
  double volume_error = 2e-3;   // asked of the volume
  int repeats = 3;              // the medians count
  int reference_pixels = 5000;  // random subset that errors are taken over
  int reference_samples = 256;  // of each lamp and pixel, in two independent halves
  int motion_frames = 0;        // of lamps that move a centimetre a frame; 0: none
  int flight_frames = 0;        // of a camera that moves a centimetre a frame; 0: none
  int motion_pixels = 2000;     // random subset that frames are compared at
  std::string pictures;         // a folder for pictures and Lab differences as PNG; empty: none
  std::string device;           // as --device
  int threads = 0;              // of an OpenCL CPU device, 0: all
};

struct SoftShadowsTime {
  double core_s = 0, wall_s = 0;
};

// Mean Lab between successive frames, averaged over them: of these pictures, of the reference, and
// between the changes of both; 0 where nothing moves. `excess_lab` is by how much these pictures
// change more than the reference, `largest_excess_lab` that from one frame to the next where it is
// largest: what pops.
struct MotionFigures {
  double lab = 0, reference_lab = 0, error_lab = 0, excess_lab = 0, largest_excess_lab = 0;
};

struct SoftShadowsFigures {
  // Of lighting the resident G-buffer by both lamps, where the camera moves: maps stay.
  double camera_fps = 0, camera_core_s = 0;
  // The same with all maps drawn anew, where lamps or things move.
  double fps = 0, core_s = 0;
  std::vector<SoftShadowsTime> runs;              // that these are the medians of
  double primary_core_s = 0;                      // of the G-buffer, which is not in them
  double unshadowed_core_s = 0, maps_core_s = 0;  // without shadows; of the maps alone
  // Of the irradiance against the reference, and half of the difference of its halves.
  double mean_lab = 0, rel_rmse = 0, bias = 0, reference_lab = 0, unshadowed_lab = 0;
  MotionFigures motion, flight;  // of the lamps, of the camera
};

// The scene of bench/occluder_scene.h with lamps 0.7 m apart. Times are taken after compilation; the
// reference is `exact` times the visible share of traced samples, unbiased up to its noise. Throws
// InputError, DeviceError.
SoftShadowsFigures MeasureSoftShadows(const SoftShadowsOptions& options = {});

// One row of figures for `luxfield bench shadows`.
nlohmann::json SoftShadowsRow(const SoftShadowsOptions& options, const SoftShadowsFigures& figures);

}  // namespace luxfield::bench
