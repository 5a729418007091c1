#include "luxfield/session/session_store.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <span>
#include <tuple>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/sha256.h"
#include "luxfield/session/frame_file.h"
#include "luxfield/session/journal.h"
#include "luxfield/session/manifest.h"
#include "luxfield/session/session_check.h"
#include "luxfield/session/session_writer.h"
#include "tests/fuzz/seeded.h"
#include "tests/fuzz/session_files.h"
#include "tests/session/session_folders.h"

namespace luxfield::session {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(SessionStore, WhatIsWrittenIsRead) {
  const auto folder = WholeSession("roundtrip");
  const SessionReader reader(folder);
  EXPECT_TRUE(reader.sealed());
  EXPECT_EQ(reader.plan(), kPlan);
  EXPECT_EQ(reader.session(), kSession);
  ASSERT_EQ(reader.frames().size(), 1u + kPositions * kExposures);
  for (const FrameRecord& record : reader.frames()) {
    const RawFrame frame = reader.ReadFrame(record);
    EXPECT_EQ(frame.dn, ExpectedFrame(record).dn);
  }
  const SessionCheck check = VerifySession(folder);
  EXPECT_THAT(check.problems, testing::IsEmpty());
  EXPECT_EQ(check.positions, kPositions);
}

TEST(SessionStore, JournalLineIsAsDocumented) {
  // The CRC is that of RFC 3720 (check value of "123456789"), the chain SHA-256 of the previous
  // line.
  EXPECT_EQ(core::Crc32c("123456789"), 0xE3069283u);
  const auto folder = WholeSession("line");
  std::ifstream file(folder / "journal.jsonl");
  std::string line, previous;
  for (int seq = 0; std::getline(file, line); ++seq) {
    const auto cut = line.rfind(",\"crc32c\":\"");
    EXPECT_EQ(line.substr(cut),
              fmt::format(",\"crc32c\":\"{:08x}\"}}", core::Crc32c(line.substr(0, cut))));
    const core::Json record = core::Json::parse(line);
    EXPECT_EQ(record["seq"], seq);
    EXPECT_EQ(record["prev"], seq == 0 ? std::string(64, '0') : core::Sha256(previous));
    previous = line;
  }
}

TEST(SessionStore, EveryTruncationOfTheLastLineIsDroppedOnResume) {
  const auto folder = NewFolder("torn");
  core::SimulatedClock clock;
  {
    auto writer = SessionWriter::Create(folder, kPlan, kSession, {}, clock);
    writer.StartEpoch({});
    FrameRecord record;
    record.i = record.j = 0;
    record.exposure_s = 1;
    writer.CommitFrame(record, TestFrame(0, 0), {});
  }
  const auto journal = folder / "journal.jsonl";
  const std::string bytes = core::ReadFile(journal);
  const std::size_t last = bytes.rfind('\n', bytes.size() - 2) + 1;
  ASSERT_GT(bytes.size() - last, 300u);
  for (std::size_t size = last; size < bytes.size(); ++size) {
    Overwrite(journal, bytes.substr(0, size));
    EXPECT_EQ(SessionReader(folder).frames().size(), 0u);
    const JournalContent content = ReadJournal(journal);
    EXPECT_EQ(content.torn, size != last);
    EXPECT_EQ(content.records.size(), 2u);
  }
  Overwrite(journal, bytes.substr(0, bytes.size() - 1));
  EXPECT_EQ(fs::exists(folder / "frames" /
                       "i000_j000_print0_channel0_exposure00_repeat0_epoch0_attempt0.tif"),
            true);
  auto writer = SessionWriter::Resume(folder, kPlan, clock);
  EXPECT_EQ(fs::is_empty(folder / "frames"), true) << "a frame without its line is an orphan";
  EXPECT_EQ(core::ReadFile(journal), bytes.substr(0, last));
  CaptureRest(writer);
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
}

// The first frame needed three attempts, the later one of the same planned frame a single one.
TEST(SessionStore, OfAPlannedFrameTheLastInTheJournalCounts) {
  const auto folder = NewFolder("again");
  core::SimulatedClock clock;
  {
    auto writer = SessionWriter::Create(folder, kPlan, kSession, {}, clock);
    writer.StartEpoch({{"camera", "test"}});
    for (const FrameKind kind : {FrameKind::kPosition, FrameKind::kDark})
      for (const int attempt : {2, 0, 0}) {
        FrameRecord record;
        record.kind = kind;
        if (kind == FrameKind::kPosition) record.i = record.j = 0;
        record.exposure_s = 1;
        record.attempt = attempt;
        writer.CommitFrame(record, TestFrame(0, 0), {});
      }
    writer.CompletePosition(0, 0);
  }
  const SessionReader reader(folder);
  ASSERT_EQ(reader.frames().size(), 2u);
  for (const FrameRecord& record : reader.frames()) EXPECT_THAT(record.file, HasSubstr("attempt1"));
}

TEST(SessionStore, AFlippedByteAnywhereIsNoticed) {
  const auto folder = WholeSession("flip");
  for (const char* name :
       {"journal.jsonl", "plan.json", "session.json", "manifest.json",
        "frames/i001_j000_print0_channel0_exposure01_repeat0_epoch0_attempt0.tif"}) {
    const std::string bytes = core::ReadFile(folder / name);
    for (std::size_t at = 0; at < bytes.size(); at += std::max<std::size_t>(1, bytes.size() / 97)) {
      std::string bad = bytes;
      bad[at] = static_cast<char>(bad[at] ^ 1);
      Overwrite(folder / name, bad);
      const SessionCheck check = VerifySession(folder);
      EXPECT_FALSE(check.problems.empty()) << name << " byte " << at;
    }
    Overwrite(folder / name, bytes);
  }
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
}

TEST(SessionStore, DamageBeforeTheLastLineIsRefusedNamingTheLine) {
  const auto folder = WholeSession("middle");
  const auto journal = folder / "journal.jsonl";
  const std::string bytes = core::ReadFile(journal);
  std::string bad = bytes;
  const std::size_t third = bytes.find('\n', bytes.find('\n') + 1) + 1;
  bad[third + 40] = static_cast<char>(bad[third + 40] ^ 4);
  Overwrite(journal, bad);
  EXPECT_THAT(MessageOf([&] { SessionReader reader(folder); }),
              HasSubstr("journal.jsonl: line 3 is damaged"));
  // A line taken out leaves valid CRCs but breaks the chain.
  const std::size_t fourth = bytes.find('\n', third) + 1;
  Overwrite(journal, bytes.substr(0, third) + bytes.substr(fourth));
  EXPECT_THAT(MessageOf([&] { SessionReader reader(folder); }),
              HasSubstr("line 3 does not continue line 2"));
}

TEST(SessionStore, MissingAndForeignFramesAreReported) {
  const auto folder = WholeSession("missing");
  const auto frame =
      folder / "frames/i001_j000_print0_channel0_exposure00_repeat0_epoch0_attempt0.tif";
  const std::string bytes = core::ReadFile(frame);
  fs::remove(frame);
  EXPECT_THAT(VerifySession(folder).problems, testing::Contains(HasSubstr("is missing")));
  Overwrite(frame, EncodeTiff(TestFrame(2, 0)));
  EXPECT_THAT(VerifySession(folder).problems, testing::Contains(HasSubstr("SHA-256")));
  const SessionReader reader(folder);
  for (const auto& record : reader.frames())
    if (folder / record.file == frame) {
      EXPECT_THROW(reader.ReadFrame(record), InputError);
    }
  Overwrite(frame, bytes);
  Overwrite(folder / "frames/stranger.tif", bytes);
  EXPECT_THAT(VerifySession(folder).problems,
              testing::ElementsAre(HasSubstr("stranger.tif: is not in the manifest")));
}

TEST(SessionStore, OfFramesReadTogetherTheAlteredOneIsNamed) {
  const auto folder = WholeSession("together");
  const SessionReader reader(folder);
  std::vector<const FrameRecord*> records;  // more than are hashed at a time
  for (int round = 0; round < 2; ++round)
    for (const FrameRecord& record : reader.frames()) records.push_back(&record);
  ASSERT_GT(records.size(), core::kSha256Lanes);
  std::vector<std::string> bytes(records.size());
  std::vector<RawFrame> frames(records.size());
  for (std::size_t count = 0; count <= records.size(); ++count) {
    ReadFrames(reader, std::span(records).first(count), true, bytes, frames);
    for (std::size_t n = 0; n < count; ++n)
      EXPECT_EQ(frames[n].dn, ExpectedFrame(*records[n]).dn) << records[n]->file;
  }
  for (std::size_t bad = 0; bad < records.size() / 2; ++bad) {
    const auto file = folder / records[bad]->file;
    const std::string whole = core::ReadFile(file);
    std::string altered = whole;
    altered.back() = static_cast<char>(altered.back() ^ 1);
    Overwrite(file, altered);
    for (std::size_t count = 0; count <= records.size(); ++count) {
      const auto read = [&](bool check) {
        ReadFrames(reader, std::span(records).first(count), check, bytes, frames);
      };
      const bool named = MessageOf([&] { read(true); }).find(file.string()) != std::string::npos;
      EXPECT_EQ(named, count > bad) << count << " frames, number " << bad;
      EXPECT_NO_THROW(read(false));
    }
    Overwrite(file, whole);
  }
}

// Frames as this program writes them are read in place; what others wrote, or what does not end where
// its head says, is decoded.
TEST(SessionStore, FramesAreReadAlikeInPlaceAndDecoded) {
  const auto folder = WholeSession("in_place");
  const SessionReader reader(folder);
  const FrameRecord* const record = &reader.frames().front();
  const auto file = folder / record->file;
  const std::string whole = core::ReadFile(file);
  const RawFrame expected = ExpectedFrame(*record);
  const auto read = [&] {
    std::string bytes;
    RawFrame frame;
    ReadFrame(reader, *record, false, &bytes, &frame);
    return frame;
  };
  EXPECT_EQ(read().dn, expected.dn);
  Overwrite(file, whole + "beyond");
  EXPECT_EQ(read().dn, expected.dn);
  std::string other = whole;  // a byte between directory and pixels
  other[kTiffHeadBytes - 1] = 1;
  Overwrite(file, other);
  EXPECT_EQ(read().dn, expected.dn);
  Overwrite(file, whole.substr(0, whole.size() - 1));
  EXPECT_THAT(MessageOf(read), HasSubstr(file.string()));
  Overwrite(file, whole.substr(0, kTiffHeadBytes / 2));
  EXPECT_THAT(MessageOf(read), HasSubstr(file.string()));
  Overwrite(file, whole);
}

TEST(SessionStore, TheManifestListsFramesAsTheyWereCommitted) {
  const auto folder = NewFolder("listed");
  core::SimulatedClock clock;
  auto writer = SessionWriter::Create(folder, kPlan, kSession, {}, clock);
  writer.StartEpoch({});
  FrameRecord record;
  record.i = record.j = 0;
  record.exposure_s = record.requested_exposure_s = 1;
  record = writer.CommitFrame(record, TestFrame(0, 0), {});
  Overwrite(folder / record.file, "damaged since");
  writer.Seal("done");
  const Manifest manifest =
      ParseManifest(core::ReadFile(folder / "manifest.json"), "manifest.json");
  const auto listed =
      std::find_if(manifest.files.begin(), manifest.files.end(),
                   [&](const ManifestFile& file) { return file.name == record.file; });
  ASSERT_NE(listed, manifest.files.end());
  EXPECT_EQ(listed->sha256, record.sha256);
  EXPECT_THAT(VerifySession(folder).problems, testing::Contains(HasSubstr("SHA-256")));
}

// Of root, who may read everything, for as long as it lives.
class AsNobody {
 public:
  explicit AsNobody(const fs::path& folder) {
    if (!root_) return;
    constexpr uid_t kNobody = 65534;
    fs::permissions(testing::TempDir(), fs::perms::group_exec | fs::perms::others_exec,
                    fs::perm_options::add);
    std::vector<fs::path> all{folder};
    for (const auto& entry : fs::recursive_directory_iterator(folder)) all.push_back(entry.path());
    for (const auto& path : all) EXPECT_EQ(::chown(path.c_str(), kNobody, kNobody), 0);
    EXPECT_EQ(::seteuid(kNobody), 0);
  }
  ~AsNobody() { EXPECT_TRUE(!root_ || ::seteuid(0) == 0); }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;

 private:
  const bool root_ = ::geteuid() == 0;
};

TEST(SessionStore, AFolderThatCannotBeReadIsNamed) {
  const auto folder = WholeSession("unreadable"), targets = folder / "targets";
  fs::create_directory(targets);
  fs::permissions(targets, fs::perms::none);
  SessionCheck check;
  {
    const AsNobody nobody(folder);
    EXPECT_NO_THROW(check = VerifySession(folder));
  }
  fs::permissions(targets, fs::perms::owner_all);
  EXPECT_THAT(check.problems,
              testing::ElementsAre(HasSubstr(targets.string() + ": cannot be read (")));
}

TEST(SessionStore, SalvageKeepsWhatIsIntactAndTheRestIsRetaken) {
  const auto folder = WholeSession("salvage");
  const auto journal = folder / "journal.jsonl";
  std::string bytes = core::ReadFile(journal);
  // Damage the line of one frame of position 1, and lose a frame file of position 2.
  const std::size_t at = bytes.find("i001_j000_print0_channel0_exposure01");
  bytes[at] = 'x';
  Overwrite(journal, bytes);
  fs::remove(folder / "frames/i002_j000_print0_channel0_exposure00_repeat0_epoch0_attempt0.tif");
  const SalvageResult result = SalvageSession(folder);
  EXPECT_EQ(result.lines_lost, 1);
  EXPECT_EQ(result.frames_lost, 1);
  EXPECT_EQ(result.frames_kept, 1 + kPositions * kExposures - 2);
  EXPECT_TRUE(fs::exists(result.old_journal));
  const SessionReader reader(folder);
  EXPECT_FALSE(reader.sealed());
  for (const auto& record : reader.frames())
    if (record.kind == FrameKind::kPosition) {
      EXPECT_EQ(record.i, 0) << "brackets that lost a frame do not count";
    }
  core::SimulatedClock clock;
  auto writer = SessionWriter::Resume(folder, kPlan, clock);
  CaptureRest(writer);
  const SessionCheck check = VerifySession(folder);
  EXPECT_THAT(check.problems, testing::IsEmpty());
  EXPECT_EQ(check.positions, kPositions);
}

// All files and their bytes.
std::map<std::string, std::string> Content(const fs::path& folder) {
  std::map<std::string, std::string> content;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().filename() != "LOCK")
      content[entry.path()] = core::ReadFile(entry.path());
  return content;
}

TEST(SessionStore, SalvageDoesNothingWhereNothingIsDamaged) {
  const auto folder = WholeSession("healthy");
  const int lines = static_cast<int>(ReadJournal(folder / "journal.jsonl").records.size());
  const auto expect_untouched = [&] {
    const auto before = Content(folder);
    const SalvageResult result = SalvageSession(folder);
    EXPECT_EQ(result.old_journal, "");
    EXPECT_EQ(result.lines_kept, lines);
    EXPECT_EQ(result.frames_kept, 1 + kPositions * kExposures);
    EXPECT_EQ(result.lines_lost + result.frames_lost, 0);
    EXPECT_EQ(Content(folder), before);
  };
  expect_untouched();
  EXPECT_TRUE(VerifySession(folder).sealed);
  Overwrite(folder / ".DS_Store", "made by a file manager");
  Overwrite(folder / "frames/stranger.tif", "of somebody else");
  expect_untouched();
  EXPECT_TRUE(VerifySession(folder).sealed);
  fs::remove(folder / "manifest.json");  // which --resume writes
  expect_untouched();
}

// Not the frames, and yet no seal that holds.
TEST(SessionStore, AManifestThatContradictsTheJournalIsDamage) {
  const auto folder = WholeSession("contradicts");
  const std::string journal = core::ReadFile(folder / "journal.jsonl");
  const core::Json whole = core::ReadJson(folder / "manifest.json");
  const auto frame_of = [](core::Json& manifest) -> core::Json& {
    for (core::Json& file : manifest["files"])
      if (file["file"].get<std::string>().starts_with("frames/")) return file;
    throw std::logic_error("lists no frame");
  };
  using Spoil = std::function<void(core::Json&)>;
  const std::pair<const char*, Spoil> cases[] = {
      {"another SHA-256", [&](core::Json& m) { frame_of(m)["sha256"] = std::string(64, '0'); }},
      {"is listed with 1 bytes", [&](core::Json& m) { frame_of(m)["bytes"] = 1; }},
      {"is not listed", [&](core::Json& m) { frame_of(m)["file"] = "derived/other"; }}};
  for (const auto& [said, spoil] : cases) {
    SCOPED_TRACE(said);
    core::Json manifest = whole;
    spoil(manifest);
    Overwrite(folder / "journal.jsonl", journal);
    Overwrite(folder / "manifest.json", manifest.dump(2) + "\n");
    const SessionCheck check = VerifySession(folder);
    EXPECT_TRUE(check.damaged);
    EXPECT_THAT(check.problems, testing::Contains(HasSubstr(said)));
    EXPECT_EQ(SalvageSession(folder).frames_lost, 0);
    EXPECT_FALSE(fs::exists(folder / "manifest.json"));
    EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
  }
  // As if the journal of a session that goes on lay beside a manifest.
  Overwrite(folder / "journal.jsonl",
            journal.substr(0, journal.rfind('\n', journal.size() - 2) + 1));
  Overwrite(folder / "manifest.json", whole.dump(2) + "\n");
  EXPECT_TRUE(VerifySession(folder).damaged);
  SalvageSession(folder);
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
}

TEST(SessionStore, LinksInsideAreNothingThatSalvageMends) {
  for (const char* name :
       {"frames/i001_j000_print0_channel0_exposure01_repeat0_epoch0_attempt0.tif", "frames",
        "manifest.json", "plan.json"}) {
    SCOPED_TRACE(name);
    const auto folder = WholeSession("links");
    const auto elsewhere = NewFolder("elsewhere");
    fs::rename(folder / name, elsewhere);
    fs::create_symlink(elsewhere, folder / name);
    std::string journal = core::ReadFile(folder / "journal.jsonl");
    const SessionCheck check = VerifySession(folder);
    EXPECT_TRUE(check.leads_out);
    journal[journal.find("i002_j000")] = 'x';  // something to salvage
    Overwrite(folder / "journal.jsonl", journal);
    const auto before = Content(folder);
    EXPECT_THAT(MessageOf([&] { SalvageSession(folder); }), HasSubstr("symbolic link"));
    EXPECT_EQ(Content(folder), before);
  }
}

TEST(SessionStore, NothingIsWrittenThatNoReaderTakes) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto folder = NewFolder("readable");
  core::SimulatedClock clock;
  SessionWriter::Create(folder, kPlan, kSession, {}, clock).StartEpoch({});
  using Spoil = std::function<void(FrameRecord&, core::Json & checks)>;
  const std::vector<std::pair<std::string, Spoil>> cases = {
      {"meter", [](FrameRecord& r, core::Json&) { r.meter = kNan; }},
      {"meter", [](FrameRecord& r, core::Json&) { r.meter = kInfinity; }},
      {"meter", [](FrameRecord& r, core::Json&) { r.meter = -1; }},
      {"t_start_s", [](FrameRecord& r, core::Json&) { r.t_start_s = kNan; }},
      {"stage_u_m", [](FrameRecord& r, core::Json&) { r.stage_u_m = kInfinity; }},
      {"exposure_s", [](FrameRecord& r, core::Json&) { r.exposure_s = 0; }},
      {"checks.mean_dn", [](FrameRecord&, core::Json& checks) { checks["mean_dn"] = -kInfinity; }}};
  for (const auto& [field, spoil] : cases)
    for (const bool behind : {false, true}) {
      SCOPED_TRACE(field);
      auto writer = SessionWriter::Resume(folder, kPlan, clock);
      writer.StartEpoch({});
      FrameRecord record;
      record.i = record.j = 0;
      record.exposure_s = record.requested_exposure_s = 1;
      core::Json checks = core::Json::object();
      spoil(record, checks);
      try {
        if (behind) {
          writer.CommitFrameBehind(record, std::make_shared<RawFrame>(TestFrame(0, 0)), checks);
          writer.CompletePosition(0, 0);
        } else {
          writer.CommitFrame(record, TestFrame(0, 0), checks);
        }
        FAIL() << "it was written";
      } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), HasSubstr(field));
      }
      EXPECT_THROW(writer.Append("drift", {{"ratio", kNan}}), DeviceError);
      EXPECT_EQ(SessionReader(folder).frames().size(), 0u);
    }
  auto writer = SessionWriter::Resume(folder, kPlan, clock);
  CaptureRest(writer);
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
}

// Lines that are whole, and make no sense: a monitor over range, as earlier versions wrote it.
TEST(SessionStore, SalvageDropsLinesThatMakeNoSense) {
  for (const auto& [type, field, value] :
       {std::tuple{"frame", "meter", core::Json()}, std::tuple{"frame", "meter", core::Json(-1)},
        std::tuple{"position_complete", "frames", core::Json("two")}}) {
    SCOPED_TRACE(fmt::format("{} {}", type, field));
    const auto folder = WholeSession("senseless");
    const auto journal = folder / "journal.jsonl";
    std::vector<core::Json> records = ReadJournal(journal).records;
    const auto struck =
        std::find_if(records.rbegin(), records.rend(),
                     [&, wanted = type](const core::Json& r) { return r["type"] == wanted; });
    (*struck)[field] = value;
    std::string lines, prev(64, '0');
    for (std::size_t seq = 0; seq < records.size(); ++seq) {
      core::Json fields = records[seq];
      for (const char* key : {"seq", "prev", "type", "crc32c"}) fields.erase(key);
      const std::string line = FormatJournalLine(seq, prev, records[seq]["type"], fields);
      prev = core::Sha256(line);
      lines += line + '\n';
    }
    Overwrite(journal, lines);
    EXPECT_THROW(SessionReader{folder}, InputError);
    const SalvageResult result = SalvageSession(folder);
    EXPECT_EQ(result.lines_lost, 1);
    EXPECT_EQ(result.frames_lost, 0);
    core::SimulatedClock clock;
    auto writer = SessionWriter::Resume(folder, kPlan, clock);
    CaptureRest(writer);
    const SessionCheck check = VerifySession(folder);
    EXPECT_THAT(check.problems, testing::IsEmpty());
    EXPECT_EQ(check.positions, kPositions);
  }
}

TEST(SessionStore, ARetakenBracketReplacesTheBrokenOneWhole) {
  const auto folder = NewFolder("epochs");
  core::SimulatedClock clock;
  FrameRecord record;
  record.i = record.j = 0;
  record.exposure_s = 1;
  {
    auto writer = SessionWriter::Create(folder, kPlan, kSession, {}, clock);
    writer.StartEpoch({});
    writer.CommitFrame(record, TestFrame(7, 0), {});  // the bracket is never completed
  }
  EXPECT_EQ(SessionReader(folder).frames().size(), 0u);
  auto writer = SessionWriter::Resume(folder, kPlan, clock);
  CaptureRest(writer);
  const SessionReader reader(folder);
  for (const auto& r : reader.frames()) EXPECT_EQ(r.epoch, 1);
}

TEST(SessionStore, OneWriterAtATime) {
  const auto folder = NewFolder("lock");
  core::SimulatedClock clock;
  const auto writer = SessionWriter::Create(folder, kPlan, kSession, {}, clock);
  EXPECT_THAT(MessageOf([&] { SessionWriter::Resume(folder, kPlan, clock); }),
              HasSubstr("in use by another process"));
}

TEST(SessionStore, RefusesWhatIsNotItsOwn) {
  core::SimulatedClock clock;
  const auto folder = WholeSession("refuse");
  EXPECT_THAT(MessageOf([&] { SessionWriter::Create(folder, kPlan, kSession, {}, clock); }),
              HasSubstr("already holds"));
  EXPECT_THAT(MessageOf([&] { SessionWriter::Resume(folder, kPlan, clock); }),
              HasSubstr("is sealed"));
  fs::remove(folder / "manifest.json");
  EXPECT_THAT(MessageOf([&] {
                SessionWriter::Resume(folder, {{"positions", 4}}, clock);
              }),
              HasSubstr("another plan"));
  const auto home = NewFolder("home");
  fs::create_directories(home);
  Overwrite(home / "thesis.txt", "do not touch");
  EXPECT_THAT(MessageOf([&] { SessionWriter::Create(home, kPlan, kSession, {}, clock); }),
              HasSubstr("'thesis.txt'"));
  EXPECT_THAT(MessageOf([&] { SessionReader reader(home); }), HasSubstr("no journal.jsonl"));
}

TEST(SessionStore, HostileRecordsAreInputErrors) {
  const auto folder = NewFolder("hostile");
  core::SimulatedClock clock;
  SessionWriter::Create(folder, kPlan, kSession, {}, clock);
  const JournalContent start = ReadJournal(folder / "journal.jsonl");
  const std::string intact = core::ReadFile(folder / "journal.jsonl");
  const auto with_line = [&](const std::string& type, const core::Json& fields) {
    Overwrite(folder / "journal.jsonl",
              intact + FormatJournalLine(1, start.head, type, fields) + "\n");
    return MessageOf([&] { SessionReader reader(folder); });
  };
  core::Json frame = {{"kind", "position"},
                      {"i", 0},
                      {"j", 0},
                      {"channel", 0},
                      {"print", 0},
                      {"exposure_index", 0},
                      {"repeat", 0},
                      {"attempt", 0},
                      {"epoch", 0},
                      {"requested_exposure_s", 1},
                      {"exposure_s", 1},
                      {"attenuation", 1},
                      {"stage_u_m", 0},
                      {"stage_v_m", 0},
                      {"t_start_s", 0},
                      {"meter", 0},
                      {"flagged", false},
                      {"file", "frames/a.tif"},
                      {"sha256", ""}};
  EXPECT_EQ(with_line("frame", frame), "no InputError");
  const auto with = [&](const char* key, const core::Json& value) {
    core::Json bad = frame;
    bad[key] = value;
    return with_line("frame", bad);
  };
  EXPECT_THAT(with("file", "../../etc/passwd"), HasSubstr("leaves the session folder"));
  EXPECT_THAT(with("file", "/etc/passwd"), HasSubstr("leaves the session folder"));
  EXPECT_THAT(with("exposure_s", -1), HasSubstr("line 2: exposure_s = -1"));
  EXPECT_THAT(with("exposure_s", "long"), HasSubstr("wrong type"));
  // Squares of such numbers are infinite, or divisions by them 0.
  EXPECT_THAT(with("meter", 1e308), HasSubstr("line 2: field 'meter' = 1e+308"));
  EXPECT_THAT(with("meter", 1e16), HasSubstr("line 2: meter = 1e+16"));
  for (const double exposure_s : {1e300, 1e7, 1e-10, 0.0})
    EXPECT_THAT(with("exposure_s", exposure_s), HasSubstr("exposure_s")) << exposure_s;
  EXPECT_THAT(with("requested_exposure_s", 1e7), HasSubstr("requested_exposure_s = 1e+07"));
  EXPECT_THAT(with("attenuation", 0), HasSubstr("attenuation = 0"));
  EXPECT_THAT(with("attenuation", 1e20), HasSubstr("attenuation = 1e+20"));
  EXPECT_THAT(with("stage_v_m", -1e4), HasSubstr("stage_v_m = -10000"));
  EXPECT_THAT(with("t_start_s", 1e12), HasSubstr("t_start_s = 1e+12"));
  EXPECT_THAT(with("kind", "selfie"), HasSubstr("not a frame kind"));
  EXPECT_THAT(with("channel", 17), HasSubstr("channel = 17"));
  EXPECT_THAT(with_line("session_open", {}), HasSubstr("one session_open"));
}

TEST(SessionStore, IsPrivate) {
  const auto folder = WholeSession("private");
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    EXPECT_EQ(entry.status().permissions() & (fs::perms::group_all | fs::perms::others_all),
              fs::perms::none)
        << entry.path();
  EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
}

// On resume a session is written to and cleaned up: links must not lead either elsewhere.
TEST(SessionStore, LinksInASessionAreRefusedAndTheirTargetsUntouched) {
  const auto outside = NewFolder("outside");
  for (const char* name : {"frames", "LOCK", "journal.jsonl", "plan.json"}) {
    SCOPED_TRACE(name);
    fs::remove_all(outside);
    fs::create_directories(outside);
    Overwrite(outside / "letter.txt", "dear");
    const auto folder = WholeSession("links");
    fs::remove(folder / "manifest.json");
    fs::rename(folder / name, outside / name);
    fs::create_symlink(outside / name, folder / name);
    std::vector<std::pair<fs::path, std::string>> before;
    for (const auto& entry : fs::recursive_directory_iterator(outside))
      if (entry.is_regular_file()) before.emplace_back(entry.path(), core::ReadFile(entry.path()));
    core::SimulatedClock clock;
    EXPECT_THAT(MessageOf([&] { SessionWriter::Resume(folder, kPlan, clock); }),
                HasSubstr("symbolic link"));
    for (const auto& [path, bytes] : before) EXPECT_EQ(core::ReadFile(path), bytes) << path;
  }
}

TEST(SessionStore, AFrameBehindALinkIsNotRead) {
  const auto folder = WholeSession("link_frame");
  const std::string name =
      "frames/i001_j000_print0_channel0_exposure01_repeat0_epoch0_attempt0.tif";
  const auto elsewhere = NewFolder("elsewhere");
  fs::rename(folder / name, elsewhere);
  fs::create_symlink(elsewhere, folder / name);
  EXPECT_THAT(VerifySession(folder).problems, testing::Contains(HasSubstr("symbolic link")));
  const SessionReader reader(folder);
  for (const auto& record : reader.frames())
    if (record.file == name) {
      EXPECT_THAT(MessageOf([&] { reader.ReadFrame(record); }), HasSubstr("symbolic link"));
    }
}

TEST(SessionStore, AManifestThatNamesFilesOutsideIsReported) {
  const auto folder = WholeSession("escape");
  core::Json manifest = core::ReadJson(folder / "manifest.json");
  manifest["files"].push_back({{"file", "../../../etc/passwd"}, {"bytes", 1}, {"sha256", ""}});
  Overwrite(folder / "manifest.json", manifest.dump());
  EXPECT_THAT(VerifySession(folder).problems,
              testing::Contains(HasSubstr("leaves the session folder")));
}

TEST(SessionStore, FilesBesideSessionJsonAreVouchedFor) {
  const auto folder = NewFolder("beside");
  core::SimulatedClock clock;
  {
    auto writer = SessionWriter::Create(folder, kPlan, kSession, {{"map.exr", "bytes"}}, clock);
    CaptureRest(writer);
  }
  fs::remove(folder / "manifest.json");
  Overwrite(folder / "map.exr", "other");
  EXPECT_THAT(VerifySession(folder).problems, testing::Contains(HasSubstr("map.exr: differs")));
}

// The files of a session as they are written: what fuzzing begins from.
std::string FileOfWholeSession(const char* name) {
  const auto folder = WholeSession("fuzz");
  return core::ReadFile(folder / name);
}

TEST(SessionStore, JournalsSurviveASampleOfFuzzing) {
  fuzz::Seeded(fuzz::SessionJournal, {FileOfWholeSession("journal.jsonl")}, 4000);
}

TEST(SessionStore, ManifestsSurviveASampleOfFuzzing) {
  const std::string whole = FileOfWholeSession("manifest.json");
  // Found by libFuzzer: a size that no file has.
  const std::string field = "\"bytes\": ";
  std::string huge = whole;
  huge.insert(huge.find(field) + field.size(), "299999999999999999999999999999");
  EXPECT_THROW(ParseManifest(huge, "manifest.json"), InputError);
  fuzz::Seeded(fuzz::SessionManifest, {whole, huge}, 4000);
}

}  // namespace
}  // namespace luxfield::session
