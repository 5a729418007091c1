// Flats and darks of a session -> what the sensor does (photon_transfer.h, linearity.h).
//
// A colour mosaic is four sensors of one colour each (mosaic_sites.h) behind one electronics: each
// site has its own levels of light, linearity and PRNU, and all sites' pairs are fitted together
// for gain, read noise, offset and dark current, as the channels of a colour wheel are. A site's
// flats at which another site is saturated are left out: overflow may have reached them.
//
// One pair of frames is in memory at a time, four for PRNU, and a mask: 9 bytes a pixel at 16 bit,
// 21 while outliers are looked for. Every frame is read once, and once more where the flats show
// dead pixels; a mosaic's darks once per site for PRNU.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/reconstruct/calibrate/sensor/linearity.h"
#include "luxfield/reconstruct/calibrate/sensor/photon_transfer.h"
#include "luxfield/session/session_store.h"

namespace luxfield::reconstruct {

// Two frames of one exposure time, read when they are needed.
struct CalibrationPair {
  bool dark = false;
  int channel = 0;
  double exposure_s = 0;
  double meter_a = 0, meter_b = 0;  // lamp monitor; 0: none
  std::function<std::pair<session::RawFrame, session::RawFrame>()> read;
};

struct ChannelCalibration {
  int channel = 0;          // colour
  std::optional<int> site;  // of a mosaic's cell
  PhotonTransfer transfer;  // of this channel's (site's) flats and all darks
  Linearity linearity;
  Quantity prnu_squared, prnu;  // at the brightest level below saturation
};

struct SensorCalibration {
  int width = 0, height = 0, bits = 16;
  PhotonTransfer transfer;                   // of all channels together
  Quantity prnu_squared, prnu;               // mean over the channels of PRNU^2, and its root
  std::vector<ChannelCalibration> channels;  // in rising order; of a mosaic its sites
  std::vector<std::pair<int, int>> hot;      // (row, column), from the longest darks
  std::vector<std::pair<int, int>> dead;     // from the flats: dead, dim and bright ones
  std::map<std::string, std::string> provenance;
};

// Pairs the flats and darks of a session by channel, exposure and repeat (2k with 2k + 1). Frames
// without a partner are left out. The session must outlive the pairs. Throws InputError for a
// session without flats or darks.
std::vector<CalibrationPair> PairsOfSession(const session::SessionReader& session,
                                            bool check_hashes = true);

// Throws what FitPhotonTransfer and MeasureLinearity refuse, and InputError where more than 1 % of
// the pixels stand out of their neighbours: light with structure, not an even source. `cfa` as
// rig/cfa.h has it, empty for a sensor without a mosaic.
SensorCalibration CalibrateSensor(std::span<const CalibrationPair> pairs, const std::string& cfa);

// The same for a session, with its provenance: plan id, and the SHA-256 over the frames' SHA-256.
SensorCalibration CalibrateSensor(const session::SessionReader& session, bool check_hashes = true);

}  // namespace luxfield::reconstruct
