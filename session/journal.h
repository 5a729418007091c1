// journal.jsonl: an append-only file of records that vouch for each other
// (docs/formats/session.md).
//
// Each line is {"seq":N,"prev":"<64 hex>","type":"...", ...fields in key order..., "crc32c":"<8
// hex>"} and a newline. `prev` is the SHA-256 of the previous line without its newline (64 zeros on
// the first), `crc32c` the CRC-32C of the bytes before
// `,"crc32c"`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace luxfield::session {

// One line, without newline. `fields` must be an object without the keys seq, prev, type and
// crc32c.
std::string FormatJournalLine(std::uint64_t seq, const std::string& prev, const std::string& type,
                              const nlohmann::json& fields);

// Checks the CRC of a line (without newline) and parses it. Returns false for damage; never throws.
bool ParseJournalLine(std::string_view line, nlohmann::json& record);

// Where a journal ends.
struct JournalEnd {
  std::size_t lines = 0;          // valid ones
  std::string head;               // SHA-256 of the last valid line, 64 zeros if there is none
  std::uint64_t valid_bytes = 0;  // what follows is the torn last line
  bool torn = false;
};
struct JournalContent : JournalEnd {
  std::vector<nlohmann::json> records;
};

// Reads and checks the whole chain; `see` gets one record after the other with its line's number,
// from 1. A damaged or unfinished last line is what a crash leaves: it is left out and `torn` set.
// Damage elsewhere throws InputError naming the line.
using SeeRecord = std::function<void(nlohmann::json&& record, std::size_t line)>;
JournalEnd VisitJournal(const std::filesystem::path& path, const SeeRecord& see);
JournalContent ReadJournal(const std::filesystem::path& path);
// The same of a file's bytes; `file` names it in errors.
JournalContent ParseJournal(std::string_view bytes, const std::string& file);

// Appends lines, each durable (fdatasync) when Append returns. After a failed Append the object
// refuses to go on: the file's end is unknown until the session is opened again.
class JournalWriter {
 public:
  // A new file (must not exist) or, with the content read before, an existing one, cut after its
  // last valid line.
  explicit JournalWriter(const std::filesystem::path& path);
  JournalWriter(const std::filesystem::path& path, const JournalContent& content);
  ~JournalWriter();
  JournalWriter(JournalWriter&&) noexcept;
  JournalWriter(const JournalWriter&) = delete;

  void Append(const std::string& type, const nlohmann::json& fields);  // throws DeviceError

  std::uint64_t next_seq() const { return seq_; }
  const std::string& head() const { return head_; }

 private:
  std::filesystem::path path_;
  int fd_ = -1;
  std::uint64_t seq_ = 0;
  std::string head_;
  bool failed_ = false;
};

}  // namespace luxfield::session
