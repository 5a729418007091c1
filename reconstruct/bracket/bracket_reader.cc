#include "luxfield/reconstruct/bracket/bracket_reader.h"

#include <algorithm>

#include "luxfield/core/execution.h"
#include "luxfield/core/parallel.h"
#include "luxfield/session/frame_file.h"

namespace luxfield::reconstruct {

BracketReader::BracketReader(const session::SessionReader& session,
                             std::vector<BracketRecords> brackets, bool check_hashes)
    : session_(session), brackets_(std::move(brackets)), check_hashes_(check_hashes) {
  ReadAhead();
}

BracketReader::~BracketReader() {
  if (ahead_.valid()) ahead_.wait();
}

std::span<const session::RawFrame> BracketReader::Next() {
  ahead_.get();
  const std::span<const session::RawFrame> frames(frames_[next_ % 2].data(),
                                                  brackets_[next_].size());
  ++next_;
  ReadAhead();
  return frames;
}

void BracketReader::ReadAhead() {
  if (next_ == brackets_.size()) return;
  const auto how = core::Threads() > 1 ? std::launch::async : std::launch::deferred;
  ahead_ = std::async(how, core::InThisExecution([this, bracket = next_] { Read(bracket); }));
}

void BracketReader::Read(std::size_t bracket) {
  const BracketRecords& records = brackets_[bracket];
  std::vector<session::RawFrame>& frames = frames_[bracket % 2];
  frames.resize(std::max(frames.size(), records.size()));  // never shorter: memory stays
  bytes_.resize(std::max(bytes_.size(), records.size()));
  session::ReadFrames(session_, records, check_hashes_, std::span(bytes_).first(records.size()),
                      std::span(frames).first(records.size()));
}

}  // namespace luxfield::reconstruct
