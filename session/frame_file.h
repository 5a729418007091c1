// Frames read one after the other into memory that is used again: the kernel clears fresh memory
// page by page, which takes longer than reading a frame that is cached.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "luxfield/session/raw_frame.h"
#include "luxfield/session/session_store.h"

namespace luxfield::session {

// DecodeTiff(bytes, file) into `frame`, which keeps its memory where that is large enough.
void DecodeTiff(std::string_view bytes, const std::string& file, RawFrame* frame);

// session.ReadFrame(record, check_hash) into `frame`; `bytes` is scratch.
void ReadFrame(const SessionReader& session, const FrameRecord& record, bool check_hash,
               std::string* bytes, RawFrame* frame);

// The same for several frames, on all cores (core::Threads); their hashes are taken together
// (core/sha256.h). As many scratches and frames as records.
void ReadFrames(const SessionReader& session, std::span<const FrameRecord* const> records,
                bool check_hashes, std::span<std::string> bytes, std::span<RawFrame> frames);

}  // namespace luxfield::session
