// A capture session -> measurements: darks, lamp drift, exposure merge, registration
// (docs/theory.md 3).
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/reconstruct/bracket/session_plan.h"
#include "luxfield/reconstruct/merge/session_exposures.h"
#include "luxfield/reconstruct/merge/tilt_effect.h"
#include "luxfield/rig/sensor_model.h"
#include "luxfield/session/session_store.h"

namespace luxfield::reconstruct {

// The lamp level that the result belongs to.
enum class LampLevel {
  kFirstReference,  // the lamp as it was at the session's first reference frame
  kMonitorUnity  // the lamp at which its monitor reads 1: for monitors relative to a nominal level
};

// A drift reference as the lamp's level was taken from it.
struct MergedReference {
  const session::FrameRecord* record = nullptr;
  const std::vector<std::size_t>* pixels = nullptr;  // that were summed
  double signal_dn = 0;                              // their sum less darks
  const DarkFrame* dark = nullptr;                   // null: the sensor model's
};

// One position, print and channel on the sensor's own pixels.
struct MergedBracket {
  int i = 0, j = 0, print = 0, channel = 0;
  std::span<const session::FrameRecord* const> records;
  std::span<const Exposure> exposures;  // one per record
  const MergedFrame& merged;
  std::span<const float> irradiance_per_rate;  // as Registration::Apply takes it
  lightfield::Vec2 centre_m;
};

class LampDrift;

// Sees what MergeSession has at hand on its way, in the order of the positions; for error budgets.
class MergeObserver {
 public:
  virtual ~MergeObserver() = default;
  virtual void OnReferences(std::span<const MergedReference> references,
                            const LampDrift& drift) = 0;
  virtual void OnExposures(const SessionExposures& exposures) = 0;  // where they are estimated
  virtual void OnBracket(const MergedBracket& bracket) = 0;
};

struct MergeSessionOptions {
  MergeOptions merge;
  LampLevel lamp_level = LampLevel::kFirstReference;
  bool check_hashes = true;  // of every frame, against the journal
  // *.cal.json to use in place of what session.json and plan.json say: a sensor's
  // (sensor_calibration_file.h), the geometry's (geometry_calibration_file.h), either or both.
  std::vector<std::filesystem::path> calibrations;
  std::filesystem::path flat_field;  // *.flat.exr in place of vignetting and PRNU; empty: none
  // Exposure times from the frames (session_exposures.h) instead of the camera's word.
  bool estimate_exposures = false;
  MergeObserver* observer = nullptr;
};

struct MergeSessionSummary {
  int positions = 0;          // of the plan
  int frames = 0;             // of filter positions that were merged
  int flagged_frames = 0;     // of filter positions, kept by capture although a check failed
  int frames_left_out = 0;    // whose level contradicts their bracket's (bracket_levels.h)
  int brackets_left_out = 0;  // of which nothing was left
  int flagged_darks = 0;      // left out
  int dark_frames = 0, reference_frames = 0;  // that entered
  // Of the plan, without frames or with a bracket left out: unknown everywhere (kOffSensor).
  int missing_positions = 0;
  double least_lamp_factor = 1, largest_lamp_factor = 1;  // over the frames of filter positions
  double largest_displacement = 0;      // of a stage read-back from its plan, in basis spacings
  std::vector<RungExposure> exposures;  // estimated; empty: taken as read back
  std::optional<TiltEffect> tilt;       // of a calibrated geometry: what is not corrected
};

// The lamp's level over the level chosen, from reference frames: the sum
// over pixels that the first frame shows between 5 % and 80 % of the sensor's range (all that lie
// below 80 % if none does), divided by exposure and attenuation. Linear between references of one
// epoch (clocks of different epochs do not compare), constant outside; 1 for a channel and epoch
// without references.
class LampDrift {
 public:
  void Add(int epoch, int channel, double time_s, double factor);
  double Factor(int epoch, int channel, double time_s) const;

  // The references that Factor is interpolated from, and their shares, which sum to 1; none: empty.
  struct Share {
    double time_s = 0, factor = 0, share = 0;
  };
  std::vector<Share> Shares(int epoch, int channel, double time_s) const;

 private:
  std::map<std::pair<int, int>, std::map<double, double>> series_;
};

// The session's plan with what options.calibrations and options.flat_field say in place of it.
SessionPlan CalibratedPlan(const session::SessionReader& session,
                           const MergeSessionOptions& options);

// The pixels of the first reference frame that LampDrift's sums run over.
std::vector<std::size_t> ReferencePixels(const rig::SensorModel& sensor,
                                         const session::RawFrame& frame);

// E_ij on the plan's lattice, divided by the filter's scale; dual prints combined to E = peak(+)
// E(+) - peak(-) E(-). On the `lensless` rig E = X / (v R) with X the merged electrons per second,
// R the channel's responsivity and v the vignetting; on the `reflector` rig divided by the albedo
// as well (docs/formats/session.md). sigma holds noise, PRNU and the errors of estimated exposure
// times; errors of the lamp factor, the calibration and the stage are not in it. Holds two brackets
// of frames at a time: one is merged while the next is read. Brackets that hold a flagged frame
// beside a shorter one are read twice, to see which frames contradict the others. Throws InputError
// naming file and field for what the session lacks or contradicts, a stage read-back more than a
// tenth of a spacing from its plan, and Interrupted.
lightfield::Measurements MergeSession(const session::SessionReader& session,
                                      const MergeSessionOptions& options = {},
                                      MergeSessionSummary* summary = nullptr);

// The same written to a .meas.exr position by position: memory does not grow with the session's
// length. It holds about 40 bytes a sensor pixel (sums of dark frames, merged planes, calibration,
// corners behind a homography), 10 more per exposure time (two frames, a file's bytes, the darks'
// mean) and one position: 0.5 GB for 8 exposures at 4 megapixels. Bytes as
// WriteMeasurements(output, MergeSession(...)).
void MergeSessionToFile(const session::SessionReader& session, const std::filesystem::path& output,
                        const MergeSessionOptions& options = {},
                        MergeSessionSummary* summary = nullptr);

// The positions first to last - 1 of it alone (WriteMeasurementPositions): the frames of the others
// are not read, those that all positions share are. Position by position the bytes of the whole.
void MergePositionsToFile(const session::SessionReader& session,
                          const std::filesystem::path& output, int first, int last,
                          const MergeSessionOptions& options = {},
                          MergeSessionSummary* summary = nullptr);

}  // namespace luxfield::reconstruct
