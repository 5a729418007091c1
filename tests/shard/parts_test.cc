// Job files, manifests and pieces that do not fit each other, whatever fits their hashes.
#include <gmock/gmock.h>

#include <cstring>
#include <functional>
#include <tuple>
#include <utility>

#include "luxfield/shard/gather.h"
#include "luxfield/shard/piece_label.h"
#include "luxfield/shard/run_shard.h"
#include "luxfield/shard/status.h"
#include "tests/shard/job_fixture.h"

namespace luxfield::shard {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class ShardParts : public ShardJob {
 protected:
  void SetUp() override {
    ShardJob::SetUp();
    task_.emplace(folder_, kRows);
    job_ = Plan(*task_, kShards);
    for (int n = 0; n < kShards; ++n) RunShard(JobFolder(), job_, *task_, n);
  }

  core::Json JobJson() const { return core::ReadJson(JobFolder() / "job.json"); }
  void WriteJobJson(const core::Json& json) { core::WriteJson(JobFolder() / "job.json", json); }

  core::Json ManifestJson(int number) const {
    return core::ReadJson(ManifestFile(JobFolder(), job_.shards[number]));
  }
  void WriteManifestJson(int number, const core::Json& json) {
    core::WriteJson(ManifestFile(JobFolder(), job_.shards[number]), json);
  }
  // Writes the piece and makes its manifest fit.
  void WritePiece(int number, const std::string& bytes) {
    const auto piece = PieceOf(*task_, job_, number);
    core::WriteFileAtomically(piece, bytes);
    core::Json json = ManifestJson(number);
    json["files"] = {{{"file", piece.filename().string()},
                      {"bytes", bytes.size()},
                      {"sha256", core::Sha256(bytes)}}};
    WriteManifestJson(number, json);
  }

  // That nobody takes shard `number` for whole, and that doing it again mends the job.
  void ExpectRefused(int number, const std::string& because) {
    EXPECT_THAT(SentenceOf([&] { Gather(JobFolder(), job_, *task_); }),
                AllOf(HasSubstr(because), HasSubstr("shard run")));
    EXPECT_FALSE(std::filesystem::exists(task_->Outputs()[0]));
    EXPECT_NE(StatusOf(JobFolder(), job_, &*task_)[number].state, State::kDone);
    EXPECT_FALSE(RunShard(JobFolder(), job_, *task_, number).was_there);
    Gather(JobFolder(), job_, *task_);
    EXPECT_EQ(BytesOf(task_->Outputs()[0]), Whole(*task_));
    std::filesystem::remove(task_->Outputs()[0]);
  }

  static constexpr int kRows = 12, kShards = 4;
  std::optional<FakeTask> task_;
  Job job_;
};

TEST_F(ShardParts, RangesThatAreNotTheWholeAxisAreRefused) {
  using Spoil = std::function<void(Job&)>;
  const std::pair<const char*, Spoil> cases[] = {
      {"shards names none", [](Job& job) { job.shards.clear(); }},
      {"shard 0 has first = 3", [](Job& job) { job.shards.erase(job.shards.begin()); }},
      {"shard 0 has first = -3", [](Job& job) { job.shards[0].first = -3; }},
      {"shard 1 has first = 2", [](Job& job) { job.shards[1].first = 2; }},
      {"shard 1 has first = 6", [](Job& job) { job.shards.erase(job.shards.begin() + 1); }},
      {"shard 1 has first = 3, last = 3", [](Job& job) { job.shards[1].last = 3; }},
      {"length = 12 where its shards have 9 rows", [](Job& job) { job.shards.pop_back(); }},
      {"length = 11", [](Job& job) { job.length = 11; }}};
  for (const auto& [said, spoil] : cases) {
    SCOPED_TRACE(said);
    Job job = job_;
    spoil(job);
    std::filesystem::remove(JobFolder() / "job.json");
    for (std::size_t n = 0; n < job.shards.size(); ++n)  // names that fit
      job.shards[n].name =
          NameOf(job, static_cast<int>(n), job.shards[n].first, job.shards[n].last);
    WriteJob(JobFolder(), job);
    EXPECT_THAT(SentenceOf([&] { ReadJob(JobFolder()); }),
                AllOf(HasSubstr("job.json: "), HasSubstr(said), HasSubstr("plan the job anew")));
  }
}

// Shards that tile a length which is not the input's: 9 of 12 rows.
TEST_F(ShardParts, ALengthThatIsNotTheInputsIsRefused) {
  core::Json json = JobJson();
  json["length"] = 9;
  json["shards"].erase(3);
  WriteJobJson(json);
  const Job job = ReadJob(JobFolder());
  EXPECT_THAT(SentenceOf([&] { Gather(JobFolder(), job, *task_); }),
              AllOf(HasSubstr("job.json: length = 9 where the input has 12 rows"),
                    HasSubstr("plan the job anew")));
  EXPECT_FALSE(std::filesystem::exists(task_->Outputs()[0]));
}

TEST_F(ShardParts, InputsThatAreNotThoseOfTheNamesAreRefused) {
  core::Json json = JobJson();
  json["inputs"] = core::Json::array();
  WriteJobJson(json);
  EXPECT_THAT(SentenceOf([&] { ReadJob(JobFolder()); }), HasSubstr("inputs are not those"));
}

TEST_F(ShardParts, AManifestNamesItsPiecesAndNothingElse) {
  const std::string name = PieceOf(*task_, job_, 1).filename().string();
  core::WriteFileAtomically(folder_ / "other.exr", "another file");
  core::WriteFileAtomically(ShardsFolder(JobFolder()) / (job_.shards[1].name + ".x.exr"),
                            "foreign");
  const core::Json whole = ManifestJson(1);
  const std::string own = job_.shards[1].name;
  for (const auto& [file, bytes, because] :
       {std::tuple{std::string("../../other.exr"), "another file", "missing: 1"},
        {"nested/other.exr", "", "missing: 1"},
        {"", "", "missing: 1"},
        {job_.shards[2].name + ".exr", "", "missing: 1"},
        {own + ".x.exr", "foreign", "names"}}) {
    SCOPED_TRACE(file);
    core::Json json = whole;
    json["files"][0] = {
        {"file", file}, {"bytes", std::strlen(bytes)}, {"sha256", core::Sha256(bytes)}};
    WriteManifestJson(1, json);
    ExpectRefused(1, because);
  }
  core::Json json = whole;
  json["files"] = core::Json::array();
  core::WriteFileAtomically(PieceOf(*task_, job_, 1), "foreign");
  WriteManifestJson(1, json);
  ExpectRefused(1, "names no file where the shard has " + name);
  json = whole;
  json["files"].push_back(json["files"][0]);
  WriteManifestJson(1, json);
  ExpectRefused(1, "names " + name + ", " + name);
}

// Pieces of one size under each other's names, as a tool leaves them that copies between clusters.
TEST_F(ShardParts, PiecesUnderOtherNamesAreFound) {
  const std::string one = BytesOf(PieceOf(*task_, job_, 1)),
                    other = BytesOf(PieceOf(*task_, job_, 2));
  WritePiece(1, other);
  WritePiece(2, one);
  EXPECT_THAT(
      SentenceOf([&] { Gather(JobFolder(), job_, *task_); }),
      AllOf(HasSubstr(job_.shards[1].name), HasSubstr("rows 6 to 8"), HasSubstr("rows 3 to 5")));
  RunShard(JobFolder(), job_, *task_, 1);
  ExpectRefused(2, "rows 3 to 5");
}

TEST_F(ShardParts, PiecesOfAnotherJobAreFound) {
  std::filesystem::create_directories(folder_ / "more");
  FakeTask others(folder_ / "more", kRows);
  core::WriteFileAtomically(others.input, "letters");
  const Job job = MakeJob("fake", {"word"}, others, kShards);
  WriteJob(folder_ / "more/job", job);
  RunShard(folder_ / "more/job", job, others, 1);
  WritePiece(1, BytesOf(PieceFiles(folder_ / "more/job", job.shards[1], others)[0]));
  ExpectRefused(1, "is not the piece of that name");
}

// What a version before the labels wrote, a file that was cut short, and any other picture.
TEST_F(ShardParts, FilesWithoutALabelAreFound) {
  task_->Write(folder_ / "plain.exr", 3, 6);
  WritePiece(1, BytesOf(folder_ / "plain.exr"));
  ExpectRefused(1, "does not end with the line");
  std::string cut = BytesOf(PieceOf(*task_, job_, 1));
  cut.pop_back();
  WritePiece(1, cut);
  ExpectRefused(1, "does not end with the line");
  WritePiece(1, "");
  ExpectRefused(1, "does not end with the line");
}

// What is joined follows from them, too.
TEST_F(ShardParts, FiguresThatAreNotThePiecesOwnAreFound) {
  core::Json json = ManifestJson(1);
  json["figures"]["first"] = 4;
  WriteManifestJson(1, json);
  ExpectRefused(1, "is not the piece of that name");
}

TEST_F(ShardParts, TimesThatCannotBeVouchForNothing) {
  for (const char* field : {"wall_s", "core_s", "peak_mib"}) {
    core::Json json = ManifestJson(1);
    json[field] = 1e20;
    WriteManifestJson(1, json);
    ExpectRefused(1, "missing: 1");
  }
}

TEST_F(ShardParts, ALabelComesOffWhole) {
  task_->Write(folder_ / "plain.exr", 3, 6);
  const std::string plain = BytesOf(folder_ / "plain.exr");
  const auto piece = PieceOf(*task_, job_, 1);
  EXPECT_THAT(FindLabel(piece),
              AllOf(HasSubstr(piece.filename().string()), HasSubstr("of fake, rows 3 to 5")));
  RemoveLabel(piece);
  EXPECT_EQ(BytesOf(piece), plain);
  RemoveLabel(piece);
  EXPECT_EQ(BytesOf(piece), plain);
}

TEST_F(ShardParts, AWordThatIsNoUtf8IsRefusedByThePlan) {
  EXPECT_THAT(SentenceOf([&] { MakeJob("fake", {"lamp\xff.exr"}, *task_, 2); }),
              HasSubstr("is no UTF-8"));
}

}  // namespace
}  // namespace luxfield::shard
