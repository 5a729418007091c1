// What captures of every kind begin and end with.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

#include "luxfield/capture/take/capture.h"
#include "luxfield/capture/take/frame_taker.h"
#include "luxfield/session/session_writer.h"

namespace luxfield::capture {

struct SessionToTake {
  nlohmann::json plan;                  // plan.json
  std::uint64_t bytes = 0;              // of its frames, at most
  const std::vector<double>& ladder_s;  // rising
  int max_attempts = 1;
  int positions_total = 0;  // of the summary
};

// What a resumed session may yet need of the bytes its plan needs: frames that stay are there
// already. Darks and references are taken again.
std::uint64_t BytesToCome(std::uint64_t planned, const std::filesystem::path& session_folder);

// Looks at disk and safety inputs, opens the session (options.resume: the one that is there),
// begins an epoch, homes the stage, lets `take` take what the session lacks, switches the lamp off
// and seals it. One that is sealed but for its manifest gets that alone. Throws as RunCapture.
CaptureSummary TakeSession(
    const SessionToTake& what, hal::Devices& devices, const std::filesystem::path& folder,
    const CaptureOptions& options,
    const std::function<void(session::SessionWriter& session, FrameTaker& taker,
                             CaptureSummary& summary)>& take);

}  // namespace luxfield::capture
