#include "tests/e2e/frames_as_seen.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "luxfield/core/file.h"
#include "luxfield/session/raw_frame.h"
#include "luxfield/session/session_replay.h"
#include "luxfield/session/session_store.h"

namespace luxfield::e2e {

FramesAsSeen ExpectFramesAsSeen(const std::filesystem::path& session,
                                const std::vector<fakes::SeenExposure>& exposures) {
  constexpr double kExposure = 1e-6;  // relative
  constexpr double kPlace_m = 3e-6;   // half a step of the fake stages on both axes
  constexpr double kStart_s = 0.5;    // 7e-6 of the light of a lamp that loses 5 % an hour
  constexpr double kMeter = 1e-3;     // relative
  std::map<std::string, const fakes::SeenExposure*> by_pixels;
  for (const fakes::SeenExposure& seen : exposures) by_pixels[seen.pixels_sha256] = &seen;
  EXPECT_EQ(by_pixels.size(), exposures.size()) << "noise makes each exposure another one";

  const session::SessionReader reader(session);
  FramesAsSeen worst;
  std::set<const fakes::SeenExposure*> taken;
  for (const session::FrameRecord& record :
       session::ReplayJournal(reader.journal(), "journal").committed) {
    SCOPED_TRACE(record.file);
    const auto found = by_pixels.find(core::Sha256(session::PixelBytes(reader.ReadFrame(record))));
    if (found == by_pixels.end()) {
      ADD_FAILURE() << "the camera never saw these pixels";
      continue;
    }
    const fakes::SeenExposure& seen = *found->second;
    EXPECT_TRUE(taken.insert(&seen).second) << "another frame is the same exposure";
    const bool dark = record.kind == session::FrameKind::kDark;
    EXPECT_EQ(seen.shutter_open, !dark);
    if (!dark) {
      EXPECT_EQ(seen.print, record.print);
      EXPECT_GT(seen.lamp, 0);
    }
    const double exposure = std::abs(record.exposure_s / seen.exposure_s - 1);
    const double place_m = std::hypot(record.stage_u_m - seen.u_m, record.stage_v_m - seen.v_m);
    const double start_s = std::abs(record.t_start_s - seen.start_s);
    const double meter = record.meter > 0 ? std::abs(record.meter / seen.lamp - 1) : 0;
    EXPECT_LE(exposure, kExposure);
    EXPECT_LE(place_m, kPlace_m);
    EXPECT_LE(start_s, kStart_s);
    EXPECT_LE(meter, kMeter);
    ++worst.frames;
    worst.exposure = std::max(worst.exposure, exposure);
    worst.place_m = std::max(worst.place_m, place_m);
    worst.start_s = std::max(worst.start_s, start_s);
    worst.meter = std::max(worst.meter, meter);
  }
  return worst;
}

}  // namespace luxfield::e2e
