#include "reconstruct/bracket_reader.h"

#include "core/parallel.h"

namespace luxfield::reconstruct {

BracketReader::BracketReader(const core::SessionReader& session,
                             std::vector<BracketRecords> brackets, bool check_hashes)
    : session_(session), brackets_(std::move(brackets)), check_hashes_(check_hashes) {
  ReadAhead();
}

BracketReader::~BracketReader() {
  if (ahead_.valid()) ahead_.wait();
}

std::vector<core::RawFrame> BracketReader::Next() {
  std::vector<core::RawFrame> frames = ahead_.get();
  ++next_;
  ReadAhead();
  return frames;
}

void BracketReader::ReadAhead() {
  if (next_ == brackets_.size()) return;
  const auto how = core::Threads() > 1 ? std::launch::async : std::launch::deferred;
  ahead_ = std::async(how, [this, bracket = next_] { return Read(bracket); });
}

std::vector<core::RawFrame> BracketReader::Read(std::size_t bracket) const {
  const BracketRecords& records = brackets_[bracket];
  std::vector<core::RawFrame> frames(records.size());
  core::ParallelFor(records.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      frames[n] = session_.ReadFrame(*records[n], check_hashes_);
  });
  return frames;
}

}  // namespace luxfield::reconstruct
