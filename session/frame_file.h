// Frames read one after the other into memory that is used again: the kernel clears fresh memory
// page by page, which takes longer than reading a frame that is cached.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "luxfield/core/sha256.h"
#include "luxfield/session/raw_frame.h"
#include "luxfield/session/session_store.h"

namespace luxfield::session {

// DecodeTiff(bytes, file) into `frame`, which keeps its memory where that is large enough.
void DecodeTiff(std::string_view bytes, const std::string& file, RawFrame* frame);

// Before the pixels of a file as EncodeTiff writes it.
constexpr std::uint32_t kTiffHeadBytes = 3 * core::kSha256Block;

// Whether `head` begins such a file of `file_bytes`; then `frame` gets its size, and the bytes that
// follow are those of its pixels.
bool ShapeByHead(std::string_view head, std::uintmax_t file_bytes, RawFrame* frame);

// session.ReadFrame(record, check_hash) into `frame`; `bytes` is scratch.
void ReadFrame(const SessionReader& session, const FrameRecord& record, bool check_hash,
               std::string* bytes, RawFrame* frame);

// The same for several frames, on all cores (core::Threads); their hashes are taken together
// (core/sha256.h). As many scratches and frames as records.
void ReadFrames(const SessionReader& session, std::span<const FrameRecord* const> records,
                bool check_hashes, std::span<std::string> bytes, std::span<RawFrame> frames);

}  // namespace luxfield::session
