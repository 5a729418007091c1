// Reads exposure brackets of a session while those before them are merged.
#pragma once

#include <array>
#include <future>
#include <span>
#include <string>
#include <vector>

#include "luxfield/session/session_store.h"

namespace luxfield::reconstruct {

// The frames of one bracket, as the journal has them.
using BracketRecords = std::vector<const session::FrameRecord*>;

// One bracket is read ahead, by a thread of its own, so that the disk works while the processor
// does; with a single thread allowed (core::Threads) each is read when it is asked for. Memory
// holds two brackets and the bytes of one's files, and is used again, whatever the session's
// length.
class BracketReader {
 public:
  // The brackets in the order they will be asked for. check_hashes: as SessionReader::ReadFrame.
  BracketReader(const session::SessionReader& session, std::vector<BracketRecords> brackets,
                bool check_hashes);
  ~BracketReader();  // waits for the reading thread

  // The frames of the next bracket, in the order of its records; they stay until the next call.
  // Throws what ReadFrame throws.
  std::span<const session::RawFrame> Next();

 private:
  void Read(std::size_t bracket);
  void ReadAhead();

  const session::SessionReader& session_;
  std::vector<BracketRecords> brackets_;
  bool check_hashes_;
  std::size_t next_ = 0;
  std::array<std::vector<session::RawFrame>, 2> frames_;  // of brackets in turn
  std::vector<std::string> bytes_;                        // of the files being read
  std::future<void> ahead_;
};

}  // namespace luxfield::reconstruct
