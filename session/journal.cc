#include "luxfield/session/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"

namespace luxfield::session {
namespace {

constexpr std::string_view kCrcKey = ",\"crc32c\":\"";
constexpr std::size_t kCrcTail = kCrcKey.size() + 8 + 2;  // ,"crc32c":"01234567"}

const std::string& NoLine() {
  static const std::string zeros(64, '0');
  return zeros;
}

[[noreturn]] void FailWriting(const std::filesystem::path& path, const char* what) {
  throw DeviceError(
      fmt::format("{}: cannot {}: {}; free space or check the disk, then resume the session",
                  path.string(), what, std::strerror(errno)));
}

}  // namespace

std::string FormatJournalLine(std::uint64_t seq, const std::string& prev, const std::string& type,
                              const core::Json& fields) {
  std::string line =
      fmt::format(R"({{"seq":{},"prev":"{}","type":{})", seq, prev, core::Json(type).dump());
  if (!fields.empty()) {
    const std::string text = fields.dump();
    line += ',';
    line.append(text, 1, text.size() - 2);
  }
  return line + fmt::format(R"(,"crc32c":"{:08x}"}})", core::Crc32c(line));
}

bool ParseJournalLine(std::string_view line, core::Json& record) {
  if (line.size() <= kCrcTail) return false;
  const std::string_view body = line.substr(0, line.size() - kCrcTail);
  if (line.substr(body.size()) != fmt::format(R"(,"crc32c":"{:08x}"}})", core::Crc32c(body)))
    return false;
  try {
    record = core::ParseJson(line, {});
  } catch (const InputError&) {
    return false;
  }
  return record.is_object() && record.contains("seq") && record["seq"].is_number_unsigned() &&
         record.contains("prev") && record["prev"].is_string() && record.contains("type") &&
         record["type"].is_string();
}

namespace {

JournalEnd Visit(std::string_view bytes, const std::string& file, const SeeRecord& see) {
  JournalEnd end;
  end.head = NoLine();
  std::size_t begin = 0;
  while (begin < bytes.size()) {
    const std::size_t newline = bytes.find('\n', begin);
    const bool last = newline == std::string_view::npos || newline + 1 == bytes.size();
    const std::string_view line =
        bytes.substr(begin, newline == std::string_view::npos ? newline : newline - begin);
    core::Json record;
    const bool valid = newline != std::string_view::npos && ParseJournalLine(line, record);
    if (!valid && last) {
      end.torn = true;
      return end;
    }
    const std::size_t number = end.lines + 1;
    const char* remedy = "run `luxfield verify --salvage` on the session to keep what is intact";
    if (!valid) throw InputError(file, fmt::format("line {} is damaged", number), remedy);
    if (record["seq"].get<std::uint64_t>() != number - 1 ||
        record["prev"].get<std::string>() != end.head)
      throw InputError(
          file,
          fmt::format("line {} does not continue line {} (seq or prev differ)", number, number - 1),
          remedy);
    end.head = core::Sha256(line);
    end.lines = number;
    begin = newline + 1;
    end.valid_bytes = begin;
    see(std::move(record), number);
  }
  return end;
}

}  // namespace

JournalEnd VisitJournal(const std::filesystem::path& path, const SeeRecord& see) {
  return Visit(core::ReadFile(path), path.string(), see);
}

JournalContent ReadJournal(const std::filesystem::path& path) {
  return ParseJournal(core::ReadFile(path), path.string());
}

JournalContent ParseJournal(std::string_view bytes, const std::string& file) {
  JournalContent content;
  static_cast<JournalEnd&>(content) = Visit(bytes, file, [&](core::Json&& record, std::size_t) {
    content.records.push_back(std::move(record));
  });
  return content;
}

JournalWriter::JournalWriter(const std::filesystem::path& path) : path_(path), head_(NoLine()) {
  fd_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0600);
  if (fd_ < 0) FailWriting(path, "create");
  core::SyncFolder(path.parent_path());
}

JournalWriter::JournalWriter(const std::filesystem::path& path, const JournalContent& content)
    : path_(path), seq_(content.records.size()), head_(content.head) {
  fd_ = ::open(path.c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC);
  if (fd_ < 0) FailWriting(path, "open");
  if (content.torn &&
      (::ftruncate(fd_, static_cast<off_t>(content.valid_bytes)) != 0 || ::fdatasync(fd_) != 0))
    FailWriting(path, "drop the torn last line");
}

JournalWriter::~JournalWriter() {
  if (fd_ >= 0) ::close(fd_);
}

JournalWriter::JournalWriter(JournalWriter&& other) noexcept
    : path_(std::move(other.path_)),
      fd_(std::exchange(other.fd_, -1)),
      seq_(other.seq_),
      head_(std::move(other.head_)),
      failed_(other.failed_) {}

void JournalWriter::Append(const std::string& type, const core::Json& fields) {
  if (failed_)
    throw DeviceError(fmt::format("{}: an earlier line could not be written; resume the session",
                                  path_.string()));
  const std::string line = FormatJournalLine(seq_, head_, type, fields);
  std::string bytes = line + '\n';
  failed_ = true;  // until proven otherwise; a failed fsync must not be retried
  std::string_view rest = bytes;
  while (!rest.empty()) {
    const ssize_t written = ::write(fd_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) FailWriting(path_, "write");
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  core::StorageStep("line written");
  if (::fdatasync(fd_) != 0) FailWriting(path_, "sync");
  core::StorageStep("line synced");
  failed_ = false;
  head_ = core::Sha256(line);
  ++seq_;
}

}  // namespace luxfield::session
